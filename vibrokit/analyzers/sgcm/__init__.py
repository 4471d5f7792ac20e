"""Stochastic generalized cell mapping on ln ρ: densities on the section, and rates of exit."""

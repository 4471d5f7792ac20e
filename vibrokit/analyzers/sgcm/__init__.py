"""Stochastic generalized cell mapping on ln p: densities on the section, and rates of exit."""

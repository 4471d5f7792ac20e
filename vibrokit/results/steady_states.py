"""SteadyStates: the attractors at one value of a parameter."""

from __future__ import annotations

import dataclasses

from vibrokit.results.attractor import Attractor
from vibrokit.results.finding import Finding


@dataclasses.dataclass(frozen=True, eq=False)
class SteadyStates:
    """The steady states at one value of the parameter.

    Attributes
    ----------
    value : float
    attractors : tuple of Attractor
        Labelled by their places. Orbits are thinned to some 1000 samples; basin fractions are NaN if the work was
        stopped before them.
    branches : tuple of int
        The branch that each attractor belongs to.
    findings : tuple of Finding
        What was found and what was not, or why nothing was found.
    """

    value: float
    attractors: tuple[Attractor, ...]
    branches: tuple[int, ...]
    findings: tuple[Finding, ...] = ()

"""ShotTolerances: how near the attractor paths start, and which of them count as exit paths of their own."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class ShotTolerances:
    """Ratios of actions and of lengths.

    Attributes
    ----------
    edge : float
        Radius of the inner edge of the domain, at most, over the distance to the exit. A start there misses its cube,
        1e-6, of the action; a path takes longer only with the logarithm of its inverse.
    linear : float
        Error of the quadratic form that is accepted of an edge: paths lose it near an attractor that grazes a stop.
    growth : float
        Of radii across a shell, so that its outer edge, a tenth of the distance to the exit, is in the linear range.
    jump : float
        Ratio of the actions of neighbours that are of different branches: smooth ones vary less from box to box. Exits
        that cost so much more than the least are confirmed, so that they are among the minima.
    same : float
        Distance between two curves, over their extent, within which half of the states of one path are.
    dearest : float
        Times the least action to a target: paths that cost more are not polished.
    paths : int
        Paths to one target, at most, that are polished.
    steps : float
        Change of the least action that ends the search with finer steps, for the error by the steps.
    """

    edge: float = 0.01
    linear: float = 0.02
    growth: float = 10.0
    jump: float = 1.5
    same: float = 0.03
    dearest: float = 3.0
    paths: int = 8
    steps: float = 1e-5


TOLERANCES = ShotTolerances()

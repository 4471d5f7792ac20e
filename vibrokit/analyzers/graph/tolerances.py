"""GraphTolerances: how far grids reach, how long steps are, and which finer grids are of use."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class GraphTolerances:
    """Numbers that decide the effort of the graph; the costs that they compare are V at exits and actions of paths.

    Attributes
    ----------
    steps : float
        Relative change of a cost by linearization over a step that is accepted; over an eighth of a period it is 0.002.
    room : float
        Times the cost of the costliest exit: the level up to which V is computed and nodes are covered.
    far_less : float
        Of the cost of the costliest exit: below it, an exit gets grids that reach no farther than it needs.
    below : float
        Times the action of a known path: V is lower only by linearization over steps that are too long.
    loose : float
        Times the action of a known path: a grid with higher V is too large for that path.
    hopeless : float
        Times the action of known paths, on a quarter of the nodes along each side: with more, grids around these paths
        are given up. Twice the nodes divided V by 1.7 to 3.5 on scenes where the graph was of use.
    vague : float
        Of a path's action: with a larger error the graph cannot exclude a path of half the action.
    by_path : float
        Factor on the difference from the action of a path, as the part of the error that linearization makes: the
        fixed ends of the path make its action an upper bound.
    """

    steps: float = 0.01
    room: float = 1.2
    far_less: float = 0.25
    below: float = 0.9
    loose: float = 1.5
    hopeless: float = 16.0
    vague: float = 0.5
    by_path: float = 2.0


TOLERANCES = GraphTolerances()

"""PathTolerances: what is accepted of extremal paths, and how much is done for them."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class PathTolerances:
    """Accuracies of extremal paths, relative to their size and action.

    Attributes
    ----------
    accepted : float
        Misfit of a path. The action is stationary, so that it is wrong by the square of this.
    rough : float
        Misfit of a path that starts farther from its source than the final one.
    hopeful : float
        Misfit up to which a path is solved for from the orbit itself; those that were found had up to 0.012.
    radius : float
        Within this part of its extent around its ends the linearized equations replace a path.
    unchanged : float
        Change of the action after which a path is not brought nearer to its ends.
    lasting : float
        Change by which a path that starts on its orbit is accepted, when it is made twice as long.
    worth : float
        Times the least action known: costlier candidates are skipped. Searches price a path to a few percent.
    evaluations : int
        Of the misfits, at most; a path that converges at all needs 10 to 60, from momenta or a longer path no more than
        a third of this, and one that is known but near its ends an eighth.
    """

    accepted: float = 1e-9
    rough: float = 1e-6
    hopeful: float = 0.02
    radius: float = 1e-4
    unchanged: float = 1e-8
    lasting: float = 1e-6
    worth: float = 1.25
    evaluations: int = 200


TOLERANCES = PathTolerances()

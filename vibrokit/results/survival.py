"""Survival: how long motion went on without settling, the evidence that tells chaos from a long transient."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class Survival:
    """Starts that had settled on nothing, followed for long: how many settled after all, and when.

    Attributes
    ----------
    stepper : str
        What carried them.
    starts : int
    periods : int
        How long each was followed, at most.
    survivors : int
        Starts that had settled on nothing by then.
    lifetime : float
        Mean time until a start settles (periods), by maximum likelihood from all that did and did not; infinite where
        none did.
    lifetime_error : float
        Its standard error.
    settled_after : int array (starts,)
        When each settled (periods); −1 where it did not.
    """

    stepper: str
    starts: int
    periods: int
    survivors: int
    lifetime: float
    lifetime_error: float
    settled_after: NDArray[np.int64]

    def __str__(self) -> str:
        words = (
            f"{self.survivors} of {self.starts} starts had not settled after {self.periods} periods ({self.stepper})"
        )
        if not np.isfinite(self.lifetime):
            return f"{words}, and none ever did"
        return f"{words}; those that do, live {self.lifetime:.3g} ± {self.lifetime_error:.2g} periods"

"""Survival: how long motion went on without settling, the evidence that separates chaos from a long transient."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray


@dataclasses.dataclass(frozen=True, eq=False)
class Survival:
    """Long runs of starts that had not settled: how many settled after all, and when.

    Attributes
    ----------
    stepper : str
        Stepper of the integration.
    starts : int
    periods : int
        Largest number of periods for which each was followed.
    survivors : int
        Starts that had not settled by then.
    lifetime : float
        Mean time until a start settles (periods), by maximum likelihood from those that did and those that did not;
        infinite if none did.
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
            return f"{words}, and none ever settled"
        return f"{words}; mean time until a start settles: {self.lifetime:.3g} ± {self.lifetime_error:.2g} periods"

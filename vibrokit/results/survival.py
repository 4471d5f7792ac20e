"""Survival: how long motion went on without settling, the evidence that separates chaos from a long transient."""

from __future__ import annotations

import dataclasses
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from vibrokit.documented import documented
from vibrokit.results.fields import Length, Series

_SETTLED = Series(
    "forcing periods until the start settled; -1 if it did not", length=Length("start", "starts"), low=-1
)  # fmt: skip


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class Survival:
    """Long runs of starts that had not settled: how many settled after all, and when.

    The lifetime is the estimate of maximum likelihood from the starts that settled and those that did not.
    """

    stepper: Annotated[str, "stepper of the integration"]
    starts: Annotated[int, "number of starts"]
    periods: Annotated[int, "forcing periods for which starts were followed"]
    survivors: Annotated[int, "starts that had not settled by then"]
    lifetime: Annotated[float, "mean time until a start settles, in forcing periods; infinite if none did"]
    lifetime_error: Annotated[float, "standard error of the lifetime, in forcing periods"]
    settled_after: Annotated[NDArray[np.int64], _SETTLED]

    def __str__(self) -> str:
        words = (
            f"{self.survivors} of {self.starts} starts had not settled after {self.periods} periods ({self.stepper})"
        )
        if not np.isfinite(self.lifetime):
            return f"{words}, and none ever settled"
        return f"{words}; mean time until a start settles: {self.lifetime:.3g} ± {self.lifetime_error:.2g} periods"

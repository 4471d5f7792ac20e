"""RateAnalyzer: a method that gives exit rates at several noise intensities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.oscillator import Oscillator
from vibrokit.structure.validation import intensities

Variable = tuple[tuple[str, ...], NDArray[Any], dict[str, str]]


class RateAnalyzer(Analyzer):
    """A method that gives exit rates at several noise intensities. Abstract.

    Parameters
    ----------
    intensities : tuple of float, optional
        Noise intensities D (m² s⁻³); by default 1.5, 1.2 and 1 times the scene's.
    """

    takes_intensities: ClassVar[bool] = True

    intensities: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.intensities is not None:
            object.__setattr__(self, "intensities", intensities(type(self).__name__, self.intensities))

    def least_intensity(self, osc: Oscillator) -> float:
        """The least of the intensities."""
        return min(self.intensities) if self.intensities else super().least_intensity(osc)

    def wanted_intensities(self, osc: Oscillator) -> tuple[float, ...]:
        """Return the intensities, by default three: so many show how a prefactor depends on D.

        Raises StructureError if none is given and the scene's is 0.
        """
        assert osc.noise is not None  # every analyzer checks that
        if self.intensities is None and not osc.noise.intensity > 0:
            raise StructureError("the noise has the intensity 0, so nothing leaves; give intensities=(…,).")
        return self.intensities or tuple(factor * osc.noise.intensity for factor in (1.5, 1.2, 1.0))


def rate_variables(
    problem: ExitProblem,
    intensities: Sequence[float],
    methods: Sequence[str],
    targets: Sequence[int],
    values: Mapping[str, tuple[NDArray[np.float64], str]],
) -> dict[str, Variable]:
    """Return the arrays that `vibrokit.results.rated.RatedResult` reads, of one attractor.

    `values` are arrays over (intensity, target) by name, ``log_rate`` among them, each with its long name.
    """
    over = ("intensity_index",)
    rates: dict[str, Variable] = {
        name: ((*over, "exit_index"), array, {"long_name": text, "units": "1"})
        for name, (array, text) in values.items()
    }
    return rates | {
        "rate_target": (("exit_index",), np.array(targets, dtype=np.int64), {"long_name": "label of the target"}),
        "rate_event": ((), np.array(problem.exit.event), {"long_name": "what counts as an exit"}),
        "rate_intensity": (over, np.array(intensities), {"long_name": "noise intensity", "units": "m2 s-3"}),
        "rate_method": (over, np.array(methods), {"long_name": "how the rate was found"}),
    }

"""What is found at one noise intensity and how far its rates may be wrong, and the limit of weak noise."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.sgcm.density_grid import DensityGrid, resolved
from vibrokit.analyzers.sgcm.quasi_stationary import Committor, QuasiStationary
from vibrokit.results.arrhenius import ENOUGH

Array = NDArray[np.float64]
Committors = Mapping[int, Committor]


@dataclasses.dataclass(frozen=True, eq=False)
class AtIntensity:
    """The density that has not left an attractor, and how fast it leaves, at one intensity.

    On a coarser grid there is the same again, and committors with other settings. Edges of basins are where states are
    committed nearer to them, or cells of the basins that count themselves.
    """

    density: QuasiStationary
    committors: Committors
    coarser: AtIntensity | None = None
    fewer_steps: Committors = dataclasses.field(default_factory=dict)
    other_edges: Committors | None = None  # None if no basin counts
    larger_cores: Committors | None = None  # None if no other core counts; cores are defined, so this is no error

    @property
    def intensity(self) -> float:
        """D (m² s⁻³)."""
        return self.density.propagator.intensity

    @property
    def grid(self) -> DensityGrid:
        """The nodes."""
        return self.density.grid

    @property
    def log_rates(self) -> dict[int, float]:
        """By target: ln of the probability that leaves in one section interval for good."""
        return {target: known.log_rate for target, known in self.committors.items()}

    @property
    def errors(self) -> dict[int, float]:
        """By target: error estimate of ln rate, the sum of the changes that are errors and of what iteration leaves."""
        return {
            target: float(np.abs(self.changes(target)[:3]).sum()) + known.change
            for target, known in self.committors.items()
        }

    def changes(self, target: int) -> Array:
        """Return by how much ln rate changes in four ways, each with its sign, shape (4,); inf where not known.

        They are nodes farther apart, fewer steps, other edges of basins, and larger cores.
        """
        coarse = _log_rate({} if self.coarser is None else self.coarser.committors, target)
        found = [_log_rate(self.committors, target) - coarse] + [
            0.0 if each is None else coarse - _log_rate(each, target)
            for each in (self.fewer_steps, self.other_edges, self.larger_cores)
        ]
        return np.where(np.isfinite(found), found, math.inf)

    @property
    def converged(self) -> bool:
        """Whether all iterations have ended by themselves."""
        return self.density.converged and all(c.converged for c in self.committors.values())

    @property
    def log_density(self) -> Array:
        """ln ρ; NaN where it is not resolved, because it is at the floor."""
        return resolved(self.density.phi)

    @property
    def at_edge(self) -> float:
        """ln of the probability at the outermost nodes."""
        outermost = np.ones(self.grid.shape, dtype=bool)
        outermost[1:-1, 1:-1] = False
        return self.grid.mass(self.density.phi, outermost)

    def begun(self, grid: DensityGrid, intensity: float) -> tuple[Array, dict[int, Array]]:
        """Return ln ρ and, by target, ln of the committor to begin iteration from on another grid, at less noise.

        The shape of −D ln ρ and of −D ln c depends little on D. Iteration starts from an underestimate: a deficit fills
        faster than an excess drains, which may stay near a saddle for long. So depths grow as D^−1.1.
        """
        ratio = (self.intensity / intensity) ** 1.1  # above the prefactors' share in hertz-0.570 at D = 1e-5
        known = {target: grid.resampled(c.log_values, self.grid) * ratio for target, c in self.committors.items()}
        return grid.resampled(self.density.phi, self.grid) * ratio, known


def _log_rate(committors: Committors, target: int) -> float:
    return committors[target].log_rate if target in committors else math.nan


def limit_of(
    intensities: Sequence[float],
    log_times: Sequence[float],
    errors: Sequence[float],
    changes: Sequence[Sequence[float]] = (),
) -> tuple[float, float]:
    """Return the limit of D ln τ as D → 0, and its error estimate.

    The value is that of ln τ = ΔU/D + c through the two least intensities. How a prefactor depends on D is not known.
    So the error estimate is infinite with two intensities. With more it is the largest change by one of these, plus
    the change by the errors of ln τ:

    - a prefactor proportional to D or 1/D. Kramers' rate has 1/D at weak damping, and √D if the force is periodic and
      not weak (Lehmann, Reimann & Hänggi, Phys. Rev. Lett. 84, 1639, 2000);
    - a correction D/ΔU to the prefactor, as in the next order of Kramers' formula;
    - the power of D that the third intensity shows, and twice the correction of first order in D that it shows, since
      terms of higher order are not known.

    Parameters
    ----------
    intensities : sequence of float
        D, two at least, in descending order.
    log_times : sequence of float
        ln τ of each.
    errors : sequence of float
        Error estimates of ln τ that are independent.
    changes : sequence of sequence of float
        Changes of ln τ, with their signs, by what may be wrong at all intensities alike. Each adds what it changes of
        the limit, or of D ln τ at the least intensity, if that is more.
    """
    d, times = np.array(intensities), np.array(log_times)
    value = _limit(d[-2:], times[-2:])
    if len(d) < ENOUGH:
        return value, math.inf
    powers = -np.log(d)
    of_prefactor = [
        _limit(d[-2:], powers[-2:]),
        d[-2] * d[-1] / max(abs(value), d[-1]),
        _limit(d[-3:], times[-3:], powers[-3:]) - value,
        2.0 * (_limit(d[-3:], times[-3:], d[-3:]) - value),
    ]
    propagated = math.hypot(d[-1] * errors[-1] * d[-2], d[-2] * errors[-2] * d[-1]) / (d[-2] - d[-1])
    systematic = sum(max(abs(_limit(d[-2:], each[-2:])), abs(d[-1] * each[-1])) for each in np.array(changes))
    return value, float(np.max(np.abs(of_prefactor))) + propagated + float(systematic)


def _limit(d: Array, times: Array, *corrections: Array) -> float:
    """ΔU of ln τ = ΔU/D + c + further terms, as many as there are intensities."""
    terms = np.stack([1.0 / d, np.ones_like(d), *corrections], axis=1)
    return float(np.linalg.solve(terms, times)[0])

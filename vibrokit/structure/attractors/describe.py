"""Describes steady states: turns an orbit that was found into the record of an attractor, with its contacts."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor, Survival
from vibrokit.results.basins import UNSETTLED
from vibrokit.structure.along_x import turns_to, wrapped
from vibrokit.structure.attractors.wandering import LyapunovEstimate
from vibrokit.structure.autonomous import equilibrium_exponents
from vibrokit.structure.orbits import EQUAL, SAMPLES, Orbit, visited
from vibrokit.structure.scales import size_of
from vibrokit.symbolic.flow_kind import Flow

Array = NDArray[np.float64]


def describe_orbit(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Attractor:
    """Describe a stable orbit or limit cycle, or the equilibrium that an orbit of an autonomous scene rests at."""
    path = _path_of(osc, orbit, stepper)
    resting = osc.autonomous and orbit.kind != "limit cycle" and _still(path)
    return _described(
        path,
        kind="equilibrium" if resting else orbit.kind,
        period=orbit.period,
        duration=0.0 if resting else orbit.duration,
        points=wrapped(osc, visited(osc, orbit, stepper)),
        turns=int(turns_to(osc, path.states[-1:] - path.states[:1])[0]),
        multipliers=orbit.multipliers,
        exponents=equilibrium_exponents(osc, orbit.point) if resting else orbit.exponents,
        residual=orbit.residual,
        error=orbit.moved_by_tightening(osc, stepper, 1),
    )  # fmt: skip


def is_cycle(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> bool:
    """Whether an orbit of an autonomous scene moves: a limit cycle that nearly repeats after section intervals."""
    return osc.autonomous and not _still(_path_of(osc, orbit, stepper))


def describe_wandering(
    osc: Oscillator,
    kind: str,
    sample: Array,
    estimate: LyapunovEstimate,
    survival: tuple[Survival, ...],
    stepper: Stepper,
) -> Attractor:
    """Describe motion that never repeats, from a sample (count, n) of its points on the section.

    Its hits are per period. Each period is started from the section as by the section map, whose attractor this is.
    """
    periods, point, pieces, spacing = 64, sample[0], list[Array](), osc.section_interval / SAMPLES
    for _ in range(periods):
        pieces.append(record(osc, Flow.STATE, stepper, point, 0.0, spacing, SAMPLES)[:-1])
        point = run_ensemble(osc, Flow.STATE, stepper, point[None], 1).states[0]
    found = _described(
        Path(osc, stepper, np.concatenate([*pieces, point[None]]), 0.0, spacing),
        kind=kind,
        period=0,
        duration=np.nan,
        points=sample,
        multipliers=np.empty(0, dtype=complex),
        exponents=np.array([estimate.value], dtype=complex),
        exponent_error=estimate.error,
        residual=np.nan,
        error=np.nan,
        survival=survival,
    )  # fmt: skip
    return dataclasses.replace(found, hits={side: hits / periods for side, hits in found.hits.items()})


def _described(path: Path, *, exponent_error: float = 0.0, **own: Any) -> Attractor:
    """Return the record of an attractor, with its contacts along a path on it; label and basin are set later."""
    seen = {barrier.side: _Contacts(path, stop) for stop, barrier in enumerate(path.osc.barriers)}
    return Attractor(
        label=UNSETTLED,
        orbit=path.states[:, :2],
        exponent_error=exponent_error,
        hits={side: one.hits for side, one in seen.items()},
        peak_depth={side: one.depth for side, one in seen.items()},
        peak_force={side: one.force for side, one in seen.items()},
        basin_fraction=0.0,
        basin_fraction_error=0.0,
        **own,
    )


def _path_of(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Path:
    """Samples along an orbit, so many in a section interval."""
    count = SAMPLES * max(1, round(orbit.duration / osc.section_interval))
    return Path.recorded(osc, stepper, wrapped(osc, orbit.point), 0.0, orbit.duration / count, count)


def _still(path: Path) -> bool:
    size = size_of(path.osc) + np.abs(path.states).max()
    return bool(np.ptp(path.states, axis=0).max() < EQUAL * size)


@dataclasses.dataclass(frozen=True, eq=False)
class Path:
    """A recorded stretch of motion: states (count, n), the time of the first, and that from one to the next (s)."""

    osc: Oscillator
    stepper: Stepper
    states: Array
    start: float
    spacing: float

    @classmethod
    def recorded(
        cls, osc: Oscillator, stepper: Stepper, point: Array, start: float, spacing: float, count: int
    ) -> Path:
        """Integrate from a point at a time."""
        return cls(osc, stepper, record(osc, Flow.STATE, stepper, point, start, spacing, count), start, spacing)

    def between(self, first: int, last: int) -> Path:
        """Return the stretch between two samples, with enough samples for its peaks."""
        begin, states = self.start + first * self.spacing, self.states[first : last + 1]
        if last - first >= 32 or first == last:
            return dataclasses.replace(self, states=states, start=begin)
        finer = self.spacing * (last - first) / 64
        return Path.recorded(self.osc, self.stepper, states[0], begin, finer, 64)

    def around(self, first: int, last: int) -> Path:
        """Return the stretch from the sample before one to that after another."""
        return self.between(max(first - 1, 0), min(last + 1, len(self.states) - 1))

    def greatest(self, measure: Callable[[Array], Array]) -> float:
        """Return the largest value of a function of the state, from ever finer samples around it."""
        path, best = self, 0.0
        for _ in range(5):
            values = measure(path.states)
            top = int(np.argmax(values))
            best = max(best, float(values[top]))
            path = path.around(top, top)
            if len(path.states) < 2:
                break
        return best


class _Contacts:
    """The contacts with one stop along a whole orbit: entries, largest depth (m), largest push (m s⁻²)."""

    def __init__(self, path: Path, stop: int) -> None:
        self.barrier, theta = path.osc.barriers[stop], theta_of(path.osc)
        law = kernel_for(path.osc, Flow.STATE, path.stepper).module.law
        depth = self._depth(path.states)
        touching = np.flatnonzero(depth > 0)
        runs = [run for run in np.split(touching, np.flatnonzero(np.diff(touching) > 1) + 1) if run.size]
        unseen = self._unseen(path, 6)
        stretches = [*(path.around(run[0], run[-1]) for run in runs), *unseen]

        def pushes(states: Array) -> Array:
            pairs = zip(self._depth(states), self._rate(states), strict=True)
            return np.array([float(law(stop, depth, rate, theta)) if depth > 0 else 0.0 for depth, rate in pairs])

        self.hits = int(np.sum((depth[:-1] <= 0) & (depth[1:] > 0))) + len(unseen)
        self.depth = max((each.greatest(self._depth) for each in stretches), default=0.0)
        self.force = max((each.greatest(pushes) for each in stretches), default=0.0)

    def _depth(self, states: Array) -> Array:
        return self.barrier.sign * (states[:, 0] - self.barrier.position)

    def _rate(self, states: Array) -> Array:
        return self.barrier.sign * states[:, 1]

    def _unseen(self, path: Path, finer: int) -> list[Path]:
        """Stretches with a contact between two samples that are clear of the stop: the velocity turns next to it.

        Such a stretch is integrated again with finer samples, at most so many times.
        """
        depth, rate = self._depth(path.states), self._rate(path.states)
        clear, turns = (depth[:-1] <= 0) & (depth[1:] <= 0), (rate[:-1] > 0) & (rate[1:] < 0)
        reachable = depth[:-1] + rate[:-1] * path.spacing > 0
        found = []
        for index in np.flatnonzero(clear & turns & reachable):
            closer = path.between(int(index), int(index) + 1)
            if self._depth(closer.states).max() > 0:
                found.append(closer)
            elif finer > 0:
                found += self._unseen(closer, finer - 1)
        return found

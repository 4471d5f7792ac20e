"""Describes steady states: turns an orbit that was found into the record of an attractor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.survival import Survival
from vibrokit.structure.contacts import Contacts, Path, contacts_along
from vibrokit.structure.cycles import Cycle, equilibrium_exponents, refine_cycle
from vibrokit.structure.lyapunov import LyapunovEstimate
from vibrokit.structure.orbits import Orbit, refine_orbit, visited
from vibrokit.structure.scales import size_of
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 1024  # along one forcing period
_LOOKED_AT = 64  # periods of motion that never repeats
_RESTING = 1e-6

Array = NDArray[np.float64]


def describe_orbit(osc: Oscillator, orbit: Orbit, stepper: Stepper) -> Attractor:
    """Describe a stable periodic orbit, or an equilibrium."""
    period = orbit.period
    path = _path(osc, orbit.point, period * osc.section_interval, _SAMPLES * period, stepper)
    resting = osc.autonomous and np.ptp(path.states, axis=0).max() < _RESTING * (
        size_of(osc) + np.abs(path.states).max()
    )
    multipliers = np.linalg.eigvals(orbit.monodromy).astype(complex)
    duration = 0.0 if resting else period * osc.section_interval
    exponents = equilibrium_exponents(osc, orbit.point, stepper) if resting else _rates(multipliers, duration)
    try:
        tighter = refine_orbit(osc, orbit.point, period, stepper.refined())
        error = float(np.linalg.norm(tighter.point - orbit.point))
    except StructureError:  # at a finer setting there is no such orbit
        error = np.inf
    seen = _contacts(osc, path, stepper)
    return Attractor(
        label=UNSETTLED,
        kind="equilibrium" if resting else "periodic",
        period=period,
        duration=duration,
        points=visited(osc, orbit, stepper),
        orbit=path.states[:, :2],
        multipliers=multipliers,
        exponents=exponents,
        exponent_error=0.0,
        hits={side: one.hits for side, one in seen.items()},
        peak_depth={side: one.depth for side, one in seen.items()},
        peak_force={side: one.force for side, one in seen.items()},
        basin_fraction=0.0,
        basin_fraction_error=0.0,
        residual=orbit.residual,
        error=error,
    )


def describe_cycle(osc: Oscillator, cycle: Cycle, stepper: Stepper) -> Attractor:
    """Describe a stable limit cycle of an autonomous scene."""
    count = _SAMPLES * max(1, round(cycle.duration / osc.section_interval))
    path = _path(osc, cycle.point, cycle.duration, count, stepper)
    multipliers = np.linalg.eigvals(cycle.monodromy).astype(complex)
    tighter = refine_cycle(osc, cycle.point, cycle.duration, stepper.refined())
    seen = _contacts(osc, path, stepper)
    return Attractor(
        label=UNSETTLED,
        kind="limit cycle",
        period=1,
        duration=cycle.duration,
        points=cycle.point[None],
        orbit=path.states[:, :2],
        multipliers=multipliers,
        exponents=_rates(multipliers, cycle.duration),
        exponent_error=0.0,
        hits={side: one.hits for side, one in seen.items()},
        peak_depth={side: one.depth for side, one in seen.items()},
        peak_force={side: one.force for side, one in seen.items()},
        basin_fraction=0.0,
        basin_fraction_error=0.0,
        residual=cycle.residual,
        error=float(np.linalg.norm(tighter.point - cycle.point)),
    )


def describe_wandering(
    osc: Oscillator,
    kind: str,
    sample: Array,
    estimate: LyapunovEstimate,
    survival: tuple[Survival, ...],
    stepper: Stepper,
) -> Attractor:
    """Describe motion that never repeats, from a sample (count, n) of its points on the section."""
    path = _wandering_path(osc, sample[0], stepper)
    seen = _contacts(osc, path, stepper)
    return Attractor(
        label=UNSETTLED,
        kind=kind,
        period=0,
        duration=np.nan,
        points=sample,
        orbit=path.states[:, :2],
        multipliers=np.empty(0, dtype=complex),
        exponents=np.array([estimate.value], dtype=complex),
        exponent_error=estimate.error,
        hits={side: one.hits / _LOOKED_AT for side, one in seen.items()},
        peak_depth={side: one.depth for side, one in seen.items()},
        peak_force={side: one.force for side, one in seen.items()},
        basin_fraction=0.0,
        basin_fraction_error=0.0,
        residual=np.nan,
        error=np.nan,
        survival=survival,
    )


def _path(osc: Oscillator, point: Array, duration: float, count: int, stepper: Stepper) -> Path:
    spacing = duration / count
    return Path(record(osc, Flow.STATE, stepper, point, 0.0, spacing, count), 0.0, spacing)


def _wandering_path(osc: Oscillator, point: Array, stepper: Stepper) -> Path:
    """Some periods, each begun at the section anew: as the section map does, whose set this is."""
    interval, pieces = osc.section_interval, []
    for _ in range(_LOOKED_AT):
        pieces.append(_path(osc, point, interval, _SAMPLES, stepper).states[:-1])
        point = run_ensemble(osc, Flow.STATE, stepper, point[None], 1).states[0]
    return Path(np.concatenate([*pieces, point[None]]), 0.0, interval / _SAMPLES)


def _rates(multipliers: NDArray[np.complex128], duration: float) -> NDArray[np.complex128]:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(multipliers) / duration, dtype=np.complex128)


def _contacts(osc: Oscillator, path: Path, stepper: Stepper) -> dict[str, Contacts]:
    return {barrier.side: contacts_along(osc, path, stop, stepper) for stop, barrier in enumerate(osc.barriers)}

"""Describes steady states: turns an orbit that was found into the record of an attractor."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import UNSETTLED
from vibrokit.results.survival import Survival
from vibrokit.structure.attractors.contacts import Path, contacts_along
from vibrokit.structure.attractors.lyapunov import LyapunovEstimate
from vibrokit.structure.cycles import Cycle, refine_cycle
from vibrokit.structure.equilibria import equilibrium_exponents
from vibrokit.structure.orbits import Orbit, exponents_of, moved_by_tightening, refine_orbit, visited
from vibrokit.structure.scales import size_of
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 1024  # along one forcing period
_LOOKED_AT = 64  # periods of motion that never repeats
_RESTING = 1e-6
_TIGHTENED = 1  # time, for the error

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
    exponents = equilibrium_exponents(osc, orbit.point) if resting else exponents_of(multipliers, duration)

    def refined(finer: Stepper) -> Array:
        return refine_orbit(osc, orbit.point, period, finer).point

    return _described(
        osc, path, stepper,
        kind="equilibrium" if resting else "periodic",
        period=period,
        duration=duration,
        points=visited(osc, orbit, stepper),
        multipliers=multipliers,
        exponents=exponents,
        residual=orbit.residual,
        error=moved_by_tightening(orbit.point, refined, stepper, _TIGHTENED),
    )  # fmt: skip


def describe_cycle(osc: Oscillator, cycle: Cycle, stepper: Stepper) -> Attractor:
    """Describe a stable limit cycle of an autonomous scene."""
    count = _SAMPLES * max(1, round(cycle.duration / osc.section_interval))
    path = _path(osc, cycle.point, cycle.duration, count, stepper)
    multipliers = np.linalg.eigvals(cycle.monodromy).astype(complex)

    def refined(finer: Stepper) -> Array:
        return refine_cycle(osc, cycle.point, cycle.duration, finer).point

    return _described(
        osc, path, stepper,
        kind="limit cycle",
        period=1,
        duration=cycle.duration,
        points=cycle.point[None],
        multipliers=multipliers,
        exponents=exponents_of(multipliers, cycle.duration),
        residual=cycle.residual,
        error=moved_by_tightening(cycle.point, refined, stepper, _TIGHTENED),
    )  # fmt: skip


def describe_wandering(
    osc: Oscillator,
    kind: str,
    sample: Array,
    estimate: LyapunovEstimate,
    survival: tuple[Survival, ...],
    stepper: Stepper,
) -> Attractor:
    """Describe motion that never repeats, from a sample (count, n) of its points on the section."""
    found = _described(
        osc, _wandering_path(osc, sample[0], stepper), stepper,
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
    # Hits are per orbit, and of motion that never repeats per period.
    return dataclasses.replace(found, hits={side: hits / _LOOKED_AT for side, hits in found.hits.items()})


def _described(osc: Oscillator, path: Path, stepper: Stepper, *, exponent_error: float = 0.0, **own: Any) -> Attractor:
    """The record of an attractor: what is its own, and what is seen along a path on it; label and basin come later."""
    seen = {barrier.side: contacts_along(osc, path, stop, stepper) for stop, barrier in enumerate(osc.barriers)}
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

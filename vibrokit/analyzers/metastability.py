"""Metastability: whether an attractor is a state of its own at some noise, whichever method gave its rates.

A rate describes a state that lasts much longer than its relaxation, and that noise keeps inside its basin.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.analyzers.neighbourhoods import core_of, relaxation_of
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.attractor import Attractor
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding
from vibrokit.results.rated import HELD, METASTABLE

Array = NDArray[np.float64]


def metastability(problem: ExitProblem, data: xarray.Dataset) -> tuple[xarray.Dataset, tuple[Finding, ...]]:
    """Return the data of one attractor with what decides which are metastable, and what of that limits its rates.

    Data without rates is returned as it is. Otherwise it gets ``relaxation_time`` (s) of all attractors, over
    ``core_source``, and `core_shares` over (``intensity_index``, ``core_source``, ``core_label``).
    """
    if "log_rate" not in data or "rate_intensity" not in data:
        return data, ()
    attractors, intensities = problem.structure.attractors, data["rate_intensity"].values.tolist()
    interval = problem.osc.section_interval
    relaxations = interval * np.array([relaxation_of(attractor, interval) for attractor in attractors])
    shares = np.array([[core_shares(problem, a, intensity) for a in attractors] for intensity in intensities])
    added = data.assign(
        relaxation_time=(
            ("core_source",), relaxations, {"long_name": "time in which deviations fall by a factor e", "units": "s"},
        ),
        core_share=(
            ("intensity_index", "core_source", "core_label"), shares,
            {"long_name": "share of the core of an attractor in the basin of each", "units": "1"},
        ),
    )  # fmt: skip
    findings = []
    for intensity, logs in zip(intensities, data["log_rate"].values, strict=True):
        left = float(np.nansum(np.exp(logs))) * relaxations[problem.source]
        if left * METASTABLE > 1.0:
            values = {"intensity": intensity, "ratio": 1.0 / left, "least": METASTABLE}
            findings.append(Finding.of(Code.NOT_METASTABLE, problem.source, **values))
    return added, tuple(findings)


def targets_at(problem: ExitProblem, intensity: float) -> tuple[Attractor, ...]:
    """Return the attractors that may be reached and are states of their own at some noise.

    Noise around another state keeps arriving in the core of one that is not, and nothing has been left then.
    """
    return tuple(target for target in problem.targets if _held(problem, target, intensity) >= HELD)


def with_states(problem: ExitProblem, intensities: Sequence[float]) -> tuple[tuple[float, ...], tuple[Finding, ...]]:
    """Return those intensities at which there are a state to leave and one to reach, and what is not a state.

    Where position or the basin's boundary decides, nothing has to settle, and all of them are returned.
    """
    if not _by_commitment(problem):
        return tuple(intensities), ()
    kept, findings = [], []
    for intensity in intensities:
        own = _held(problem, problem.attractor, intensity)
        if own < HELD:
            findings.append(Finding.of(Code.CORE_EXCEEDS_BASIN, problem.source, intensity=intensity, share=own))
            continue
        held = {target.label: _held(problem, target, intensity) for target in problem.targets}
        if problem.outlet is not None or max(held.values()) >= HELD:
            kept.append(intensity)
        for label, share in held.items():
            if share < HELD:
                found = Finding.of(Code.TARGET_EXCEEDS_BASIN, problem.source, label, intensity=intensity, share=share)
                findings.append(found)
    return tuple(kept), tuple(findings)


def core_shares(problem: ExitProblem, attractor: Attractor, intensity: float) -> Array:
    """Return which share of an attractor's core lies in the basin of each attractor, by label.

    It is NaN where no core decides about exits, where the core is too narrow for the cells of the basins, or where
    noise gives it no width. At most 64 ellipses are sampled, each by 400 states at equal areas: shares are known to a
    few per cent.
    """
    structure = problem.structure
    basins, unknown = structure.basins, np.full(len(structure.attractors), np.nan)
    if not _by_commitment(problem):
        return unknown
    try:
        centres, roots = core_of(problem, attractor, intensity)
    except StructureError:
        return unknown
    some = np.unique(np.linspace(0, len(centres) - 1, min(len(centres), 64)).astype(int))
    axes = np.linalg.inv(roots[some])
    cells = np.array([np.ptp(basins.region.x), np.ptp(basins.region.v)]) / basins.labels.shape
    if np.linalg.svd(axes / cells[:, None], compute_uv=False).min() < 1.0:
        return unknown
    order = np.arange(400) + 0.5
    radius, angle = np.sqrt(order / len(order)), math.pi * (1.0 + math.sqrt(5.0)) * order
    disk = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    labels = basins.at(problem.on_turn(centres[some, None] + np.einsum("nij,kj->nki", axes, disk)))
    return np.array([np.mean(labels == other.label) for other in structure.attractors])


def _held(problem: ExitProblem, attractor: Attractor, intensity: float) -> float:
    """Share of an attractor's core that lies in its own basin; 1 where that is not known."""
    share = float(core_shares(problem, attractor, intensity)[attractor.label])
    return 1.0 if math.isnan(share) else share


def _by_commitment(problem: ExitProblem) -> bool:
    """Whether a state has left when it is in the core of another attractor."""
    return not (problem.exit.by_position or problem.exit.at_boundary)

"""The figures of the paper, redrawn from our records."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from functools import cache, partial
from typing import Any

import numpy as np

from vibrokit.comparison.stationary import StationaryDensity
from vibrokit.plots.artists import Artists
from vibrokit.plots.densities import density_map, sampled_density
from vibrokit.plots.exit_times import ArrheniusLine, ExitTimes, reconciled_times
from vibrokit.reproduction.comparison import target_of, total_fit
from vibrokit.reproduction.published import STATES, Method, paper, published_energies
from vibrokit.reproduction.work import Records
from vibrokit.results.labels import label_of
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.mfet import MFETResult
from vibrokit.results.record import Record
from vibrokit.results.sgcm import SGCMResult
from vibrokit.results.structure import Structure
from vibrokit.scene_file import load_scene

_WALKERS, _PERIODS, _SEED = 40_000, 200, 6  # of the simulation beside Figure 6
_LAST = 12  # periods before an exit that Figure 10 shows


@dataclasses.dataclass(frozen=True)
class Figure:
    """One picture: its number in the paper, what it shows, and what draws it."""

    number: int
    scene: str
    caption: str
    draw: Callable[[], Artists]

    @property
    def name(self) -> str:
        """Name of its file, without the ending."""
        return f"figure-{self.number:02d}-{self.scene}"


def figures(records: Records) -> list[Figure]:
    """Return the pictures whose records are there, in the order of the paper."""
    found = [one for scene, known in records.items() for one in _of_scene(scene, known)]
    return sorted(found, key=lambda one: (one.number, one.scene))


def _of_scene(scene: str, known: dict[str, Record]) -> Iterator[Figure]:
    structure, least, density = (known.get(name) for name in ("structure", "least-action", "density"))
    if isinstance(structure, Structure):
        yield Figure(2, scene, "Attractors, saddles, manifolds and basins on the section.", structure.plot)
        yield Figure(3, scene, "Steady motions in the phase plane.", structure.plot_orbits)
    if isinstance(least, LeastActionResult):
        yield Figure(4, scene, "Most probable exit paths, on the section.", least.plot)
        yield Figure(5, scene, "Momentum and action along these paths; dots lie on the section.", least.plot_history)
    if isinstance(density, SGCMResult) and isinstance(structure, Structure):
        stationary = cache(partial(StationaryDensity.of, density))
        at = f"D = {paper()['density']['intensity']:g} m² s⁻³"
        sampled = partial(_displacements, scene, structure, stationary)
        yield Figure(6, scene, f"Density of displacement at {at}, and a simulation from the same shares.", sampled)
        yield Figure(7, scene, f"Stationary density at {at}.", lambda: _density(stationary()))
        yield Figure(8, scene, f"Quasi-potential −D ln p at {at}.", lambda: stationary().plot())
    times = {state: known.get(f"exit-times-{state}") for state in STATES}
    if isinstance(least, LeastActionResult) and all(isinstance(one, MFETResult) for one in times.values()):
        yield Figure(
            9, scene, "Mean exit times; lines have the published slopes.", partial(_times, scene, times, least)
        )
    escapes = known.get("escapes")
    if isinstance(escapes, MFETResult) and isinstance(least, LeastActionResult):
        caption = "Realizations before an exit, and the most probable exit path."
        yield Figure(10, scene, caption, partial(_escapes, scene, escapes, least))


def _displacements(scene: str, structure: Structure, stationary: Callable[[], StationaryDensity]) -> Artists:
    one, rng = stationary(), np.random.default_rng(_SEED)
    shares = one.occupancies[0].values
    starts = [a.points[rng.integers(len(a.points), size=round(_WALKERS * share)), :2] for a, share in
              zip(structure.attractors, shares / shares.sum(), strict=True)]  # fmt: skip
    sample = load_scene(scene).section_map(np.concatenate(starts), _PERIODS, rng=_SEED)[:, 0]
    marginal = one.density[0].integrate("v")
    return sampled_density(one.x, marginal.values, sample)


def _density(one: StationaryDensity) -> Artists:
    return density_map(one.x, one.v, one.density[0].values)


def _times(scene: str, times: dict[str, Any], least: LeastActionResult) -> Artists:
    slopes = {one.state: one.value for one in published_energies()
              if (one.scene, one.method) == (scene, Method.EXIT_TIMES)}  # fmt: skip
    series, lines = [], []
    for state, result in times.items():
        energy = least.energy(STATES[state], target_of(state))
        fit, label = total_fit(result, energy), energy.source
        title = f"{state}: slope {fit.slope:.3g} ± {fit.slope_error:.1g}"
        series.append(ExitTimes(fit.intensities, fit.log_times, fit.errors, label, title))
        start = float(np.mean(fit.log_times) - slopes[state] * np.mean(1 / fit.intensities))
        lines.append(ArrheniusLine(slopes[state], start, label, f"{state}: published slope {slopes[state]:.4g}"))
    return reconciled_times(series, list(times), lines)


def _escapes(scene: str, escapes: MFETResult, least: LeastActionResult) -> Artists:
    source, target, last = STATES["I"], STATES["N"], _LAST * load_scene(scene).section_interval
    path = least.energy(source, target).path
    return escapes.plot_escapes(
        source=label_of(source, escapes.names), target=target, last=last,
        path=None if path is None else path.q[path.t >= path.t[-1] - last],
    )  # fmt: skip

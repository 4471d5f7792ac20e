"""The figures of the paper, redrawn from our records."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from functools import cache, partial

import numpy as np

from vibrokit.comparison.stationary import StationaryDensity
from vibrokit.oscillator import Oscillator
from vibrokit.plots.artists import Artists
from vibrokit.plots.densities import density_map, sampled_density
from vibrokit.plots.escapes import escapes
from vibrokit.plots.exit_times import ArrheniusLine, ExitTimes, reconciled_times
from vibrokit.reproduction.published import STATES, Method, paper, published_energies, target_of
from vibrokit.reproduction.steps import METHODS, Records
from vibrokit.reproduction.verdicts import of_both, total_fit
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.mfet import MFETResult
from vibrokit.results.record import Record
from vibrokit.results.sgcm import SGCMResult
from vibrokit.results.structure import Structure
from vibrokit.scene_file import load_scene

_LAST, _SPENT = 4, 0.99  # periods that Figure 10 shows, and the share of the action that is spent at their end


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
    structure = known.get("structure")
    least, _, density, times = (of_both(known, name) for name in METHODS)
    if isinstance(structure, Structure):
        yield Figure(2, scene, "Attractors, saddles, manifolds and basins on the section.", structure.plot)
        yield Figure(3, scene, "Steady motions in the phase plane.", structure.plot_orbits)
    if isinstance(least, LeastActionResult):
        yield Figure(4, scene, "Most probable exit paths, on the section.", least.plot)
        yield Figure(5, scene, "Momentum and action along these paths; dots lie on the section.", least.plot_history)
    if isinstance(density, SGCMResult) and isinstance(structure, Structure):
        stationary, intensity = cache(partial(StationaryDensity.of, density)), paper()["density"]["intensity"]
        at = f"D = {intensity:g} m² s⁻³"
        osc = load_scene(scene).replace({"noise.intensity": intensity})
        sampled = partial(_displacements, osc, density, structure, stationary)
        yield Figure(6, scene, f"Density of displacement at {at}, and a simulation from the same shares.", sampled)
        yield Figure(7, scene, f"Stationary density at {at}.", lambda: _density(stationary()))
        yield Figure(8, scene, f"Quasi-potential −D ln ρ at {at}.", lambda: stationary().plot())
    if isinstance(least, LeastActionResult) and isinstance(times, MFETResult):
        caption = "Mean exit times; lines have the published slopes."
        yield Figure(9, scene, caption, partial(_times, scene, times, least))
        if scene == paper()["escapes"]["scene"] and isinstance(structure, Structure):
            caption = f"Realizations in the last {_LAST} periods before an exit, and the most probable exit path."
            yield Figure(10, scene, caption, partial(_escapes, scene, structure, times, least))


def _displacements(
    osc: Oscillator, density: SGCMResult, structure: Structure, stationary: Callable[[], StationaryDensity]
) -> Artists:
    """Draw the density of x, and a simulation of 20 000 walkers; what is left of its start is e⁻⁵."""
    seed = 6
    one, rng = stationary(), np.random.default_rng(seed)
    shares = np.nan_to_num(one.occupancies[0].values)  # what counts with another state has none of its own
    starts = [a.points[rng.integers(len(a.points), size=round(20_000 * share)), :2] for a, share in
              zip(structure.attractors, shares / shares.sum(), strict=True)]  # fmt: skip
    periods = math.ceil(5.0 * float(np.max(density.relaxations)) / osc.section_interval)
    sample = osc.section_map(np.concatenate(starts), periods, rng=seed)[:, 0]
    marginal = one.density[0].integrate("v")
    return sampled_density(one.x, marginal.values, sample)


def _density(one: StationaryDensity) -> Artists:
    return density_map(one.x, one.v, one.density[0].values)


def _times(scene: str, times: MFETResult, least: LeastActionResult) -> Artists:
    slopes = {one.state: one.value for one in published_energies()
              if (one.scene, one.method) == (scene, Method.EXIT_TIMES)}  # fmt: skip
    series, lines = [], []
    for state, source in STATES.items():
        energy = least.energy(source, target_of(state))
        fit, label = total_fit(times, energy), energy.source
        title = f"{state}: slope {fit.slope:.3g} ± {fit.slope_error:.1g}"
        series.append(ExitTimes(fit.intensities, fit.log_times, fit.errors, label, title))
        start = float(np.mean(fit.log_times) - slopes[state] * np.mean(1 / fit.intensities))
        lines.append(ArrheniusLine(slopes[state], start, label, f"{state}: published slope {slopes[state]:.4g}"))
    return reconciled_times(series, list(STATES), lines)


def _escapes(scene: str, structure: Structure, times: MFETResult, least: LeastActionResult) -> Artists:
    """Draw both up to the boundary: realizations settle behind it, and a path takes for ever to reach the saddle."""
    given, unit = paper()["escapes"], load_scene(scene).section_interval
    source, target = STATES[given["state"]], target_of(given["state"])
    energy, found = least.energy(source, target), times.escapes(source, target, given["intensity"])
    interval = round(unit / float(np.diff(found["time"])[0]))  # samples in it
    outside = structure.basins.at(found.values[:, ::-interval]) != energy.target
    ends = found.shape[1] - interval * np.argmax(outside, axis=1)
    kept = [one[max(end - _LAST * interval, 0) : end] for one, end in zip(found.values, ends, strict=True)]
    shortest = min(map(len, kept))
    path, drawn = energy.path, None
    if path is not None:
        end = path.section[path.action[path.section] >= _SPENT * path.action[-1]][0]
        drawn = path.q[:end][path.t[:end] >= path.t[end] - _LAST * unit]
    return escapes(
        np.array([one[-shortest:] for one in kept]), path=drawn, points=times.section.points,
        saddles=times.section.saddles,
    )  # fmt: skip

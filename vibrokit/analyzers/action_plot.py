"""ActionPlot: the cheapest of many extremal paths that start on a small ring round an attractor."""

from __future__ import annotations

import dataclasses
import math
import time

import numpy as np
import xarray
from numpy.typing import NDArray

from vibrokit.analyzers.analyzer import Analyzer, plain_settings
from vibrokit.analyzers.exits import Exit, LeaveBasin
from vibrokit.analyzers.quasi_potential import local_potential
from vibrokit.analyzers.ring import Exits, confirmed_exits, default_budget, ring_starts
from vibrokit.errors import SceneError, StructureError
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.action_plot import ActionPlotResult
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy, ExitPath
from vibrokit.results.structure import Structure
from vibrokit.results.versions import versions
from vibrokit.scene_file import scene_data
from vibrokit.structure.orbits import refine_orbit
from vibrokit.structure.request import check_belongs, whole
from vibrokit.symbolic.flow_kind import Flow

_SAMPLES = 128
_NEIGHBOURS = 64
_SHARES = 4
_MOST_POINTS = 10**8

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class ActionPlot(Analyzer):
    """The ring of Beri, Mannella, Luchinsky, Silchenko and McClintock (Phys. Rev. E 72, 036131, 2005).

    Points on a small circle round the attractor, with the momentum p = Σ⁻¹ δq of the linearised quasi-potential,
    are carried by Hamilton's equations until they first leave the basin. The one of least action is taken for the
    most probable exit path. It is an upper bound of the activation energy, for one circle at one phase meets the
    attractor's unstable manifold in a curve only.

    Parameters
    ----------
    radius : float
        Of the circle (in m and m s⁻¹ alike).
    points : int
        On the circle.
    source : int, optional
        Label of the attractor to leave; by default each in turn.
    exit : Exit
        What counts as leaving.
    stepper : Stepper, optional
    budget : int, optional
        Most periods to wait for an exit; by default by the growth of deviations from the attractor.
    """

    radius: float = 1e-6
    points: int = 20_000
    source: int | None = None
    exit: Exit = dataclasses.field(default_factory=LeaveBasin)
    stepper: Stepper | None = None
    budget: int | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius) and self.radius > 0):
            raise StructureError(f"ActionPlot: radius is {self.radius!r}; give a positive, finite one.")
        whole("ActionPlot: points", self.points, 4, _MOST_POINTS)

    def run(self, osc: Oscillator, structure: Structure, *, progress: Progress | None = None) -> ActionPlotResult:
        """Run the ring for each attractor.

        Returns
        -------
        ActionPlotResult

        Raises
        ------
        SceneError
            The scene has no noise.
        StructureError
            There is one attractor only, so that nothing can be left for another; or the source is unknown.
        """
        check_belongs(osc, structure)
        if osc.noise is None:
            raise SceneError("the scene has no noise, and nothing leaves an attractor without; give it a noise model.")
        if len(structure.attractors) < 2:
            raise StructureError(
                "the structure has one attractor only, so there is no other basin to leave for; widen the region, or "
                "change the scene."
            )
        began = time.perf_counter()
        stepper = self.stepper or ensemble_stepper(osc, Flow.HAMILTONIAN)
        sources = structure.attractors if self.source is None else (structure.attractor(self.source),)
        data = _section_data(structure)
        energies, words = [], []
        for number, attractor in enumerate(sources):
            angles = 2 * np.pi * np.arange(self.points) / self.points
            share = _share(progress, number, len(sources))
            try:
                ring = self._ring(osc, structure, attractor, angles, stepper, share)
                best = ring.exits.best
                found = None if best is None else self._energy(osc, structure, attractor, ring, best, stepper)
            except StructureError as error:
                words.append(f"Attractor {attractor.label} was left out: {error}")
                continue
            start = f"start_{attractor.label}"
            data[f"angle_{attractor.label}"] = (start, ring.angles)
            data[f"action_{attractor.label}"] = (start, ring.exits.actions)
            data[f"status_{attractor.label}"] = (start, ring.exits.status.astype(np.int32))
            words.append(f"Attractor {attractor.label}: {ring.exits.summary()}")
            energies += [] if found is None else [found]
        return ActionPlotResult(
            energies=tuple(energies),
            data=xarray.Dataset(data, attrs={"region": structure.basins.region.bounds.ravel()}),
            scene=scene_data(osc),
            settings=plain_settings(self) | {"stepper": repr(stepper)},
            status=" ".join(words),
            seconds=time.perf_counter() - began,
            versions=versions(),
        )

    def _ring(
        self,
        osc: Oscillator,
        structure: Structure,
        attractor: Attractor,
        angles: Array,
        stepper: Stepper,
        progress: Progress | None = None,
    ) -> _Ring:
        if attractor.kind not in ("periodic", "equilibrium"):
            raise StructureError(f"it is {attractor.kind}; a ring goes round a point of an orbit or an equilibrium.")
        orbit = refine_orbit(osc, attractor.points[0], attractor.period, stepper)
        starts = ring_starts(orbit.point, local_potential(osc, orbit, stepper), self.radius, angles)
        budget = self.budget or default_budget(attractor.multipliers, attractor.period, self.radius)
        stop = self.exit.stop(structure, attractor.label)
        exits = confirmed_exits(osc, structure, attractor.label, starts, stop, stepper, budget, progress)
        return _Ring(angles, starts, exits)

    def _energy(
        self, osc: Oscillator, structure: Structure, attractor: Attractor, ring: _Ring, best: int, stepper: Stepper
    ) -> ActivationEnergy:
        """Energy of the cheapest exit, its error from a quarter of the points, finer steps, and one section less."""
        exits = ring.exits
        value = float(exits.actions[best])
        path = _path(osc, ring.starts[best], int(exits.intervals[best]), exits.interval, stepper)
        before = float(path.action[path.section[-2]])
        quarters = [exits.actions[k::_SHARES] for k in range(_SHARES)]
        by_points = max(float(np.nanmin(some)) - value if np.isfinite(some).any() else value for some in quarters)
        window = ring.angles[best] + (np.arange(2 * _NEIGHBOURS + 1) - _NEIGHBOURS) * (ring.angles[1] - ring.angles[0])
        finer = self._ring(osc, structure, attractor, window, stepper.refined()).exits
        by_steps = abs(value - float(finer.actions[finer.best])) if finer.best is not None else value
        error = by_points + by_steps
        return ActivationEnergy(
            source=attractor.label,
            target=int(exits.targets[best]),
            value=value,
            lower=max(0.0, min(before, value) - error),
            upper=value + error,
            method="action plot (ring)",
            residual=float(np.linalg.norm(path.p[-1])),
            path=path,
        )


@dataclasses.dataclass(frozen=True, eq=False)
class _Ring:
    angles: Array
    starts: Array
    exits: Exits


def _path(osc: Oscillator, start: Array, intervals: int, interval: float, stepper: Stepper) -> ExitPath:
    samples = max(1, round(_SAMPLES * interval / osc.section_interval))
    z = record(osc, Flow.HAMILTONIAN, stepper, start, 0.0, interval / samples, samples * intervals)
    size = (len(start) - 1) // 2
    times: Array = interval / samples * np.arange(len(z), dtype=float)
    return ExitPath(times, z[:, :size], z[:, size : 2 * size], z[:, -1], np.arange(0, len(z), samples))


def _section_data(structure: Structure) -> dict[str, tuple[object, ...]]:
    data: dict[str, tuple[object, ...]] = {"basin": (("cell_x", "cell_v"), structure.basins.labels)}
    for attractor in structure.attractors:
        data[f"points_{attractor.label}"] = ((f"visit_{attractor.label}", "state"), attractor.points)
    return data


def _share(progress: Progress | None, number: int, count: int) -> Progress | None:
    """Progress of one of several equal pieces of work."""
    return None if progress is None else lambda done, total: progress(number * total + done, count * total)

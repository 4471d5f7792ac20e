"""Walk: the motion with noise around one attractor, and the tests that end it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.metastability import core_of, nearest, noise_strength, relaxation_of, targets_at
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Ensemble, Stop, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED, DIVERGED, LEFT_REGION
from vibrokit.kernels.streams import streams_of
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import ESCAPED
from vibrokit.symbolic.flow_kind import Flow

# √(D h) that a Brownian motion seen at steps of h has passed a bound by on average, −ζ(½)/√(2π) (Broadie, Glasserman &
# Kou, Math. Finance 7, 325, 1997).
_LATE = 0.5826

Array = NDArray[np.float64]
Words = NDArray[np.uint64]
Whole = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class Walkers:
    """States on the section (count, n), and the random streams (count, 4) that go on from there."""

    states: Array
    streams: Words

    def __len__(self) -> int:
        return len(self.states)


@dataclasses.dataclass(frozen=True, eq=False)
class Walk:
    """The motion with noise around one attractor, at one intensity D (m² s⁻³)."""

    problem: ExitProblem
    intensity: float
    seed: int
    stepper: Stepper

    @cached_property
    def scene(self) -> Oscillator:
        """The oscillator with this intensity; where position decides, without what is felt only after the exit."""
        osc = self.problem.scene
        assert osc.noise is not None  # every analyzer checks that
        return dataclasses.replace(osc, noise=osc.noise.replace(intensity=self.intensity))

    @property
    def checks(self) -> int:
        """Exit tests in a section interval."""
        return self.problem.checks if self.problem.exit.by_position else 1

    @property
    def interval(self) -> float:
        """Time between two exit tests (s)."""
        return self.scene.section_interval / self.checks

    @cached_property
    def relaxation(self) -> float:
        """Section intervals in which deviations from the attractor fall by a factor e."""
        return relaxation_of(self.problem.attractor, self.scene.section_interval)

    @property
    def memory(self) -> int:
        """Section intervals after which a start is forgotten to e⁻⁵ of the deviations."""
        return math.ceil(5.0 * self.relaxation)

    @cached_property
    def stop(self) -> Stop:
        """The test for the exit."""
        problem = self.problem
        stop = problem.stop if problem.exit.by_position or problem.exit.at_boundary else self.arrival
        if problem.outlet is not None:
            bounds = problem.faces + self._seen_late
            stop = dataclasses.replace(stop, region=bounds, between=True, every=self.checks)
        if problem.exit.at_boundary:  # escape has a label of its own, since the test passes over negative ones
            labels = np.where(stop.labels == ESCAPED, self._escape_label, stop.labels)
            stop = dataclasses.replace(stop, labels=labels, region=problem.faces, turn=problem.turn)
        return stop

    @property
    def _escape_label(self) -> int:
        return len(self.problem.structure.attractors)

    @property
    def _seen_late(self) -> Array:
        """How much nearer the bounds of x and v have to be for what fixed steps do not see, shape (2, 2).

        Where white noise drives v, it is a Brownian motion, which may pass a bound within a step and return: the exit
        is that of a bound 0.5826 √(D h) farther away, to the order of h. The displacement has no such error.
        """
        scene, bounds = self.scene, self.problem.faces
        shift, faces = np.zeros((2, 2)), np.flatnonzero(np.isfinite(bounds[1]))
        if not len(faces):
            return shift
        states = np.repeat(self.problem.attractor.points[:1], len(faces), axis=0)
        states[:, 1] = bounds[1, faces]
        strength = self.intensity * noise_strength(scene, states)
        step = self.interval / max(1, self.stepper.steps_in(scene, self.interval))
        shift[1, faces] = _LATE * np.sqrt(strength * step) * np.where(faces == 0, 1.0, -1.0)
        return shift

    @cached_property
    def arrival(self) -> Stop:
        """The test for being in the core of an attractor that may be reached, on the section."""
        return self.around(targets_at(self.problem, self.intensity))

    @cached_property
    def own(self) -> Stop:
        """The test for being in the attractor's own core, on the section."""
        return self.around([self.problem.attractor])

    @cached_property
    def stop_or_return(self) -> Stop:
        """The test for the exit, and for being in the attractor's own core on the section."""
        stop, own = self.stop, self.own
        return dataclasses.replace(
            stop,
            points=np.concatenate([stop.points, own.points]),
            point_labels=np.concatenate([stop.point_labels, own.point_labels]),
            metrics=np.concatenate([stop.metrics, own.metrics]),
        )

    def at_home(self, states: Array) -> NDArray[np.bool_]:
        """Return which states (…, n) on the section are in the attractor's core."""
        own = self.own
        distances = nearest(self.problem.on_turn(states[..., :2]), own.points, own.metrics, own.turn)
        inside: NDArray[np.bool_] = distances <= 1
        return inside

    def from_orbit(self, count: int, *key: int) -> Walkers:
        """Return walkers on the points of the attractor; the key chooses their random streams."""
        points = self.problem.attractor.points
        return Walkers(points[np.arange(count) % len(points)], streams_of(self.key(*key), np.arange(count)))

    def from_core(self, count: int, *key: int) -> Walkers:
        """Return walkers in the core, with the normal density around the orbit there.

        States of the noise are those that go with x and v on average; they are soon forgotten.
        """
        begun = self.from_orbit(count, *key)
        own, rng = self.own, np.random.default_rng(self.key(*key, 1))
        radius = np.sqrt(-2.0 * np.log1p(-rng.random(count) * -math.expm1(-0.5)))  # of a normal law, up to 1
        angle = 2.0 * math.pi * rng.random(count)
        offsets = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        places = np.arange(count) % len(own.points)
        states = begun.states.copy()
        states[:, :2] += np.linalg.solve(own.metrics[places], offsets[:, :, None])[:, :, 0]
        return Walkers(states, begun.streams)

    def key(self, *numbers: int) -> int:
        """Return the seed of the streams of one purpose."""
        entropy = [self.seed, self.problem.source, *np.array([self.intensity]).view(np.uint32).tolist(), *numbers]
        return int(np.random.SeedSequence(entropy).generate_state(1, np.uint64)[0] >> np.uint64(1))

    def settled(self, count: int, *key: int) -> Walkers:
        """Return walkers of the quasi-stationary state: on the section, having forgotten where they began.

        A walker that leaves meanwhile begins again, 20 times at most: 0.95 of the walks succeed at once if the mean
        exit time is a relaxation.

        Raises
        ------
        StructureError
            The attractor is left before its orbit is forgotten.
        """
        begun = self.from_core(count, *key)
        states, streams = begun.states.copy(), begun.streams.copy()
        waiting = np.arange(count)
        for _ in range(20):
            ended = self.advance(Walkers(begun.states[waiting], streams[waiting]), self.memory)
            streams[waiting] = ended.streams
            good = ended.status == COMPLETED
            states[waiting[good]] = ended.states[good]
            waiting = waiting[~good]
            if not len(waiting):
                return Walkers(states, streams)
        raise StructureError(
            f"at D = {self.intensity:g} motion leaves the attractor before it has forgotten its start: there is no "
            "metastable state to leave; lower the noise intensity."
        )

    def advance(self, walkers: Walkers, sections: int | Whole, stop: Stop | None = None, visits: int = 0) -> Ensemble:
        """Advance walkers over some section intervals, or until a test ends them; by default that for the exit."""
        tests, checked = sections * self.checks, self.stop if stop is None else stop
        return self.moved(walkers, tests, checked, self.interval, visits=visits, keep=self.checks)

    def moved(self, walkers: Walkers, count: int | Whole, stop: Stop, interval: float, **kept: Any) -> Ensemble:
        """Advance walkers over some intervals of time, or until a test ends them; `kept` is as in `run_ensemble`.

        Labels are those of targets, also where motion left by position, escaped or diverged.
        """
        ended = run_ensemble(
            self.scene, Flow.NOISY, self.stepper, walkers.states, count, stop=stop, interval=interval,
            streams=walkers.streams, executor=self.problem.executor, **kept,
        )  # fmt: skip
        away = np.isin(ended.status, (LEFT_REGION, DIVERGED)) | (ended.label == self._escape_label)
        outlet = ESCAPED if self.problem.outlet is None else self.problem.outlet
        return dataclasses.replace(ended, label=np.where(away, outlet, ended.label))

    def looks(self, depth: float) -> int:
        """Return how often an excursion that climbs so far is looked at in a section interval: a power of two.

        On its way out, ln of the probability to leave grows by less than one between two looks, at twice the depth in a
        relaxation. Exit tests and time steps are multiples of these intervals.
        """
        # On a double well of damping 0.2 and ΔU/D = 25, ln of the estimates of replicas spreads by 1.8 with 0.5 times
        # the depth, 1.0 with 1, 0.8 with 2 and 0.8 with 4; each takes half as long again.
        steps = self.stepper.steps_in(self.scene, self.scene.section_interval)
        wanted = 2.0 * depth / relaxation_of(self.problem.attractor, self.scene.section_interval, 0.05)
        most = self.checks if self.problem.exit.by_position else steps
        allowed = [n for n in (2**k for k in range(9)) if most % n == 0 and steps % n == 0]
        return min((n for n in allowed if n >= wanted), default=max(allowed))

    def sections_at_once(self, count: int) -> int:
        """Return the section intervals that some walkers may be advanced between two reports: a second or two."""
        steps = max(1, self.stepper.steps_in(self.scene, self.scene.section_interval))
        return max(1, int(2e8 / (steps * max(count, 1))))

    def around(self, attractors: Sequence[Attractor]) -> Stop:
        """Return the test for being in the core of one of some attractors, on the section."""
        if not attractors:
            return Stop(turn=self.problem.turn)
        points, metrics = zip(*(core_of(self.problem, one, self.intensity) for one in attractors), strict=True)
        labels = np.repeat([one.label for one in attractors], [len(some) for some in points])
        return Stop(
            points=np.concatenate(points), point_labels=labels, metrics=np.concatenate(metrics), turn=self.problem.turn
        )

"""Exits under noise with extra states, seen by white noise: what they cost at least, and guesses of their paths.

White noise u of intensity D passes a linear filter, and the force z on the mass is what leaves it. Let g be the peak
gain of the filter. By Parseval's theorem ∫ z² dt ≤ g² ∫ u² dt over all times, where u = 0 after the exit. The mass
moves as under white noise z of its own, which costs ½ ∫ z² dt. So the action of an exit, ½ ∫ u² dt, is at least the
least action under white noise, divided by g².
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths import detailed_balance
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.reversed_relaxation import reversed_relaxations
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.parts.noise import WhiteNoise
from vibrokit.results.attractor import Attractor
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.saddle import Saddle
from vibrokit.symbolic.flow_kind import Flow

if TYPE_CHECKING:
    from vibrokit.symbolic.noise_filter import NoiseFilter

FINDER = "relaxation without memory"


@dataclasses.dataclass(frozen=True, eq=False)
class WithoutMemory:
    """The problem of an attractor with white noise of the same intensity in place of the filtered one."""

    problem: ExitProblem

    @cached_property
    def filter(self) -> NoiseFilter | None:
        """What white noise passes before it acts on the mass; None if nothing, or no linear filter."""
        noise = self.problem.scene.noise
        return self.problem.scene.model.noise_filter if noise is not None and noise.extra_states else None

    @cached_property
    def white(self) -> ExitProblem:
        """The problem without the states of the noise."""
        problem = self.problem
        assert problem.osc.noise is not None
        structure = dataclasses.replace(
            problem.structure,
            attractors=tuple(_in_plane(one) for one in problem.structure.attractors),
            saddles=tuple(_saddle_in_plane(one) for one in problem.structure.saddles),
        )
        osc = dataclasses.replace(problem.osc, noise=WhiteNoise(problem.osc.noise.intensity))
        return dataclasses.replace(problem, osc=osc, structure=structure, attractor=_in_plane(problem.attractor))

    def least_actions(self) -> tuple[ActivationEnergy, ...]:
        """Return for each target what no exit can cost less than; none where that is not known."""
        if self.filter is None:
            return ()
        factor = 1.0 / self.filter.peak_gain**2
        return tuple(
            dataclasses.replace(
                each,
                value=factor * each.value,
                lower=factor * each.lower,
                upper=math.inf,
                bound=Bound.ESTIMATE,
                numerical_error=factor * each.numerical_error,
            )
            for each in detailed_balance.least_actions(self.white)
        )

    def candidates(self, pieces: int) -> Iterator[Candidate]:
        """Yield the reversed relaxations, with the extra states that give the force that white noise has on them."""
        if self.filter is None:
            return
        stepper = self.white.single_stepper(Flow.STATE)
        force = np.array(self.filter.force, dtype=np.float64)[0]
        for one in reversed_relaxations(self.white, SegmentPropagator(self.white.scene, stepper, pieces)):
            assert one.momenta is not None
            extra = one.momenta[:, 1:] * force / (force @ force)
            yield dataclasses.replace(one, states=np.hstack([one.states, extra]), momenta=None, finder=FINDER)


def least_actions(problem: ExitProblem) -> tuple[ActivationEnergy, ...]:
    """Return for each target what no exit can cost less than, under white or filtered noise."""
    if problem.scene.noise is not None and problem.scene.noise.extra_states:
        return WithoutMemory(problem).least_actions()
    return detailed_balance.least_actions(problem)


def _in_plane(attractor: Attractor) -> Attractor:
    return dataclasses.replace(attractor, points=_plane(attractor.points))


def _saddle_in_plane(saddle: Saddle) -> Saddle:
    return dataclasses.replace(saddle, points=_plane(saddle.points), nodes=_plane(saddle.nodes))


def _plane(states: NDArray[np.float64]) -> NDArray[np.float64]:
    return states[..., :2]

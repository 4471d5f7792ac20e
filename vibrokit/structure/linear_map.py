"""The flow linearised along trajectories: images, derivatives and covariances of many states at once.

Only this module depends on the layout of the states of the variational flows.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.flow_kind import Flow

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class LinearMap:
    """The flow over some time from each of some states; NaN where the motion diverged."""

    images: Array  # (count, n)
    derivatives: Array  # (count, n, n): M, derivative of the image in the state


@dataclasses.dataclass(frozen=True, eq=False)
class GaussianMap(LinearMap):
    """The same under weak noise, which spreads the image of a state to a normal distribution about it."""

    covariances: Array  # (count, n, n): C, covariance about the image per unit D

    def composed(self) -> tuple[Array, Array]:
        """Return M and C over all rows, each of which begins where the one before ends."""
        derivative = np.eye(self.images.shape[1])
        covariance = np.zeros_like(derivative)
        for step, added in zip(self.derivatives, self.covariances, strict=True):
            derivative, covariance = step @ derivative, step @ covariance @ step.T + added
        return derivative, covariance


@dataclasses.dataclass(frozen=True, eq=False)
class HamiltonianMap:
    """The flow of Hamilton's equations over some time from each of some (q, p); NaN where the motion diverged."""

    images: Array  # (count, 2n)
    derivatives: Array  # (count, 2n, 2n)
    actions: Array  # (count,), of the trajectories


Map = TypeVar("Map", GaussianMap, HamiltonianMap)


def linear_map(osc: Oscillator, states: Array, stepper: Stepper, intervals: int = 1, **over: Any) -> LinearMap:
    """Linearize the flow from states (count, n) over some intervals, each from section to section by default.

    `over` are `start_time`, `interval`, `phases` and `executor` of `run_ensemble`. A StepperError is raised if the
    stepper cannot integrate the variational equations of this scene.
    """
    count, n = states.shape
    found = _ends(osc, Flow.STATE_VARIATIONAL, stepper, [states, _identities(count, n)], intervals, over)
    return LinearMap(found[:, :n], found[:, n:].reshape(count, n, n))


def gaussian_map(osc: Oscillator, states: Array, stepper: Stepper, intervals: int = 1, **over: Any) -> GaussianMap:
    """Linearize the flow with the covariance that noise adds; as `linear_map`, with a SceneError if there is no noise.

    C is integrated as C′ = A C + C Aᵀ + a, with A = ∂b/∂q. Hamilton's equations at p = 0 also give C, as a block C M⁻ᵀ
    of their derivative, but M⁻ᵀ grows as fast as M decays, so that C is lost in rounding errors. Over one period of
    ``hertz-0.570`` at damping ratio 1, from x = 0.53 and v = −0.04, C from them has a relative error of 6e-9, and
    3e-16 here; the time is the same within a tenth. Here C is also symmetric and positive, over any time.
    """
    count, n = states.shape
    rows, columns = np.triu_indices(n)
    start = [states, _identities(count, n), np.zeros((count, len(rows)))]
    found = _ends(osc, Flow.LINEARISED, stepper, start, intervals, over)
    covariances = np.empty((count, n, n))
    covariances[:, rows, columns] = covariances[:, columns, rows] = found[:, n + n * n :]
    return GaussianMap(found[:, :n], found[:, n : n + n * n].reshape(count, n, n), covariances)


def gaussian_pieces(
    osc: Oscillator, point: Array, stepper: Stepper, pieces: int, count: int, turn: float | None = None
) -> tuple[Array, GaussianMap]:
    """Linearize along the trajectory from a point of the section, in `count` pieces, `pieces` to a turn.

    A turn (s) is a section interval, and may be another time without forcing. Returns the nodes (count + 1, n), where
    the pieces begin and the last one ends, and the map of each piece.
    """
    interval = (turn or osc.section_interval) / pieces
    nodes, parts = [point], list[GaussianMap]()
    for number in range(count):
        begin = number % pieces * interval
        parts.append(gaussian_map(osc, nodes[-1][None], stepper, start_time=begin, interval=interval))
        nodes.append(parts[-1].images[0])
    return np.array(nodes), joined(parts)


def hamiltonian_map(osc: Oscillator, points: Array, stepper: Stepper, **over: Any) -> HamiltonianMap:
    """Linearize Hamilton's equations over one interval from points (q, p), shape (count, 2n).

    `over` and the errors are those of `gaussian_map`.
    """
    count, size = points.shape
    start = [points, np.zeros((count, 1)), _identities(count, size)]
    found = _ends(osc, Flow.HAMILTONIAN_VARIATIONAL, stepper, start, 1, over)
    return HamiltonianMap(found[:, :size], found[:, size + 1 :].reshape(count, size, size), found[:, size])


def joined(parts: Sequence[Map]) -> Map:
    """Return the rows of several maps as one."""
    fields = dataclasses.fields(parts[0])
    return type(parts[0])(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields))


def _ends(
    osc: Oscillator, flow: Flow, stepper: Stepper, start: list[Array], intervals: int, over: dict[str, Any]
) -> Array:
    ended = run_ensemble(osc, flow, stepper, np.hstack(start), intervals, **over)
    return np.where((ended.status == COMPLETED)[:, None], ended.states, np.nan)


def _identities(count: int, size: int) -> Array:
    return np.tile(np.eye(size).ravel(), (count, 1))

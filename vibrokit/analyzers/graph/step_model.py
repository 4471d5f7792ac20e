"""StepModel: what one step of time does to states, and what it costs to reach a state by such a step."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.graph.grids import Grids
from vibrokit.kernels.ensemble import Ensemble, run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import COMPLETED
from vibrokit.oscillator import Oscillator
from vibrokit.structure.linear_map import GaussianMap, gaussian_map
from vibrokit.symbolic.flow_kind import Flow

_ROUNDING = 1e-14  # relative: a variance below this is rounding error
_SINGULAR = 1e-12  # |det M| below which a step cannot be inverted
_MIRROR = np.array([1.0, -1.0])  # turns the velocity round

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class StepCosts:
    """Costs ½ |R (x − b)|² of steps from a state x to each of some states, all in units of a grid's nodes."""

    centres: Array  # (count, 2): b, where the noise-free step starts, or would if the motion were linear; NaN for none
    # R as (00, 01, 11), upper triangular. RᵀR itself would lose its small eigenvalue to rounding where the form is long
    # and thin, as in a stiff stop.
    roots: Array  # (count, 3)
    uphill: Array  # (count, 2): where a path that climbs against the damping would start

    def cost(self, starts: Array) -> Array:
        """Return the costs of steps from some states, one for all or one for each."""
        ds, dt = np.moveaxis(starts - self.centres, -1, 0)
        first = self.roots[:, 0] * ds + self.roots[:, 1] * dt
        cost: Array = 0.5 * (first**2 + (self.roots[:, 2] * dt) ** 2)
        return cost


@dataclasses.dataclass(frozen=True, eq=False)
class StepModel:
    """The motion over short times."""

    scene: Oscillator
    stepper: Stepper

    def images(self, states: Array, start: float, duration: float) -> Array:
        """Return the images of states (count, 2) after some time without noise; NaN where the motion diverged."""
        ended = self._run(Flow.STATE, states, start, duration)
        return np.where((ended.status == COMPLETED)[:, None], ended.states, np.nan)

    def linear(self, states: Array, start: float, duration: float) -> GaussianMap:
        """Return images, derivatives M and covariances C of the motion from states (count, 2) over some time."""
        return gaussian_map(self.scene, states, self.stepper, start_time=start, interval=duration)

    def into(self, states: Array, grids: Grids, phase: int, duration: float | None = None) -> StepCosts:
        """Return the costs of steps that start at a phase and end at some states.

        A step from x to y costs ½ eᵀ C⁻¹ e, where e is the distance from y to the image of x and C is the covariance
        that noise adds along the step. The motion is linearized along the step that ends at y and starts at b without
        noise: e = M (b − x), and RᵀR = Mᵀ C⁻¹ M is the inverse of that covariance of the motion backwards in time.
        Where b lies outside the grid, as it does when damping is strong, the motion is linearized along the step that
        starts uphill. By default a step takes the time between two grids.
        """
        step = grids.step if duration is None else duration
        start, box = grids.time(phase), grids.boxes[phase]
        mirrored = np.hstack([states * _MIRROR, np.zeros((len(states), 3))])
        ended = self._run(Flow.COVARIANCE_REVERSED, mirrored, -(start + step), step)
        centres = ended.states[:, :2] * _MIRROR
        roots = _root_of_inverse(ended.states[:, 2:] * np.array([1.0, -1.0, 1.0]))
        uphill = self._uphill(states, start, step, box)
        good = (ended.status == COMPLETED) & np.isfinite(centres).all(axis=1) & np.isfinite(roots).all(axis=1)
        out = ~good | np.any((centres < box[:, 0]) | (centres > box[:, 1]), axis=1)
        if out.any():
            centres[out], roots[out] = self._linearized_from(uphill[out], states[out], start, step)
        wide, high = grids.spacing(phase)
        return StepCosts(grids.index(phase, centres), roots * [wide, high, high], grids.index(phase, uphill))

    def _uphill(self, states: Array, start: float, step: float, box: Array) -> Array:
        """Where paths against the damping come from, clipped to a box.

        It is the image of a state with its velocity turned round, turned round again. Without forcing, the path of
        least action out of a well goes this way.
        """
        found = self.images(states * _MIRROR, start, step) * _MIRROR
        return np.clip(np.where(np.isfinite(found), found, states), box[:, 0], box[:, 1])

    def _linearized_from(self, starts: Array, ends: Array, start: float, step: float) -> tuple[Array, Array]:
        """Centres and roots of steps to `ends`, linearized along the motion from `starts`."""
        found = self.linear(starts, start, step)
        images, slopes = found.images, found.derivatives
        root = _root_of_inverse(found.covariances.reshape(-1, 4)[:, [0, 1, 3]])
        centres, roots = np.full_like(starts, np.nan), np.full((len(starts), 3), np.nan)
        with np.errstate(all="ignore"):
            sound = np.isfinite(images).all(axis=1) & np.isfinite(root).all(axis=1)
            sound &= np.abs(np.linalg.det(slopes)) > _SINGULAR
        upper = np.zeros((int(sound.sum()), 2, 2))
        upper[:, 0, 0], upper[:, 0, 1], upper[:, 1, 1] = root[sound].T
        triangular = np.asarray(np.linalg.qr(upper @ slopes[sound], mode="r"), dtype=np.float64)
        pulled = triangular.reshape(-1, 4)[:, [0, 1, 3]]
        pulled *= np.sign(pulled)[:, [0, 0, 2]]
        pulled[np.any(pulled[:, [0, 2]] <= 0, axis=1)] = np.nan  # degenerate
        roots[sound] = pulled
        centres[sound] = starts[sound] + np.linalg.solve(slopes[sound], (ends - images)[sound][..., None])[..., 0]
        centres[np.isnan(roots).any(axis=1)] = np.nan
        return centres, roots

    def _run(self, flow: Flow, states: Array, start: float, duration: float) -> Ensemble:
        return run_ensemble(self.scene, flow, self.stepper, states, 1, start_time=start, interval=duration)


def _root_of_inverse(triangles: Array) -> Array:
    """R with RᵀR = C⁻¹ for symmetric C given as (00, 01, 11), as (00, 01, 11); NaN where C is not positive definite."""
    a, b, c = triangles.T
    with np.errstate(all="ignore"):
        left = a - b * (b / c)
        left = np.sqrt(np.where((a > 0) & (c > 0) & (left > _ROUNDING * a), left, np.nan))
        return np.stack([1 / left, -b / c / left, 1 / np.sqrt(c)], axis=1)

"""Tables: what each step of time costs, as a quadratic form of where it comes from."""

from __future__ import annotations

import concurrent.futures
import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.screening.grids import Grids
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.kernels.stopping import RAN_OUT
from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.flow_kind import Flow

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_ROUNDING = 1e-14  # of a variance: what of it is known
Executor = concurrent.futures.Executor | None


@dataclasses.dataclass(frozen=True, eq=False)
class Steps:
    """Costs ½ |R (x − b)|² of coming from x, one time step before.

    Attributes
    ----------
    centres : array (count, 2)
        b: from where the motion leads here by itself, or would if it were linear; NaN where there is none.
    roots : array (count, 3)
        R as (00, 01, 11), upper triangular. It is kept, not RᵀR, of which rounding leaves nothing where it is long and
        thin, as in a stiff stop.
    """

    centres: Array
    roots: Array


def steps_into(
    osc: Oscillator, stepper: Stepper, states: Array, time: float, step: float, box: Array, executor: Executor = None
) -> Steps:
    """Return the costs of steps that end at some states.

    To come to y by way of x costs ½ eᵀ C⁻¹ e, where e is the miss of y by the motion from x and C is the Gramian of
    the noise along it. It is linearised along the motion that ends at y, which came from b: e = M (b − x), so that
    RᵀR = Mᵀ C⁻¹ M is the inverse of the Gramian of the motion backwards in time. Where b is out of the grid, as behind
    strong damping, it is linearised along the motion that starts where a path against the damping would come from.

    Parameters
    ----------
    osc : Oscillator
    stepper : Stepper
    states : array (count, 2)
    time : float
        At the end of the step (s).
    step : float
    box : array (2, 2)
        Bounds of the grid at the start of the step.
    executor : concurrent.futures.Executor, optional
    """
    mirror = np.array([1.0, -1.0])
    starts = np.hstack([states * mirror, np.zeros((len(states), 3))])
    ended = run_ensemble(
        osc, Flow.GRAMIAN_REVERSED, stepper, starts, 1, start_time=-time, interval=step, executor=executor
    )
    centres = ended.states[:, :2] * mirror
    roots = _root_of_inverse(ended.states[:, 2:] * np.array([1.0, -1.0, 1.0]))
    good = (ended.status == RAN_OUT) & np.isfinite(centres).all(axis=1) & np.isfinite(roots).all(axis=1)
    out = ~good | np.any((centres < box[:, 0]) | (centres > box[:, 1]), axis=1)
    if out.any():
        starts = uphill(osc, stepper, states[out], time, step, box)
        centres[out], roots[out] = _linearised(osc, stepper, starts, states[out], time - step, step, executor)
    return Steps(centres, roots)


def uphill(osc: Oscillator, stepper: Stepper, states: Array, time: float, step: float, box: Array) -> Array:
    """Return where paths against the damping come from, one step before, kept in a box.

    It is the image of a state with its velocity turned round, turned round again. Without forcing that is the way of
    least action up a well.
    """
    mirror = np.array([1.0, -1.0])
    found = carried(osc, stepper, states * mirror, time - step, step) * mirror
    return np.clip(np.where(np.isfinite(found), found, states), box[:, 0], box[:, 1])


def _linearised(
    osc: Oscillator, stepper: Stepper, starts: Array, ends: Array, time: float, step: float, executor: Executor
) -> tuple[Array, Array]:
    """Linearise along the motion from some states."""
    images, slopes, gramians = forward(osc, stepper, starts, time, step, executor)
    root = _root_of_inverse(gramians.reshape(-1, 4)[:, [0, 1, 3]])
    with np.errstate(all="ignore"):
        det = np.linalg.det(slopes)
        sound = np.isfinite(images).all(axis=1) & np.isfinite(root).all(axis=1) & (np.abs(det) > 1e-12)
    centres, roots = np.full_like(starts, np.nan), np.full((len(starts), 3), np.nan)
    back = np.linalg.solve(slopes[sound], (ends - images)[sound][..., None])[..., 0]
    centres[sound] = starts[sound] + back
    upper = np.zeros((int(sound.sum()), 2, 2))
    upper[:, 0, 0], upper[:, 0, 1], upper[:, 1, 1] = root[sound].T
    triangular: Array = np.asarray(np.linalg.qr(upper @ slopes[sound], mode="r"), dtype=np.float64)
    roots[sound] = triangular.reshape(-1, 4)[:, [0, 1, 3]]
    return centres, _positive(roots)


def forward(
    osc: Oscillator, stepper: Stepper, states: Array, time: float, step: float, executor: Executor = None
) -> tuple[Array, Array, Array]:
    """Return the images of states after a step, the slopes M (count, 2, 2) of that map, and the Gramians C."""
    count = len(states)
    slopes = run_ensemble(
        osc, Flow.STATE_VARIATIONAL, stepper, np.hstack([states, np.tile(np.eye(2).ravel(), (count, 1))]), 1,
        start_time=time, interval=step, executor=executor,
    ).states  # fmt: skip
    ended = run_ensemble(
        osc, Flow.GRAMIAN, stepper, np.hstack([states, np.zeros((count, 3))]), 1,
        start_time=time, interval=step, executor=executor,
    ).states  # fmt: skip
    gramians = np.stack([ended[:, 2], ended[:, 3], ended[:, 3], ended[:, 4]], axis=1).reshape(-1, 2, 2)
    return ended[:, :2], slopes[:, 2:].reshape(-1, 2, 2), gramians


def _root_of_inverse(triangles: Array) -> Array:
    """R with RᵀR = C⁻¹ for symmetric C given as (00, 01, 11), as (00, 01, 11); NaN where C is not positive definite."""
    a, b, c = triangles.T
    with np.errstate(all="ignore"):
        left = a - b * (b / c)
        left = np.sqrt(np.where((a > 0) & (c > 0) & (left > _ROUNDING * a), left, np.nan))
        return np.stack([1 / left, -b / c / left, 1 / np.sqrt(c)], axis=1)


def _positive(roots: Array) -> Array:
    """The same forms with a positive diagonal, and none where a form is degenerate."""
    with np.errstate(all="ignore"):
        roots = roots * np.stack([np.sign(roots[:, 0]), np.sign(roots[:, 0]), np.sign(roots[:, 2])], axis=1)
    roots[~((roots[:, 0] > 0) & (roots[:, 2] > 0))] = np.nan
    return roots


def table(
    osc: Oscillator, stepper: Stepper, grids: Grids, phase: int, executor: Executor = None
) -> tuple[Array, Array]:
    """Return b and R of the step from a phase to the next, in cells: shapes (nx, nv, 2) and (nx, nv, 3)."""
    after = (phase + 1) % grids.phases
    steps = steps_into(
        osc, stepper, grids.nodes(after).reshape(-1, 2), grids.time(phase) + grids.step, grids.step,
        grids.boxes[phase], executor,
    )  # fmt: skip
    centres, roots = in_cells(grids, phase, steps)
    return centres.reshape(*grids.cells, 2), roots.reshape(*grids.cells, 3)


def against(osc: Oscillator, stepper: Stepper, grids: Grids, phase: int) -> Array:
    """Return, in cells, where paths against the damping come from in the step from a phase, shape (nx, nv, 2)."""
    ends = grids.nodes((phase + 1) % grids.phases).reshape(-1, 2)
    starts = uphill(osc, stepper, ends, grids.time(phase) + grids.step, grids.step, grids.boxes[phase])
    return grids.places(phase, starts).reshape(*grids.cells, 2)


def in_cells(grids: Grids, phase: int, steps: Steps) -> tuple[Array, Array]:
    """Return b (count, 2) and R (count, 3: ss, st, tt) in cells of the grid at the start of the step."""
    wide, high = grids.spacing(phase)
    centres = grids.places(phase, steps.centres)
    centres[np.isnan(steps.roots).any(axis=1)] = np.nan
    return centres, steps.roots * np.array([wide, high, high])


def step_cost(miss: Array, roots: Array) -> Array:
    """Return ½ |R (x − b)|² for x − b of shape (…, 2) and R as `in_cells` has them, shape (…, 3)."""
    first = roots[..., 0] * miss[..., 0] + roots[..., 1] * miss[..., 1]
    cost: Array = 0.5 * (first**2 + (roots[..., 2] * miss[..., 1]) ** 2)
    return cost


def carried(osc: Oscillator, stepper: Stepper, states: Array, time: float, step: float) -> Array:
    """Return the images of states after a time, however far."""
    return run_ensemble(osc, Flow.STATE, stepper, states, 1, start_time=time, interval=step).states

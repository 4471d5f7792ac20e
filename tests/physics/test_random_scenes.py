"""Scenes drawn from the whole grammar of parts hold what every scene promises.

Steppers of different kinds agree within what halving their steps says of their errors; other units and the mirror image
of a scene change nothing; many trajectories at once end where single ones do; a kernel from the cache gives the bits of
the compiled one; a time limit holds; and nothing but errors and warnings of the toolkit leaves it.
"""

from __future__ import annotations

import contextlib
import math
import time
import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, note, settings
from hypothesis import strategies as st

import vibrokit as vk
from tests.random_scenes import draw_scene
from vibrokit.errors import IntegrationError, NoSectionError, StepperError, VibrokitError
from vibrokit.kernels import kernel, store
from vibrokit.kernels.kernel import kernel_for
from vibrokit.symbolic.flow_kind import Flow

_STEP = 0.02  # of RK4, in the scene's unit of time
_STARTS = 6
_DURATION = 6.0  # in which one oscillation or so is done, and errors grow little
_REACH = 1e6  # in units of length; motion that goes farther is on its way to infinity
_ROUNDING = 1e-9  # of some thousand steps
_SAME, _SAME_LOCATED = 1e-8, 1e-6  # rounding, after what divides motions; other steps at the tolerance of a step

_FEW = 6  # structures of the quick test: each is compiled
_LIMIT, _SLACK = 1.0, 3.0  # s; kernels return to Python each tenth of a second, and what was found is put together

common = settings(
    deadline=None,
    derandomize=True,
    database=None,
    phases=(Phase.explicit, Phase.generate),  # each step of shrinking would compile other code
    suppress_health_check=list(HealthCheck),
)


class Numbers:
    """Draws numbers, and remembers them, so that the same scene can be made in other units."""

    def __init__(self, data):
        self.data, self.drawn = data, []

    def __call__(self, low, high):
        number = round(self.data.draw(st.floats(low, high)), 9)  # not so small that products underflow
        self.drawn.append(number)
        return number

    def again(self):
        """The same numbers, one by one."""
        known = iter(self.drawn)
        return lambda _low, _high: next(known)


def ends(drawn, stepper, starts):
    """Where motion from each start is after a while, in units; infinity for motion that diverges."""
    samples = math.ceil(drawn.scene.time_unit / drawn.time)
    units, found = np.array(drawn.units), []
    for start in starts:
        try:
            path = drawn.scene.trajectory(
                start * units, duration=_DURATION * drawn.time, samples=samples, stepper=stepper
            )
            end = np.array([path.x[-1], path.v[-1]]) / units[:2]
        except IntegrationError:
            end = np.full(2, np.inf)
        found.append(end if np.abs(end).max() < _REACH else np.full(2, np.inf))
    return np.array(found)


def check_agreement(drawn, starts, *, more):
    """The finest results of all steppers differ by no more than their last refinements say.

    A start from which only some of the results diverge is left out. Return what is allowed for RK4.
    """
    loose, tight = (ends(drawn, vk.Order8(tolerance), starts) for tolerance in (1e-7, 1e-9))
    settled = np.isfinite(fixed(drawn, starts, vk.RK4, 2)).all(axis=(0, 2))  # at all steps
    assert np.isfinite(tight[settled]).all(), (settled, tight)
    finite = settled & np.isfinite(loose).all(axis=1)
    if not finite.any():
        return _ROUNDING
    starts, true = starts[finite], tight[finite]
    left = np.abs((true - loose[finite]) / (1 + np.abs(true))).max()
    allowed = check_refinement(drawn, starts, vk.RK4, true, left)
    with contextlib.suppress(StepperError):  # not for this scene
        if more:
            check_refinement(drawn, starts, vk.RK8, true, left)
    with contextlib.suppress(StepperError):
        flown = ends(drawn, vk.FreeFlight(1e-9), starts) if more else true
        assert np.abs((flown - true) / (1 + np.abs(true))).max() <= allowed, (flown, true, allowed)
    return allowed


def check_refinement(drawn, starts, kind, true, left):
    """Results by fixed steps come as near to the true ones as their last doublings say, which have an error `left`.

    Steps across contacts have an order of 1 or more: a doubling changes a result by at least the error that is left,
    and the doubling before by at least twice that. The error depends on where a step meets a contact, so that the
    larger of both counts, from any start. Where it does not by chance, shorter steps must bear it out. Return what is
    allowed.
    """
    for times in (2, 8, 32):
        coarse, fine, finest = fixed(drawn, starts, kind, times) / (1 + np.abs(true))
        with np.errstate(invalid="ignore"):  # too few steps may diverge; more of them must not
            changed = max(np.abs(finest - fine).max(), np.abs(fine - coarse).max() / 2)
        allowed = 2 * (changed + left) + _ROUNDING
        far = np.abs(finest - true / (1 + np.abs(true))).max()
        if far <= allowed:
            return allowed
    raise AssertionError((kind, finest, true, far, allowed))


def fixed(drawn, starts, kind, times):
    """Results by so many times the steps of a scene, doubled twice."""
    return np.array([ends(drawn, kind(steps_of(drawn) * times * 2**level), starts) for level in range(3)])


def steps_of(drawn):
    """Steps of RK4 from section to section."""
    return math.ceil(drawn.scene.time_unit / (_STEP * drawn.time))


def check_same(one, other, starts, error):
    """The same scene in other units, or its mirror image, moves in the same way.

    Where rounding decides whether a step is taken, results differ by the error of the located steps, or of both kinds.
    """
    for stepper, allowed in ((vk.RK4(4 * steps_of(one)), _SAME), (vk.Order8(1e-9), max(_SAME_LOCATED, error))):
        first, second = (ends(drawn, stepper, starts) for drawn in (one, other))
        both = np.isfinite(first).all(axis=1)
        assert (both == np.isfinite(second).all(axis=1)).all(), (stepper, first, second)
        far = np.abs(first[both] - second[both]) / (1 + np.abs(first[both]))
        assert far.max(initial=0.0) <= allowed, (stepper, first, second)


def check_lanes(drawn, starts, error):
    """Trajectories that are integrated side by side end where single ones do, after one period."""
    units, stepper = np.array(drawn.units), vk.Order8(1e-9)
    single, kept = [], []
    for start in starts * units:
        try:
            path = drawn.scene.trajectory(start, periods=1, stepper=stepper)
            single.append([path.x[-1], path.v[-1]] / units[:2])
            kept.append(start)
        except NoSectionError:
            return
        except IntegrationError:
            continue
    if kept:
        many = (drawn.scene.section_map(kept, stepper=stepper) / units)[:, :2]
        assert np.abs(many - single).max() <= max(_SAME_LOCATED, error) * (1 + np.abs(single).max()), (many, single)


def check_cache(drawn, starts):
    """Kernels that are loaded again compile nothing, and give the same bits."""
    for stepper in (vk.RK4(32), vk.Order8(1e-6)):
        before = ends(drawn, stepper, starts[:2])
        kernel._KERNELS.clear()
        kernel._callbacks.cache_clear()
        store._LOADED.clear()
        after = ends(drawn, stepper, starts[:2])
        assert kernel_for(drawn.scene, Flow.STATE, stepper).compilations == 0
        assert before.tobytes() == after.tobytes()


def check_limit(drawn):
    """A search that is stopped returns in time, with what it has; compilation cannot be stopped."""
    began = time.perf_counter()
    try:
        found = vk.find_structure(drawn.scene, time_limit=_LIMIT, cells=(20, 20))
        compiled = found.stats.seconds.get("compiling", 0.0)
    except VibrokitError:
        return
    assert time.perf_counter() - began - compiled < _LIMIT + _SLACK


def checked(seed, data, *, limit=False, more=False):
    """Check a scene, and that all warnings on the way are ours."""
    number = Numbers(data)
    length, duration = (10 ** Numbers(data)(*powers) for powers in ((-9, 3), (-7, 3)))
    drawn = draw_scene(seed, number, length, duration)
    in_other_units = draw_scene(seed, number.again(), 1e-6 * length, 1e3 * duration)
    mirrored = draw_scene(seed, number.again(), -length, duration)
    extra = len(drawn.units) - 2
    starts = np.array([[number(-2, 2), number(-2, 2), *(number(-1, 1) for _ in range(extra))] for _ in range(_STARTS)])
    note(f"{drawn}\nstarts {starts.tolist()}")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        error = check_agreement(drawn, starts, more=more)
        check_cache(drawn, starts)
        check_same(drawn, in_other_units, starts, error)
        if more:
            check_same(drawn, mirrored, starts, error)
            check_lanes(drawn, starts, error)
        if limit:
            check_limit(drawn)
    strangers = [each for each in caught if not each.category.__module__.startswith("vibrokit")]
    assert not strangers, [str(each.message) for each in strangers]


@pytest.mark.slow
@settings(common, max_examples=18)
@given(seed=st.integers(0, _FEW - 1), data=st.data())
def test_few_structures_with_many_numbers(seed, data):
    checked(seed, data)


def check_block(seeds, examples, *, limit):
    """Check so many scenes with the structures of some seeds."""

    @settings(common, max_examples=examples)
    @given(seed=st.sampled_from(seeds), data=st.data())
    def test(seed, data):
        checked(seed, data, limit=limit, more=not limit)

    test()


@pytest.mark.long
@pytest.mark.parametrize("block", range(20))
def test_a_thousand_structures(block):
    check_block(range(50 * block, 50 * block + 50), 50, limit=False)


@pytest.mark.long
@pytest.mark.parametrize("block", range(10))
def test_a_time_limit_holds(block):
    check_block(range(100 * block, 100 * block + 100), 5, limit=True)

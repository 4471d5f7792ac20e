"""Scenes drawn from the whole grammar of parts hold what every scene promises.

Two steppers of different kinds agree within what halving their steps says of their errors; a kernel from the cache
gives the bits of the compiled one; and nothing but errors and warnings of the toolkit leaves it.
"""

from __future__ import annotations

import math
import warnings

import numpy as np

import vibrokit as vk
from tests.random_scenes import draw_scene
from vibrokit.errors import IntegrationError
from vibrokit.kernels import kernel, store
from vibrokit.kernels.kernel import kernel_for
from vibrokit.symbolic.flow_kind import Flow

_STEP = 0.02  # of RK4, in the scene's unit of time
_STARTS = 6
_DURATION = 6.0  # one oscillation or so, in which errors grow little
_REACH = 1e6  # in units of length; motion that goes farther is on its way to infinity


def ends(drawn, stepper, starts):
    """Where motion from each start is after a while, in units; infinity for motion that diverges."""
    units, found = np.array(drawn.units), []
    for start in starts:
        try:
            path = drawn.scene.trajectory(
                start * units, duration=_DURATION * drawn.time, samples=max(1, _samples(drawn)), stepper=stepper
            )
            end = np.column_stack([path.x, path.v])[-1] / units[:2]
            found.append(end if np.abs(end).max() < _REACH else np.full(2, np.inf))
        except IntegrationError:
            found.append(np.full(2, np.inf))
    return np.array(found)


def _samples(drawn):
    return math.ceil(drawn.scene.time_unit / drawn.time)


def check_agreement(drawn, starts):
    """The finer of two results differs from the finest of another stepper by no more than steps and tolerances say.

    Steps across contacts have an order of 1 or more, so the last doubling changes a result by at least its error.
    Errors depend on where a step meets a contact, so the doublings before and the other starts count too.
    """
    steps = math.ceil(drawn.scene.time_unit / (_STEP * drawn.time))
    fixed = [ends(drawn, vk.RK4(steps * times), starts) for times in (1, 2, 4, 8)]
    located = [ends(drawn, vk.Order8(tolerance), starts) for tolerance in (1e-7, 1e-9)]
    with np.errstate(invalid="ignore"):
        sizes = 1 + np.abs(located[1])
        changes = [np.abs(finer - coarser) / sizes for coarser, finer in (fixed[:2], fixed[1:3], fixed[2:], located)]
        distance = np.abs(fixed[3] - located[1]) / sizes
    bounded = np.isfinite(located[1]) & np.isfinite(fixed[3])
    unsettled = np.isnan(sum(changes)) | np.isinf(sum(changes))
    diverging = np.isinf(located[1]) == np.isinf(fixed[3])
    assert (bounded | diverging | unsettled).all(), (fixed, located)
    allowed = max(change[np.isfinite(change)].max(initial=0.0) for change in changes)
    assert distance[bounded & ~unsettled].max(initial=0.0) <= 2 * allowed + 1e-9, (distance, changes)


def check_cache(drawn, starts):
    """Kernels that are loaded again compile nothing, and give the same bits."""
    for stepper in (vk.RK4(32), vk.Order8(1e-6)):
        results = []
        for _ in range(2):
            results.append(ends(drawn, stepper, starts[:2]))
            used = kernel_for(drawn.scene, Flow.STATE, stepper)
            kernel._kernel.cache_clear()
            kernel._addresses.cache_clear()
            store._LOADED.clear()
        assert used.compilations == 0
        assert np.array_equal(*results)


def check(seed, number):
    drawn = draw_scene(seed, number)
    extra = len(drawn.units) - 2
    starts = np.array([[number(-2, 2), number(-2, 2), *([number(-1, 1)] * extra)] for _ in range(_STARTS)])
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_agreement(drawn, starts)
        check_cache(drawn, starts)
    strangers = [each for each in caught if not each.category.__module__.startswith("vibrokit")]
    assert not strangers, [str(each.message) for each in strangers]

"""Motion that needs too many steps is neither settled nor gone: searches, basins and the watch count it apart."""

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import scene
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import Stop
from vibrokit.results.basins import ESCAPED, NOT_FOLLOWED, UNSETTLED
from vibrokit.results.codes import Code
from vibrokit.results.region import Region
from vibrokit.structure.attractors.wandering import follow, watch
from vibrokit.structure.basins.classifier import BasinClassifier
from vibrokit.structure.search import Search

TIGHT = vk.Order8(1e-10)
LAW = vk.CustomLaw("k*depth + c*rate", k=1e11, c=6e3)


def table(side):
    """A ball on a table: at rest it makes 5e4 oscillations of the contact in a period, which is 2e6 steps."""
    down = -1.0 if side == "left" else 1.0
    return scene(
        vk.Barrier(LAW, 0.0, side),
        damping_ratio=0.0,
        spring=vk.LinearSpring(0.0),
        excitations=(vk.Constant(down), vk.Harmonic(0.78, 1.0)),
    )


@pytest.mark.parametrize("side", ["left", "right"])
def test_starts_at_rest_on_a_rigid_table_are_not_followed(side):
    up = 1.0 if side == "left" else -1.0
    starts = np.array([[0.3 * up, 0.1], [0.0, 0.0], [-1e-7 * up, 0.0]])
    _, intervals, labels = follow(table(side), starts, Stop(), 2, TIGHT)
    assert labels.tolist() == [UNSETTLED, NOT_FOLLOWED, NOT_FOLLOWED]
    assert intervals.tolist() == [2, 0, 0]
    survival, survivors = watch(table(side), starts, Stop(), TIGHT, longest=2)
    assert (survival.starts, survival.survivors, len(survivors)) == (1, 1, 1)


def test_between_sections_too():
    osc = table("left")
    classifier = BasinClassifier(osc, (), Region((-1.0, 1.0), (-1.0, 1.0)), 0.01, 2, TIGHT)
    assert classifier.labels(np.array([[0.0, 0.0], [-2.0, 0.0]]), start_time=1.0).tolist() == [UNSETTLED, ESCAPED]


def test_a_search_counts_them_apart():
    search = Search(table("left"), Region((-0.5, 3.0), (-3.0, 3.0)), 1e-3, TIGHT, TIGHT, None)
    search.go_on(np.array([[0.3, 0.1], [0.0, 0.0], [-1e-7, 0.0]]), 2)
    assert search.beyond["diverged"] == 0
    assert search.beyond["moving"] >= 2


def test_a_search_in_which_all_stall_says_so():
    at_rest = (-1e-7, 1e-7), (-1e-6, 1e-6)
    with pytest.raises(StructureError, match="too many steps"):
        vk.find_structure(table("left"), region=at_rest, starts=(2, 2), budget=2, cells=(4, 4), stepper=TIGHT)


@pytest.mark.slow
def test_motion_to_infinity_in_a_finite_time_has_diverged():
    """x″ = −0.1 x′ − x + x³ beyond its tops at ±1; the steps of such motion become too many too."""
    osc = scene(damping_ratio=0.05, spring=vk.CubicSpring(1.0, -1.0))
    found = vk.find_structure(osc, region=((-3.0, 3.0), (-3.0, 3.0)), cells=(20, 20), stepper=vk.Order8(1e-8))
    (diverged,) = found.found(Code.STARTS_DIVERGED)
    assert 0 < diverged.values["count"] < diverged.values["starts"]
    assert not found.found(Code.STARTS_STALLED)

"""Arguments that the searches refuse."""

import concurrent.futures
import math

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.errors import SceneError, StepperError, StructureError, VibrokitError

WELL = vk.load_scene("double-well")
QUICK = {"cells": (4, 4), "starts": (4, 4)}


@pytest.fixture(scope="module")
def structure():
    return vk.find_structure(WELL, cells=(20, 20), starts=(8, 8))


@pytest.mark.parametrize("osc", [None, "hertz-0.570", 3])
def test_what_is_no_oscillator(osc):
    for search in (vk.find_structure, lambda o: vk.unstable_orbits(o, 1), lambda o: vk.continuation(o, "a", [1.0])):
        with pytest.raises(SceneError, match="must be an Oscillator"):
            search(osc)


@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [
        ("executor", 3, StructureError), ("executor", [], StructureError), ("executor", np.ones(2), StructureError),
        ("progress", 3, StructureError), ("stepper", 3, StepperError), ("stepper", [], StepperError),
        ("stepper", np.array([1]), StepperError),
    ],
    ids=str,
)  # fmt: skip
def test_wrong_types_are_told_before_any_work(structure, name, value, kind):
    searches = (
        lambda **k: vk.find_structure(WELL, **k),
        lambda **k: vk.unstable_orbits(WELL, 1, **k),
        lambda **k: vk.continuation(WELL, "damping_ratio", [0.1], **k),
        lambda **k: vk.shape_stability(WELL, structure, **k),
    )
    for search in searches:
        with pytest.raises(kind, match=name):
            search(**{name: value})


@pytest.mark.parametrize("text", ["rk5", "rk4:0", "rk4:a", ""])
def test_texts_of_steppers(text):
    searches = (vk.find_structure, lambda osc, **k: vk.continuation(osc, "damping_ratio", [0.1], **k))
    for search in searches:
        with pytest.raises(StepperError):
            search(WELL, stepper=text)


@pytest.mark.parametrize("name", ["saddles", "manifolds"])
@pytest.mark.parametrize("value", ["yes", math.nan, np.array([1, 2]), None])
def test_flags_are_true_or_false(name, value):
    with pytest.raises(StructureError, match=f"{name} must be True or False"):
        vk.find_structure(WELL, **{name: value})


def test_numbers_of_numpy_are_numbers():
    pair = (np.int64(6), np.int32(6))
    found = vk.find_structure(
        WELL, cells=pair, starts=np.array([6, 6]), refine=np.int64(1), margin=np.int64(1), settling=np.float32(0.01),
        rng=np.int64(8), manifolds=False,
    )  # fmt: skip
    assert found.basins.labels.shape == (12, 12)
    assert found.seed == 8


def test_a_structure_of_another_scene(structure):
    other = WELL.replace({"damping_ratio": 0.1})
    for use in (lambda: vk.shape_stability(other, structure), lambda: vk.ActionPlot().run(other, structure)):
        with pytest.raises(StructureError, match="another scene"):
            use()
    for nothing in (None, "abc", structure.basins):
        with pytest.raises(StructureError, match="must be a Structure"):
            vk.shape_stability(WELL, nothing)


def test_noise_may_differ(structure):
    louder = WELL.replace({"noise.intensity": 0.02})
    assert len(vk.shape_stability(louder, structure, phases=1, directions=8)) == 2


def test_a_region_that_holds_no_steady_state():
    with pytest.raises(StructureError, match="no steady state lies in"):
        vk.find_structure(WELL, region=((100, 101), (100, 101)), **QUICK)


def test_motion_that_grows_without_bound():
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, spring=vk.CubicSpring(linear=1.0, cubic=-1.0))
    with pytest.raises(StructureError, match="narrow the region"):
        vk.find_structure(osc, region=((50, 60), (50, 60)), **QUICK)


@pytest.mark.parametrize(
    ("path", "values"),
    [
        ("nowhere", [1.0]), ("ratio", [0.1]), ("", [0.1]),
        (["damping_ratio"], [0.1]), ("damping_ratio", []), ("damping_ratio", [0.1, math.nan]),
        ("damping_ratio", [0.1, 0.1]), ("damping_ratio", "abc"), ("damping_ratio", None),
    ],
    ids=str,
)  # fmt: skip
def test_continuations_that_cannot_be(path, values):
    with pytest.raises(VibrokitError):
        vk.continuation(WELL, path, values, **QUICK)


def test_any_executor_will_do():
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        found = vk.find_structure(WELL, executor=pool, **QUICK)
    np.testing.assert_array_equal(found.basins.labels, vk.find_structure(WELL, **QUICK).basins.labels)


def test_a_folder_that_is_not_there(structure, tmp_path):
    with pytest.raises(FileNotFoundError, match="which is no folder; make it first"):
        structure.save(tmp_path / "nowhere" / "x.nc")


@pytest.mark.parametrize("rng", [True, -1, "x"])
def test_seeds_are_whole_numbers(rng):
    with pytest.raises(VibrokitError, match="rng"):
        vk.find_structure(WELL, rng=rng, **QUICK)

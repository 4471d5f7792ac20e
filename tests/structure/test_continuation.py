import concurrent.futures
import dataclasses
import itertools
import multiprocessing

import numpy as np
import pytest
from scipy import stats

import vibrokit as vk
from tests.scenes import scene
from vibrokit.errors import StructureError
from vibrokit.results.codes import Code
from vibrokit.structure import continuation as module
from vibrokit.structure.continuation import continuation

pytestmark = pytest.mark.slow

FREQUENCY = "excitations.0.frequency"
QUICK = {"cells": (30, 30), "starts": (10, 10)}


@pytest.fixture(scope="module")
def paper():
    return continuation(vk.load_scene("hertz-0.570"), FREQUENCY, [0.61, 0.565, 0.58, 0.595], **QUICK)


@pytest.fixture(scope="module")
def duffing():
    return continuation(vk.load_scene("duffing"), FREQUENCY, [1.2, 1.3, 1.4, 1.5, 1.6], **QUICK)


def same(first, second):
    """Compare records to the last bit, except for the time that they took."""
    if dataclasses.is_dataclass(first):
        names = [field.name for field in dataclasses.fields(first) if field.name not in ("seconds", "stats")]
        return type(first) is type(second) and all(same(getattr(first, n), getattr(second, n)) for n in names)
    if isinstance(first, tuple):
        return len(first) == len(second) and all(map(same, first, second))
    if isinstance(first, np.ndarray | float):
        kind = np.asarray(first).dtype.kind
        return np.array_equal(first, second, equal_nan=kind in "fc")
    return bool(first == second)


@pytest.mark.long
def test_branches_keep_their_identity(paper):
    np.testing.assert_array_equal(paper.values, [0.565, 0.58, 0.595, 0.61])
    assert paper.complete
    assert {"clear", "hammering"} <= set(paper.branch_names)
    assert len(paper.branch("clear")) == len(paper.branch("hammering")) == 4
    for number, name in enumerate(paper.branch_names):
        assert same(paper.branch(number), paper.branch(name))
    for value, attractor in paper.branch("clear"):
        # Closed form of the linear response, displaced by the constant force.
        response = 0.18 / (1 - value**2 + 2j * 0.01 * value)
        np.testing.assert_allclose(attractor.points[0], [response.real + 0.2, (1j * value * response).real], atol=1e-9)
    assert all(attractor.period == 1 and attractor.hits["right"] > 0 for _, attractor in paper.branch("hammering"))
    for at in paper.states:
        assert [attractor.label for attractor in at.attractors] == list(range(len(at.attractors)))
        assert len({attractor.name for attractor in at.attractors} - {""}) == len(at.attractors)
    assert "ω (rad s⁻¹)" in paper.plot().ax.get_xlabel()
    assert len(paper.plot_fractions().areas) == len(paper.branches)


@pytest.mark.long
def test_basin_fractions_are_shares_of_one_region(paper):
    shares, errors = paper.fractions()
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=0.02)  # but for cells on a boundary that did not settle
    cells = 900.0 * 4.0 ** np.arange(8)  # 30 × 30, halved until each attractor has its own
    for share, error in zip(shares[errors > 0], errors[errors > 0], strict=True):
        expected = stats.beta.std(cells * share + 0.5, cells * (1 - share) + 0.5)  # Jeffreys' interval
        assert np.min(np.abs(expected / error - 1)) < 1e-9
    assert paper.region is not None
    for at in paper.states:
        for attractor in at.attractors:
            (x_low, x_high), (v_low, v_high) = paper.region.bounds
            assert np.all((x_low < attractor.points[:, 0]) & (attractor.points[:, 0] < x_high))
            assert np.all((v_low < attractor.points[:, 1]) & (attractor.points[:, 1] < v_high))


def test_duffing_has_two_branches_that_overlap_between_two_folds(duffing):
    first, last = (found.value for found in duffing.bifurcations)
    assert [found.kind for found in duffing.bifurcations] == ["fold", "fold"]
    assert 1.2 < first < 1.3
    assert 1.5 < last < 1.6
    small, large = sorted(duffing.branches, key=lambda number: np.abs(duffing.branch(number)[0][1].orbit).max())
    assert [value for value, _ in duffing.branch(small)] == [1.3, 1.4, 1.5, 1.6]
    assert [value for value, _ in duffing.branch(large)] == [1.2, 1.3, 1.4, 1.5]
    assert not np.isnan(duffing.fractions()[0]).any()


def test_an_attractor_that_the_search_missed_is_found_from_its_neighbour(monkeypatch):
    found, osc, at_middle = module.structure_of, vk.load_scene("duffing"), []

    def forgetful(scene, request, **settings):
        structure = found(scene, request, **settings)
        if scene.parameters[FREQUENCY] != 1.4:
            return structure
        at_middle.extend(structure.attractors)
        return dataclasses.replace(structure, attractors=structure.attractors[1:])

    monkeypatch.setattr(module, "structure_of", forgetful)
    region = ((-3, 3), (-3, 3))
    result = continuation(osc, FREQUENCY, [1.35, 1.4, 1.45], region=region, **QUICK)
    assert len(at_middle) == 2
    by_place = {round(each.points[0, 0], 6): each for each in result.states[1].attractors}
    added = by_place.pop(round(at_middle[0].points[0, 0], 6))
    (kept,) = by_place.values()
    np.testing.assert_allclose(added.points, at_middle[0].points, atol=1e-9)
    (finding,) = result.found(Code.FOUND_BY_NEIGHBOUR)
    assert finding.values["count"] == 1
    # Both codes that the basin fractions of this case are known from say 0.571 and 0.429 on this region.
    assert sorted([kept.basin_fraction, added.basin_fraction]) == pytest.approx([0.429, 0.571], abs=0.02)


def test_wells_meet_in_a_pitchfork():
    result = continuation(
        vk.load_scene("double-well"), "spring.linear", [-0.3, -0.1, 0.1], cells=(20, 20), starts=(6, 6)
    )
    (pitchfork,) = result.bifurcations
    assert pitchfork.kind == "pitchfork or transcritical"
    assert pitchfork.value == pytest.approx(0.0, abs=1e-10)
    assert pitchfork.branch == result.states[2].branches[0]
    assert [len(at.attractors) for at in result.states] == [2, 2, 1]


@pytest.mark.long
def test_processes_give_the_same_to_the_last_bit():
    osc, values = vk.load_scene("double-well"), [-1.0, -0.6]
    seen, serial_seen = [], []
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        parallel = continuation(
            osc, "spring.linear", values, cells=(20, 20), starts=(6, 6), executor=pool,
            progress=seen.append,
        )  # fmt: skip
    serial = continuation(osc, "spring.linear", values, cells=(20, 20), starts=(6, 6), progress=serial_seen.append)
    assert same(serial, parallel)
    assert parallel.stats.trajectories == serial.stats.trajectories > 0  # whichever process integrated them
    totals = {"values": 2, "branches": 3, "basin fractions": 2}
    for updates in (seen, serial_seen):
        assert [name for name in dict.fromkeys(update.stage for update in updates) if name in totals] == list(totals)
        for name, total in totals.items():
            own = [update for update in updates if update.stage == name]
            assert {update.total for update in own} == {total}
            assert [update.done for update in own] == sorted(update.done for update in own)
            assert own[-1].done == total
            assert own[-1].finished
    assert len(serial.branches) == 2
    for value, attractor in serial.branch(0):
        assert abs(attractor.points[0, 0]) == pytest.approx(np.sqrt(-value), abs=1e-9)


def test_cells_without_an_attractor_are_one_finding_at_each_value():
    osc = scene(damping_ratio=0.1, spring=vk.CubicSpring(linear=1.0, cubic=-1.0))
    region = ((-1.5, 1.5), (-1.5, 1.5))
    result = continuation(osc, "damping_ratio", [0.1, 0.2], region=region, cells=(15, 15), starts=(6, 6))
    for at in result.states:
        cells = {f.code: f.values["fraction"] for f in at.findings if f.code.value.startswith("cells-")}
        assert len(cells) == sum(f.code.value.startswith("cells-") for f in at.findings)
        assert cells[Code.CELLS_LEFT_REGION] > 0.1
        assert sum(cells.values()) + sum(a.basin_fraction for a in at.attractors) == pytest.approx(1.0)


def test_values_that_the_scene_refuses_stand_with_the_reason():
    result = continuation(vk.load_scene("duffing"), "damping_ratio", [-0.1, 0.0, 0.05], cells=(8, 8), starts=(6, 6))
    refused, undamped, damped = result.states
    for at, words in ((refused, "at least 0"), (undamped, "no attractors")):
        (finding,) = at.findings
        assert (finding.code, finding.values["value"]) == (Code.NOTHING_AT, at.value)
        assert words in finding.values["reason"]
        assert finding in result.findings
    assert damped.attractors
    assert result.complete
    assert np.isnan(result.fractions()[0][:2]).all()
    for unknown in (7, -1, "hammering", "", True, None):
        with pytest.raises(StructureError, match="no branch"):
            result.branch(unknown)


def test_findings_name_the_branches(duffing):
    assert set(duffing.branch_names) == {"small-oscillation", "large-oscillation"}
    folds = duffing.found(Code.BIFURCATION)
    assert [(one.values["kind"], one.source) for one in folds] == [("fold", b.branch) for b in duffing.bifurcations]
    for one in folds:
        assert duffing.branch_names[one.source] in one.sentence(duffing.names)
    (branches,) = duffing.found(Code.BRANCHES)
    assert dict(branches.values) == {"branches": 2, "values": 5, "parameter": FREQUENCY}


@pytest.mark.parametrize("given", [{}, {"region": ((-3, 3), (-3, 3)), "stepper": vk.RK4(512), "rng": 4}])
def test_settings_repeat_the_call(given, tmp_path):
    osc = vk.load_scene("duffing")
    continuation(osc, "frequency", np.array([1.3, 1.2]), cells=(6, 6), starts=(6, 6), **given).save(tmp_path / "c.nc")
    saved = vk.load_result(tmp_path / "c.nc")
    assert saved.parameter == FREQUENCY
    assert same(continuation(saved.oscillator, **saved.settings), saved)


SMALL = {"values": [-1.0, -0.6, -0.3], "cells": (10, 10), "starts": (6, 6)}


@pytest.fixture(scope="module")
def small():
    """A short continuation of the double well, and what a listener was told meanwhile."""
    osc, seen = vk.load_scene("double-well"), []
    continuation(osc, "spring.linear", **SMALL)  # so that everything is compiled
    return osc, continuation(osc, "spring.linear", **SMALL, progress=seen.append), seen


@pytest.mark.long
def test_an_interrupt_at_any_moment_leaves_the_values_found(small, tmp_path):
    osc, whole, seen = small
    stages = ("values", "branches", "basin fractions")
    for call in np.unique(np.linspace(1, len(seen), 12).astype(int)):
        calls = itertools.count(1)

        def listener(update, calls=calls, call=call):
            if next(calls) == call:
                raise KeyboardInterrupt

        part = continuation(osc, "spring.linear", **SMALL, progress=listener)
        (stopped,) = part.found(Code.STOPPED)
        assert stopped.values["stage"] in stages
        assert not part.complete
        np.testing.assert_array_equal(part.values, whole.values[: len(part.values)])
        assert len(part.values) == 3 or stopped.values["stage"] == "values"
        for number in part.branches:  # joined, if only by distance; the last value may hold a part of its attractors
            assert len(part.branch(number)) >= len(part.values) - 1
        assert len(part.branches) == 2 or len(part.values) <= 1
        part.save(tmp_path / "part.nc")
        assert same(vk.load_result(tmp_path / "part.nc"), part)

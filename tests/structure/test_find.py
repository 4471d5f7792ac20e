import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import vibrokit as vk
from tests.layers import long, slow
from tests.scenes import double_well, scene
from vibrokit.errors import StructureError
from vibrokit.results.basins import AT_COPY, ESCAPED, NOT_FOLLOWED, UNSETTLED, Basins
from vibrokit.results.codes import Code
from vibrokit.results.region import Region
from vibrokit.structure.basins.grid import cell_findings
from vibrokit.structure.orbits import refine_orbit
from vibrokit.structure.persistence import persistent_stepper


def test_the_paper_scene_has_a_clear_and_a_hammering_state(paper):
    _, structure = paper
    clear, hammering = structure.attractors
    assert structure.names == ("clear", "hammering")
    assert structure.attractor("ham") is hammering
    assert (clear.label, clear.impacts, clear.kind, clear.period) == (0, 0, "periodic", 1)
    assert hammering.impacts > 0
    assert sum(hammering.hits.values()) == hammering.impacts
    assert hammering.basin_fraction > clear.basin_fraction > 0  # as the paper says of ω = 0.570
    assert {finding.code: finding.values["count"] for finding in structure.findings} == {
        Code.STEADY_STATES: 2, Code.SADDLES: 1,
    }  # fmt: skip
    for attractor in structure.attractors:
        assert np.abs(attractor.multipliers).max() < 1
        # Liouville: both multipliers together are what friction leaves of an area, exp(−2ζω_n T).
        assert np.prod(attractor.multipliers).real == pytest.approx(np.exp(-0.02 * 2 * np.pi / 0.57), rel=1e-4)


def test_the_clear_state_is_the_linear_response(paper):
    osc, structure = paper
    response = 0.18 / (1 - 0.57**2 + 2j * 0.01 * 0.57)
    exact = [response.real + 0.2, (0.57j * response).real]
    orbit = refine_orbit(osc, structure.attractors[0].points[0], 1, vk.RK4(8192))
    np.testing.assert_allclose(orbit.point, exact, atol=1e-12)
    np.testing.assert_allclose(structure.attractors[0].points[0], exact, atol=1e-6)


@pytest.mark.filterwarnings("ignore::vibrokit.kernels.choice.CoarseStepsWarning", "ignore:overflow:RuntimeWarning")
@pytest.mark.parametrize("which", [slice(None), slice(1, None)], ids=["both", "hammering"])
def test_steps_are_refined_until_all_attractors_persist(paper, which):
    """With 16 steps, motion that starts on the hammering state diverges; the clear state persists."""
    osc, structure = paper
    kept, distances = structure.attractors[which], 1e-3 * structure.basins.region.widths
    clear = structure.attractors[:1]
    assert persistent_stepper(osc, clear, vk.RK4(16), distances) == vk.RK4(16)
    found = persistent_stepper(osc, kept, vk.RK4(16), distances)
    assert 16 < found.steps <= 256
    for attractor in kept:
        (end,) = osc.section_map(attractor.points[:1], 512, stepper=found)
        assert np.linalg.norm((end - attractor.points[0]) / distances) <= 2


def test_labels_are_where_the_flow_leads(paper):
    osc, structure = paper
    basins = structure.basins
    centres = basins.region.cell_centres(basins.labels.shape)
    picked = np.random.default_rng(0).choice(len(centres), 50, replace=False)
    ends = osc.section_map(centres[picked], 400, stepper=vk.RK4(512))
    points = np.array([attractor.points[0] for attractor in structure.attractors])
    nearest = np.argmin(np.linalg.norm(ends[:, None] - points, axis=2), axis=1)
    assert np.mean(nearest == basins.labels.ravel()[picked]) > 0.9  # cells on a boundary may differ by the step


def van_der_pol():
    """x″ + (x² − 1)x′ + x = 0."""
    spring = vk.CustomSpring("x + mu*(x**2 - 1)*v", mu=1.0)
    return scene(damping_ratio=0.0, spring=spring)


def test_a_limit_cycle():
    structure = vk.find_structure(van_der_pol(), cells=(40, 40), starts=(8, 8))
    (cycle,) = structure.attractors
    assert cycle.kind == "limit cycle"
    assert cycle.duration == pytest.approx(6.6632868593231302, abs=1e-9)  # known to thirty digits
    assert cycle.points[0, 0] == pytest.approx(2.0086198608748431, abs=1e-9)
    assert cycle.basin_fraction == 1.0
    assert np.sort(np.abs(cycle.multipliers))[-1] == pytest.approx(1.0, abs=1e-8)


@pytest.mark.slow
def test_a_scene_whose_noise_depends_on_the_state():
    osc = double_well(noise=vk.StateDependentNoise(0.01, "1 + c*x**2", c=0.5))
    wells = vk.find_structure(osc, cells=(20, 20), starts=(8, 8)).attractors
    assert sorted(well.points[0, 0] for well in wells) == pytest.approx([-1, 1], abs=1e-9)


def test_what_escapes_is_said_to_have_left():
    osc = scene(damping_ratio=0.1, spring=vk.CubicSpring(linear=1.0, cubic=-1.0))
    structure = vk.find_structure(osc, region=((-1.5, 1.5), (-1.5, 1.5)), cells=(30, 30), starts=(8, 8))
    assert structure.basins.fraction(ESCAPED) > 0.1
    assert structure.basins.fraction(0) + structure.basins.fraction(ESCAPED) == pytest.approx(1.0)
    (finding,) = structure.found(Code.CELLS_LEFT_REGION)
    assert finding.values["fraction"] == structure.basins.fraction(ESCAPED)
    assert sorted(round(saddle.points[0, 0], 9) for saddle in structure.saddles) == [-1.0, 1.0]


def test_cells_without_an_attractor_are_findings():
    labels = np.array([[0, 1, ESCAPED, ESCAPED], [AT_COPY, UNSETTLED, 0, 0]], dtype=np.int16)
    found = cell_findings(Basins(Region((0, 1), (0, 1)), labels))
    assert {finding.code: finding.values["fraction"] for finding in found} == {
        Code.CELLS_UNSETTLED: 1 / 8, Code.CELLS_LEFT_REGION: 2 / 8, Code.CELLS_AT_COPIES: 1 / 8,
    }  # fmt: skip
    assert cell_findings(Basins(Region((0, 1), (0, 1)), np.zeros((3, 2), dtype=np.int16))) == ()


# --- settings


@pytest.mark.parametrize(
    "given",
    [
        {"cells": (20, 20), "starts": (8, 8), "rng": 3},
        {
            "cells": np.array([10, 12]), "starts": (6, 6), "refine": np.int64(1), "margin": None, "settling": 0.01,
            "budget": 300, "region": ((-2, 2), (-1.5, 1.5)), "stepper": vk.RK4(512), "manifolds": False,
            "rng": np.random.default_rng(5),
        },
    ],
)  # fmt: skip
def test_settings_repeat_the_call(given, tmp_path):
    osc = vk.load_scene("double-well")
    structure = vk.find_structure(osc, **given)
    structure.save(tmp_path / "s.nc")
    saved = vk.load_result(tmp_path / "s.nc")
    again = vk.find_structure(saved.oscillator, **saved.settings)
    np.testing.assert_array_equal(again.basins.labels, structure.basins.labels)
    assert again.basins.region == structure.basins.region
    for one, other in zip(structure.manifolds, again.manifolds, strict=True):
        np.testing.assert_array_equal(one.curve, other.curve)
    assert dict(again.settings) == dict(structure.settings)
    assert again.stepper == structure.stepper


# --- interrupts


WELL = {"cells": (40, 40), "starts": (8, 8)}
STAGES = ("attractors", "basins", "saddles", "manifolds")


class Listener:
    """Keeps what it is told, and interrupts at a call."""

    def __init__(self, last=None):
        self.seen, self.last = [], last

    def __call__(self, update):
        self.seen.append(update)
        if len(self.seen) == self.last:
            raise KeyboardInterrupt


@pytest.fixture(scope="module")
def well():
    """The double well, its structure, and what a listener was told meanwhile."""
    osc, listener = vk.load_scene("double-well"), Listener()
    vk.find_structure(osc, **WELL)  # so that everything is compiled
    return osc, vk.find_structure(osc, **WELL, progress=listener), listener.seen


def test_stages_count_to_their_totals(well):
    _, structure, seen = well
    assert tuple(dict.fromkeys(update.stage for update in seen)) == STAGES
    for name in STAGES:
        own = [update for update in seen if update.stage == name]
        done = [update.done for update in own]
        assert done == sorted(done)
        assert [update.finished for update in own] == [False] * (len(own) - 1) + [True]
        (total,) = {update.total for update in own}
        assert total is None if name == "saddles" else done[-1] == total
    units = {update.stage: (update.unit, update.total) for update in seen}
    assert units["attractors"] == ("starts", 64)
    assert units["manifolds"] == ("branches", 4)
    assert units["saddles"][0] == "motions"
    stats = structure.stats
    assert set(stats.seconds) >= set(STAGES)
    assert sum(stats.seconds.values()) <= structure.seconds
    assert 0 < stats.trajectories <= stats.intervals
    assert stats.steps > 0
    assert stats.newton_iterations > 0


def test_an_interrupt_at_any_moment_leaves_what_was_found(well):
    osc, whole, seen = well
    for call in np.unique(np.linspace(1, len(seen), 20).astype(int)):
        part = vk.find_structure(osc, **WELL, progress=Listener(call))
        (stopped,) = part.found(Code.STOPPED)
        doing = stopped.values["stage"]
        assert (doing, stopped.values["reason"]) == (seen[call - 1].stage, "interrupt")
        assert not part.complete
        assert part.failed
        assert [a.label for a in part.attractors] == list(range(len(part.attractors)))
        assert all(a.name for a in part.attractors)
        followed = part.basins.labels != NOT_FOLLOWED
        searching = [dict(one.values) for one in part.found(Code.SEARCH_STOPPED)]
        assert len(searching) == (doing == "attractors")
        for counts in searching:
            assert counts["starts"] == 64
            assert counts["settled"] + counts["moving"] + counts["left"] + counts["diverged"] == 64
        if doing != "attractors":
            assert len(part.attractors) == 2
            np.testing.assert_array_equal(part.basins.labels[followed], whole.basins.labels[followed])
        if doing in ("saddles", "manifolds"):
            assert followed.all()
            assert [a.basin_fraction for a in part.attractors] == [a.basin_fraction for a in whole.attractors]
        assert len(part.saddles) == 1 if doing == "manifolds" else len(part.saddles) <= 1
        assert len(part.manifolds) <= 4 if doing == "manifolds" else not part.manifolds


@pytest.mark.parametrize("share", [1e-4, 0.2, 0.9, 1e6])
def test_a_time_limit_leaves_what_was_found(well, share):
    osc, whole, _ = well
    limit = share * whole.seconds
    part = vk.find_structure(osc, **WELL, time_limit=limit)
    assert part.seconds >= min(limit, part.seconds if part.complete else limit)
    for stopped in part.found(Code.STOPPED):
        assert stopped.values["reason"] == "time limit"
    assert part.complete == (not part.found(Code.STOPPED))
    if part.complete:
        np.testing.assert_array_equal(part.basins.labels, whole.basins.labels)


RESTLESS = {  # rf-driven Josephson junction (Phys. Rev. A 36, 2455); megastable oscillator; a ball on a stiff table
    "running": {"spring": vk.CustomSpring("sin(x)"), "excitations": (vk.Constant(1.878), vk.Harmonic(10.198, 1.0))},
    "megastable": {
        "damping_ratio": 0.0,
        "spring": vk.CustomSpring("w2*x - v*cos(x)", w2=0.1089),
        "excitations": (vk.Harmonic(1.0, 0.73),),
    },
    "bouncing": {
        "damping_ratio": 0.0,
        "spring": vk.LinearSpring(0.0),
        "barriers": (vk.Barrier(vk.CustomLaw("k*depth + c*rate", k=1e8, c=1400.0), 0.0, "left"),),
        "excitations": (vk.Constant(-1.0), vk.Harmonic(1.2, 1.0)),
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("name", [long("running"), "megastable", long("bouncing")])
def test_a_search_that_is_stopped_says_what_its_starts_were_doing(name, tmp_path):
    osc = vk.Oscillator(**({"natural_frequency": 1.0, "damping_ratio": 0.1} | RESTLESS[name]))
    vk.find_structure(osc, time_limit=2.0)  # so that what comes first is compiled
    for limit in (2.0, 3.0, 4.0, 6.0):  # a slow machine follows none for a period at first
        part = vk.find_structure(osc, time_limit=limit)
        assert not part.complete
        assert part.seconds < limit + 10.0  # what is compiled in it cannot be stopped
        (counts,) = [dict(one.values) for one in part.found(Code.SEARCH_STOPPED)]
        if counts["periods"] > 0:
            break
    assert counts["periods"] > 0
    assert counts["settled"] + counts["moving"] + counts["left"] + counts["diverged"] == counts["starts"] == 576
    part.save(tmp_path / "part.nc")
    assert vk.load_result(tmp_path / "part.nc").names == part.names
    part.plot()
    if name != "bouncing":  # most of its starts have settled by then
        with pytest.raises(StructureError, match="no attractors"):
            vk.LeastAction().run(osc.replace(noise=vk.WhiteNoise(1e-3)), part)


def test_forces_of_the_stops_along_an_orbit(paper):
    osc, structure = paper
    hammering = structure.attractors[1]
    depth, force = hammering.peak_depth["right"], hammering.peak_force["right"]
    assert force == pytest.approx(50.0 * depth**1.5, rel=1e-9)  # Hertz
    path = osc.trajectory(hammering.points[0], 1, samples=2**15)
    assert depth == pytest.approx(path.x.max() - 0.5, abs=1e-8)
    assert hammering.peak_depth["left"] == hammering.peak_force["left"] == 0.0
    np.testing.assert_allclose(hammering.extent[0], [path.x.min(), path.x.max()], atol=1e-5)


def speed_at_a_rigid_stop():
    """The speed of impact in the limit of infinite stiffness: one elastic impact a period at x = 0, by shooting."""

    def miss(unknown):
        phase, speed = unknown
        flight = solve_ivp(
            lambda t, y: [y[1], np.cos(2 * t) - 0.2 * y[1] - y[0]], (phase, phase + np.pi), [0.0, -speed],
            method="DOP853", rtol=1e-12, atol=1e-12,
        )  # fmt: skip
        return [flight.y[0, -1], flight.y[1, -1] - speed]

    return abs(fsolve(miss, [0.0, 4.0], xtol=1e-12)[1])


@pytest.mark.parametrize("stiffness", [1e8, slow(1e12)])
def test_the_shortest_contacts_are_counted(stiffness):
    """A mass that bounces on one stop: as often and as fast, however short the contacts are."""
    changes = {f"barriers.{stop}.law.stiffness": stiffness for stop in (0, 1)}
    changes |= {"barriers.0.position": 0.0, "barriers.1.position": -10.0, "damping_ratio": 0.1}
    changes |= {"excitations.0.amplitude": 1.0, "excitations.0.frequency": 2.0, "excitations.1.force": 0.0}
    osc = vk.load_scene("hertz-0.570").replace(changes)
    structure = vk.find_structure(osc, cells=(4, 4), starts=(4, 4), saddles=False)
    assert [attractor.hits for attractor in structure.attractors] == [{"right": 1, "left": 0}]
    depth, force = (peak["right"] for peak in (structure.attractors[0].peak_depth, structure.attractors[0].peak_force))
    assert force == pytest.approx(stiffness * depth**1.5, rel=1e-9)
    speed = np.sqrt(0.8 * stiffness * depth**2.5)  # all of its energy is in the stop there
    contact = 2.94 * depth / speed  # Hertz's duration of an impact, as a part of the period: what the limit leaves out
    assert speed == pytest.approx(speed_at_a_rigid_stop(), rel=3 * contact / np.pi)


FEW = {"cells": (40, 40), "starts": (12, 12), "manifolds": False}


@pytest.fixture(scope="module")
def in_metres():
    return vk.find_structure(vk.load_scene("hertz-0.570"), **FEW)


@pytest.mark.parametrize(("length", "rate"), [(1e-6, 1e3), (1e-3, 1.0), (1e3, 1e-2)])
def test_units_change_nothing(in_metres, length, rate):
    """The same scene in other units: lengths × L, rates × W, Hertz's stiffness × W²/√L."""
    unit = {"": 1.0, "m": length, "s^-1": rate, "m s^-2": length * rate**2, "m^(-1/2) s^-2": rate**2 / length**0.5}
    scaled = in_metres.oscillator.replace(
        {
            "natural_frequency": rate,
            **{f"barriers.{n}.position": sign * 0.5 * unit["m"] for n, sign in ((0, 1), (1, -1))},
            **{f"barriers.{n}.law.stiffness": 50.0 * unit["m^(-1/2) s^-2"] for n in (0, 1)},
            "excitations.0.amplitude": 0.18 * unit["m s^-2"],
            "excitations.0.frequency": 0.57 * unit["s^-1"],
            "excitations.1.force": 0.2 * unit["m s^-2"],
        }
    )
    structure = vk.find_structure(scaled, **FEW)
    scale = np.array([length, length * rate])
    for ours, theirs in zip(structure.attractors, in_metres.attractors, strict=True):
        np.testing.assert_allclose(ours.points / scale, theirs.points, atol=1e-9)
        assert ours.hits == theirs.hits
        assert ours.basin_fraction == pytest.approx(theirs.basin_fraction, abs=0.01)
    np.testing.assert_allclose(structure.saddles[0].points / scale, in_metres.saddles[0].points, atol=1e-9)


@pytest.mark.slow
def test_a_symmetric_orbit_meets_both_stops_alike():
    """A force that damps is largest before the deepest point; the numbers are SciPy's (DOP853, 1e-12)."""
    law = vk.CustomLaw("k*depth + c*rate", k=100.0, c=2.0)
    osc = scene(
        vk.Barrier(law, 0.3, "right"),
        vk.Barrier(law, -0.3, "left"),
        damping_ratio=0.02,
        excitations=(vk.Harmonic(0.5, 0.8),),
    )
    (orbit,) = vk.find_structure(osc, cells=(4, 4), starts=(6, 6), saddles=False).attractors
    for side in ("right", "left"):
        assert orbit.peak_force[side] == pytest.approx(4.154984, abs=1e-6)
        assert orbit.peak_depth[side] == pytest.approx(0.0407529131, abs=1e-9)

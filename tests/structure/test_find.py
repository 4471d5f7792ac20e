import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import vibrokit as vk
from vibrokit.errors import NoSectionError, ParameterError, StructureError
from vibrokit.results.basins import LEFT, NOT_FOLLOWED, Basins
from vibrokit.results.region import Region
from vibrokit.structure.orbits import refine_orbit
from vibrokit.structure.status import fates_of


def test_the_paper_scene_has_a_clear_and_a_hammering_state(paper):
    _, structure = paper
    clear, hammering = structure.attractors
    assert (clear.label, clear.impacts, clear.kind, clear.period) == (0, 0, "periodic", 1)
    assert hammering.impacts > 0
    assert sum(hammering.hits.values()) == hammering.impacts
    assert hammering.basin_fraction > clear.basin_fraction > 0  # as the paper says of ω = 0.570
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


def test_labels_are_where_the_flow_leads(paper):
    osc, structure = paper
    basins = structure.basins
    centres = basins.region.cell_centres(basins.labels.shape)
    picked = np.random.default_rng(0).choice(len(centres), 50, replace=False)
    ends = osc.section_map(centres[picked], 400, stepper=vk.RK4(512))
    points = np.array([attractor.points[0] for attractor in structure.attractors])
    nearest = np.argmin(np.linalg.norm(ends[:, None] - points, axis=2), axis=1)
    assert np.mean(nearest == basins.labels.ravel()[picked]) > 0.9  # cells on a boundary may differ by the step


def test_duffing_has_a_small_and_a_large_orbit():
    osc = vk.load_scene("duffing")
    structure = vk.find_structure(osc, cells=(60, 60), region=((-3, 3), (-3, 3)))
    sizes = [np.abs(osc.trajectory(a.points[0], 1).x).max() for a in structure.attractors]
    assert len(sizes) == 2
    assert min(sizes) < 1 < max(sizes)


def test_the_double_well_is_symmetric_to_the_last_cell():
    structure = vk.find_structure(vk.load_scene("double-well"), cells=(80, 80), region=((-2, 2), (-2, 2)))
    labels = structure.basins.labels
    np.testing.assert_array_equal(labels, 1 - labels[::-1, ::-1])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"damping_ratio": 0.0}, "damping"),
    ],
)
def test_scenes_without_attractors_are_refused(change, words):
    with pytest.raises(StructureError, match=words):
        vk.find_structure(vk.load_scene("hertz-0.570").replace(change))


def test_no_common_period_is_said():
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.1,
        excitations=(vk.Harmonic(0.1, 1.0), vk.Harmonic(0.1, 2**0.5)),
    )
    with pytest.raises(NoSectionError, match="no common period"):
        vk.find_structure(osc)


@pytest.mark.parametrize("bounds", [((1, -1), (0, 1)), ((0, 0), (0, 1)), ((0, float("nan")), (0, 1)), 3, ((0, 1),)])
def test_bad_regions(bounds):
    with pytest.raises(StructureError, match="region"):
        Region.of(bounds)


@pytest.mark.parametrize("budget", [0, -1, 1.5, True])
def test_bad_budgets(budget):
    with pytest.raises(StructureError, match="budget"):
        vk.find_structure(vk.load_scene("hertz-0.570"), budget=budget)


def test_a_budget_too_small_is_said():
    with pytest.raises(StructureError, match="raise budget"):
        vk.find_structure(vk.load_scene("hertz-0.570"), budget=1, starts=(4, 4), cells=(4, 4))


@pytest.mark.parametrize(
    "bad",
    [
        {"cells": 200}, {"cells": (0, 2)}, {"cells": (2.5, 3)}, {"cells": (10**6, 10**6)}, {"starts": None},
        {"starts": (0, 0)}, {"settling": 0}, {"settling": -1.0}, {"settling": "a"}, {"budget": 10**30},
    ],
    ids=str,
)  # fmt: skip
def test_bad_counts(bad):
    with pytest.raises(StructureError, match=next(iter(bad))):
        vk.find_structure(vk.load_scene("hertz-0.570"), **bad)


@pytest.mark.parametrize("rng", [-1, "x", 1.5])
def test_bad_seeds(rng):
    with pytest.raises(ParameterError, match="rng"):
        vk.find_structure(vk.load_scene("hertz-0.570"), rng=rng)
    with pytest.raises(ParameterError, match="rng"):
        vk.load_scene("hertz-0.570").trajectory([0, 0], 1, rng=rng)


def test_a_scene_whose_noise_depends_on_the_state():
    well = vk.load_scene("double-well")
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.05,
        spring=well.spring,
        noise=vk.StateDependentNoise(0.01, "1 + c*x**2", c=0.5),
    )
    assert len(vk.find_structure(osc, cells=(20, 20), starts=(8, 8)).attractors) == 2


def van_der_pol():
    """x″ + (x² − 1)x′ + x = 0."""
    spring = vk.CustomSpring("x + mu*(x**2 - 1)*v", mu=1.0)
    return vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, spring=spring)


def test_a_limit_cycle():
    structure = vk.find_structure(van_der_pol(), cells=(40, 40), starts=(8, 8))
    (cycle,) = structure.attractors
    assert cycle.kind == "limit cycle"
    assert cycle.duration == pytest.approx(6.6632868593231302, abs=1e-9)  # known to thirty digits
    assert cycle.points[0, 0] == pytest.approx(2.0086198608748431, abs=1e-9)
    assert cycle.basin_fraction == 1.0
    assert np.sort(np.abs(cycle.multipliers))[-1] == pytest.approx(1.0, abs=1e-8)


def test_equilibria_have_eigenvalues():
    structure = vk.find_structure(vk.load_scene("double-well"), cells=(40, 40), region=((-2, 2), (-2, 2)))
    zeta = 0.05
    for well in structure.attractors:
        exact = -zeta + 1j * np.sqrt(2 - zeta**2) * np.array([-1, 1])
        np.testing.assert_allclose(np.sort_complex(well.exponents), np.sort_complex(exact), atol=1e-9)
    (hilltop,) = structure.saddles
    np.testing.assert_allclose(hilltop.points, 0.0, atol=1e-9)
    exact = -zeta + np.sqrt(1 + zeta**2) * np.array([1, -1])
    np.testing.assert_allclose(hilltop.exponents, exact, atol=1e-9)
    np.testing.assert_allclose(hilltop.multipliers, np.exp(2 * np.pi * exact), rtol=1e-8)
    assert set(hilltop.leads_to) == {0, 1}


def test_what_escapes_is_said_to_have_left():
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, spring=vk.CubicSpring(linear=1.0, cubic=-1.0))
    structure = vk.find_structure(osc, region=((-1.5, 1.5), (-1.5, 1.5)), cells=(30, 30), starts=(8, 8))
    assert structure.basins.fraction(LEFT) > 0.1
    assert structure.basins.fraction(0) + structure.basins.fraction(LEFT) == pytest.approx(1.0)
    assert "left the region" in structure.status
    assert sorted(round(saddle.points[0, 0], 9) for saddle in structure.saddles) == [-1.0, 1.0]


@pytest.mark.parametrize(("left", "share"), [(1000, "100%"), (123, "12%"), (7, "0.7%")])
def test_shares_are_said_to_two_digits(left, share):
    labels = np.where(np.arange(1000) < left, LEFT, 0).astype(np.int16)
    basins = Basins(Region((0, 1), (0, 1)), labels.reshape(25, 40))
    assert fates_of(basins) == [f"{share} of the cells left the region."]


@pytest.mark.parametrize("stage", ["settle_grid", "find_saddles", "grow_manifolds"])
def test_ctrl_c_leaves_what_was_found(monkeypatch, stage):
    def stop(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(f"vibrokit.structure.find.{stage}", stop)
    structure = vk.find_structure(vk.load_scene("double-well"), cells=(20, 20), starts=(8, 8))
    assert not structure.complete
    assert structure.status.startswith("The work was stopped")
    assert len(structure.attractors) == 2
    assert (structure.basins.labels == NOT_FOLLOWED).all() == (stage == "settle_grid")
    assert len(structure.saddles) == (1 if stage == "grow_manifolds" else 0)


def test_ctrl_c_before_anything_is_found_ends_the_work(monkeypatch):
    def stop(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr("vibrokit.structure.search.run_ensemble", stop)
    with pytest.raises(KeyboardInterrupt):
        vk.find_structure(vk.load_scene("double-well"), cells=(20, 20), starts=(8, 8))


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


@pytest.mark.parametrize("stiffness", [1e8, 1e12])
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


@pytest.mark.parametrize(("length", "rate"), [(1e-6, 1e3), (1e-3, 1.0), (1e3, 1e-2)])
def test_units_change_nothing(paper, length, rate):
    """The same scene in other units: lengths × L, rates × W, Hertz's stiffness × W²/√L."""
    osc, _ = paper
    unit = {"": 1.0, "m": length, "s^-1": rate, "m s^-2": length * rate**2, "m^(-1/2) s^-2": rate**2 / length**0.5}
    scaled = osc.replace(
        {
            "natural_frequency": rate,
            **{f"barriers.{n}.position": sign * 0.5 * unit["m"] for n, sign in ((0, 1), (1, -1))},
            **{f"barriers.{n}.law.stiffness": 50.0 * unit["m^(-1/2) s^-2"] for n in (0, 1)},
            "excitations.0.amplitude": 0.18 * unit["m s^-2"],
            "excitations.0.frequency": 0.57 * unit["s^-1"],
            "excitations.1.force": 0.2 * unit["m s^-2"],
        }
    )
    structure = vk.find_structure(scaled, cells=(40, 40), starts=(12, 12), manifolds=False)
    same = vk.find_structure(osc, cells=(40, 40), starts=(12, 12), manifolds=False)
    scale = np.array([length, length * rate])
    for ours, theirs in zip(structure.attractors, same.attractors, strict=True):
        np.testing.assert_allclose(ours.points / scale, theirs.points, atol=1e-9)
        assert ours.hits == theirs.hits
        assert ours.basin_fraction == pytest.approx(theirs.basin_fraction, abs=0.01)
    np.testing.assert_allclose(structure.saddles[0].points / scale, same.saddles[0].points, atol=1e-9)


def test_a_symmetric_orbit_meets_both_stops_alike():
    """A force that damps is largest before the deepest point; the numbers are SciPy's (DOP853, 1e-12)."""
    law = vk.CustomLaw("k*depth + c*rate", k=100.0, c=2.0)
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.02,
        barriers=(vk.Barrier(law, 0.3, "right"), vk.Barrier(law, -0.3, "left")),
        excitations=(vk.Harmonic(0.5, 0.8),),
    )
    (orbit,) = vk.find_structure(osc, cells=(4, 4), starts=(6, 6), saddles=False).attractors
    for side in ("right", "left"):
        assert orbit.peak_force[side] == pytest.approx(4.154984, abs=1e-6)
        assert orbit.peak_depth[side] == pytest.approx(0.0407529131, abs=1e-9)

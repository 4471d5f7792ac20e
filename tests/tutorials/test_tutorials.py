"""The tutorials run as scripts, and what they find agrees with formulas that owe nothing to the code."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import vibrokit as vk
from tests.klein_kramers import double_well_rate
from tests.tutorials.pictures import assert_pictures
from vibrokit.results.codes import Code

pytestmark = pytest.mark.slow

REPOSITORY = Path(__file__).parents[2]
OMEGA_N, ZETA, OMEGA, F0, F1 = 1.0, 0.01, 0.57, 0.18, 0.2
PERIOD = 2 * np.pi / OMEGA


@pytest.mark.parametrize("path", sorted((REPOSITORY / "tutorials").glob("*.py")), ids=lambda path: path.stem)
def test_form_of_the_page(path):
    """A title, the question, the end, and code that no page cuts."""
    lines = path.read_text(encoding="utf-8").splitlines()
    assert lines[0] == '"""'
    assert lines[2] == "=" * len(lines[1])
    assert lines[4].startswith("**Question:** ")
    assert "# What you saw" in lines
    assert lines[-1] == "plt.show()"
    assert [line for line in lines if len(line) > 100] == []  # a page of 1280 points shows 110
    header = path.with_name("GALLERY_HEADER.rst").read_text(encoding="utf-8")
    assert f":doc:`{path.stem}`" in header


@pytest.fixture(scope="module")
def scene(run):
    return run("01_a_scene")


@pytest.fixture(scope="module")
def law(run):
    return run("02_your_own_contact_law")


def response():
    """Complex amplitude of the linear oscillator's steady state."""
    return F0 / (OMEGA_N**2 - OMEGA**2 + 2j * ZETA * OMEGA_N * OMEGA)


# -- 01: a scene ------------------------------------------------------------------------------------------------------


def test_clear_motion_is_that_of_a_linear_oscillator(scene):
    amplitude = F0 / np.sqrt((OMEGA_N**2 - OMEGA**2) ** 2 + (2 * ZETA * OMEGA_N * OMEGA) ** 2)
    assert scene.offset == pytest.approx(F1 / OMEGA_N**2, abs=1e-10)
    assert scene.amplitude == pytest.approx(amplitude, rel=2e-6)  # the crest lies between samples
    expected = [F1 / OMEGA_N**2 + response().real, (1j * OMEGA * response()).real]
    assert scene.clear == pytest.approx(expected, abs=1e-10)


def test_stop_hits(scene):
    assert scene.hits(scene.clear_orbit) == (0, 0)
    assert scene.hits(scene.hammering_orbit) == (2, 0)
    assert scene.clear_orbit.x.max() < 0.5 < scene.hammering_orbit.x.max()


def test_steady_states_come_back(scene):
    for orbit in (scene.clear_orbit, scene.hammering_orbit):
        assert orbit.states[-1] == pytest.approx(orbit.states[0], abs=1e-8)
    assert scene.osc.period == pytest.approx(PERIOD, rel=1e-15)
    assert scene.errors.max() < 1e-6


def test_stops_give_back_what_they_take(scene):
    for orbit in (scene.clear_orbit, scene.hammering_orbit):
        work, loss = scene.energy_balance(orbit)
        assert work == pytest.approx(loss, rel=1e-5)
    by_formula = np.pi * 2 * ZETA * OMEGA_N * OMEGA * abs(response()) ** 2
    assert scene.energy_balance(scene.clear_orbit)[1] == pytest.approx(by_formula, rel=1e-6)


def test_areas_shrink_with_the_damping(scene):
    for derivative in scene.derivatives.values():
        assert np.linalg.det(derivative) == pytest.approx(np.exp(-2 * ZETA * OMEGA_N * PERIOD), rel=1e-6)


def test_multipliers_of_the_clear_motion(scene):
    multiplier = np.exp(OMEGA_N * (-ZETA + 1j * np.sqrt(1 - ZETA**2)) * PERIOD)
    found = np.sort_complex(np.linalg.eigvals(scene.derivatives["clear-running"]))
    assert found == pytest.approx(np.sort_complex([multiplier, multiplier.conjugate()]), abs=1e-7)
    assert np.abs(np.linalg.eigvals(scene.derivatives["hammering"])).max() < 1


def test_divergence_and_numbers(scene):
    symbols = scene.osc.model.symbols
    assert scene.divergence == -2 * symbols["damping_ratio"] * symbols["natural_frequency"]
    assert scene.osc.parameters["excitations.0.amplitude"] == F0
    assert scene.gentler.parameters["excitations.0.amplitude"] == 0.1


def test_noise_makes_it_jump(scene):
    assert 0 < scene.jump < 80
    with_stops = scene.noisy.x[scene.noisy.t > scene.jump * PERIOD]
    assert with_stops.max() > 0.5


def test_pictures_of_the_scene(scene):
    assert_pictures(scene, 2)
    legend = scene.figures[0].get_axes()[0].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["clear-running", "hammering", "stop"]


# -- 02: a contact law ------------------------------------------------------------------------------------------------


def exact_restitution(product):
    """Speed after over speed before, for c v = `product`: from v dv/dδ = −k δ^(3/2) (1 + (3/2) c v), integrated."""
    a = 1.5 * product
    before = a - np.log1p(a)
    return brentq(lambda e: -a * e - np.log1p(-a * e) - before, 0.0, min(1.0, (1 - 1e-12) / a), xtol=1e-14)


def test_all_ways_are_one_motion(law):
    assert {"formula", "class"} <= set(law.ends)
    for states in law.ends.values():
        np.testing.assert_allclose(states, law.ends["formula"], rtol=0, atol=1e-13)


def test_plug_in_is_used_where_it_is_installed(law):
    if "plug-in" not in law.scenes:
        pytest.skip("vibrokit-hunt-crossley is not installed")
    assert type(law.scenes["plug-in"].barriers[0].law).__module__.startswith("vibrokit_hunt_crossley")


def test_lines_shown_are_those_of_the_plug_in(law):
    shown = tomllib.loads(law.PYPROJECT)["project"]
    project = REPOSITORY / "plugins/vibrokit-hunt-crossley/pyproject.toml"
    if not project.exists():
        pytest.skip("the plug-in is not in this tree")
    real = tomllib.loads(project.read_text(encoding="utf-8"))["project"]
    assert (shown["name"], shown["entry-points"]) == (real["name"], real["entry-points"])


def test_restitution(law):
    for product, measured in law.table.items():
        assert measured == pytest.approx(exact_restitution(product), rel=1e-6)
        assert law.exact_restitution(product) == pytest.approx(exact_restitution(product), rel=1e-10)
    first_order = (1 - law.table[0.01]) / 0.01
    assert first_order == pytest.approx(1.0, abs=0.02)


def test_energy_lost_in_a_bounce(law):
    """The last loop is that of c v = 0.4."""
    assert law.area == pytest.approx((1 - exact_restitution(0.4) ** 2) / 2, rel=1e-5)


def test_the_kit_passes_the_law(law):
    assert law.report.passed
    assert len(law.report.outcomes) > 10


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        ("a negative stiffness", ("ParameterError", "stiffness must be", "at least 0", "got -50")),
        ("a dissipation that is not a number", ("ParameterError", "dissipation must be", "got nan")),
        ("a misspelt name", ("FormulaError", "'rat'", "'rate'")),
        ("a formula with code", ("FormulaError", "__import__")),
        ("a law with a force at rest", ("ConformanceError", "at rest")),
    ],
)
def test_what_is_said_of_mistakes(law, mistake, words):
    assert all(word in law.messages[mistake] for word in words)


def test_a_formula_runs_no_code(law, capfd):
    with pytest.raises(ValueError, match="refused"):
        law.mistakes["a formula with code"]()
    assert "hi" not in capfd.readouterr().out


def test_picture_of_the_bounce(law):
    assert_pictures(law, 1)


# -- 03: without noise ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def quiet(run):
    return run("03_without_noise")


def test_states_and_saddle_without_noise(quiet):
    expected = [F1 / OMEGA_N**2 + response().real, (1j * OMEGA * response()).real]
    assert quiet.clear.points[0] == pytest.approx(expected, abs=1e-10)
    assert [dict(a.hits) for a in quiet.structure.attractors] == [{"right": 0, "left": 0}, {"right": 2, "left": 0}]
    shrinking = np.exp(-2 * ZETA * OMEGA_N * PERIOD)  # Liouville
    assert quiet.products == pytest.approx([shrinking] * 3, rel=1e-8)
    assert quiet.saddle.leads_to in ((0, 1), (1, 0))


def test_the_saddle_is_a_fixed_point_of_the_map(quiet):
    point = quiet.saddle.points[0]
    assert quiet.osc.section_map(point[None], 1, stepper=vk.Order8(1e-12))[0] == pytest.approx(point, abs=1e-9)


def test_no_kick_in_velocity_alone_is_smaller_than_the_smallest(quiet):
    for stability in quiet.stability:
        assert stability.velocity_kick.size >= stability.any_kick.size - stability.any_kick.error


def test_where_the_clear_motion_grazes(quiet):
    def gap(frequency):
        swing = F0 / np.sqrt((OMEGA_N**2 - frequency**2) ** 2 + (2 * ZETA * OMEGA_N * frequency) ** 2)
        return 0.5 - F1 / OMEGA_N**2 - swing

    grazing = [b for b in quiet.sweep.bifurcations if b.kind == "grazing" and b.side == "right"]
    assert min(abs(b.value - brentq(gap, 0.57, 0.65, xtol=1e-14)) for b in grazing) < 1e-9
    assert quiet.grazing == pytest.approx(brentq(gap, 0.57, 0.65, xtol=1e-14), abs=1e-9)


def test_pictures_of_the_structure(quiet):
    assert_pictures(quiet, 4)


# -- 06: exit times ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def exits(run):
    return run("06_exit_times")


def test_rates_of_simulated_exits_are_those_of_kramers(exits):
    """The error of the formula is less than its whole correction, 10 % of the rate at the largest intensity."""
    for rate in (*exits.direct.rates, exits.rare):
        prefactor = (np.sqrt(1.04) - 0.2) / (np.sqrt(2) * np.pi)
        assert abs(rate.log_value - np.log(prefactor) + 0.2 / rate.intensity) < 3 * rate.log_error + 0.15
        by_formula, formula_error = exits.kramers(rate.intensity)
        assert abs(rate.log_value - by_formula) < 3 * rate.log_error + formula_error
        assert abs(by_formula - double_well_rate(0.2, rate.intensity)) < formula_error
    assert [rate.method for rate in exits.direct.rates] == ["direct"] * 3


def test_exit_times_follow_an_exponential_law(exits):
    assert min(exits.p_values) > 1e-3
    assert exits.remaining == pytest.approx(np.exp(-1), abs=3 * np.sqrt(np.exp(-1) / 500))
    assert not exits.direct.found(Code.NOT_EXPONENTIAL)


def test_slope_of_the_exit_times_is_the_barrier(exits):
    assert exits.energy.lower <= 0.2 <= exits.energy.upper
    assert abs(exits.fit.slope - 0.2) < 3 * exits.fit.slope_error + 0.01  # the prefactor's part


def test_splitting_is_as_exact_as_wanted_and_cheaper(exits):
    assert exits.rare.method == "splitting"
    assert exits.rare.log_error <= 0.15
    assert exits.split.stats.steps < 1e-2 * exits.waiting


def test_exit_times_of_the_clear_state(exits):
    """Of 20 000 simulated trajectories, with standard errors of 0.004 and 0.007."""
    for rate, found, expected in zip(exits.forced.rates, exits.log_periods, (4.304, 6.492), strict=True):
        assert abs(found - expected) < 3 * np.hypot(rate.log_error, 0.007)
    fit = exits.forced.arrhenius("clear")
    assert abs(fit.slope - (6.492 - 4.304) / (1 / 2e-5 - 1 / 5e-5)) < 3 * fit.slope_error
    assert len(exits.forced.found(Code.NOT_METASTABLE)) == 1  # at the larger intensity, so that there is no energy
    assert not exits.forced.energies


def test_pictures_of_the_exit_times(exits):
    assert_pictures(exits, 4)


# -- 07: a machine ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def machine(run):
    return run("07_a_machine")


def test_the_ball_runs_clear_as_a_linear_oscillator(machine):
    rate, drive = 2 * np.pi * 40, 2 * np.pi * 50
    amplitude = 3.0 / np.sqrt((rate**2 - drive**2) ** 2 + (2 * 0.05 * rate * drive) ** 2)
    assert np.ptp(machine.clear.orbit[:, 0]) / 2 == pytest.approx(amplitude, rel=1e-4)
    rates = -0.05 * rate + 1j * rate * np.sqrt(1 - 0.05**2) * np.array([1, -1])
    found = machine.clear.multipliers
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(np.exp(rates / 50)), rtol=1e-8)


def test_hammering_is_symmetric_and_its_impacts_are_those_of_hertz(machine):
    """A free mass of speed v is in contact for 2 ∫ dδ/√(v² − (4/5) k δ^(5/2)), from 0 to the largest depth."""
    force, other = (machine.hammering.peak_force[side] for side in ("right", "left"))
    assert force == pytest.approx(other, rel=1e-6)
    assert force == pytest.approx(machine.stiffness * machine.depth**1.5, rel=1e-9)
    whole = 2 * quad(lambda share: 1 / np.sqrt(1 - share**2.5), 0, 1)[0]
    assert machine.duration == pytest.approx(whole * machine.depth / machine.speed, rel=1e-4)
    assert machine.hammering.hits == {"right": 1, "left": 1}


def test_units_decide_two_sums_of_sensitivities(machine):
    """ΔU is in m² s⁻³, so that Euler's theorem on homogeneous functions gives two sums exactly."""
    assert machine.by_length == pytest.approx(2.0, abs=1e-5)
    assert machine.by_time == pytest.approx(3.0, abs=1e-5)


def test_simulated_exits_of_the_machine_agree_with_its_energy(machine):
    """The factor before the exponential is some periods: neither a thousandth of one nor a thousand of them."""
    assert machine.energy.certificate is not None
    assert 0.1 < machine.prefactor / machine.osc.period < 100


def test_pictures_of_the_machine(machine):
    assert_pictures(machine, 2)

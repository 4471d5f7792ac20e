"""Sensitivities of activation energies: closed forms, laws of scaling, and differences of energies solved for anew."""

import pytest
import sympy

import vibrokit as vk

QUICK = vk.Shooting(points=2000, rounds=6)


def least(osc, source, **analyzer):
    structure = vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)
    result = vk.LeastAction(source=source, graph=None, shooting=QUICK, **analyzer).run(osc, structure)
    return min(result.energies, key=lambda energy: energy.value)


def check(energy, exact, rel=1e-6):
    """Every derivative that a closed form gives; all others are 0."""
    assert set(exact) <= set(energy.sensitivity) == set(energy.sensitivity_error)
    for name, found in energy.sensitivity.items():
        wanted = float(exact.get(name, 0.0))
        assert found == pytest.approx(wanted, rel=rel, abs=1e-7 * energy.value), name


def test_a_tilted_double_well_without_forcing():
    """ΔU = 4ζω_n (V_saddle − V_well), V = −F x + a x²/2 + b x⁴/4; the places of both are stationary."""
    a, b, push, zeta, natural = -1.0, 1.0, 0.1, 0.2, 1.3
    osc = vk.Oscillator(
        natural_frequency=natural, damping_ratio=zeta, spring=vk.CubicSpring(a, b), excitations=(vk.Constant(push),),
        noise=vk.WhiteNoise(1e-3),
    )  # fmt: skip
    x = sympy.Symbol("x", real=True)
    well, saddle, _ = sorted(float(root) for root in sympy.Poly(a * x + b * x**3 - push).nroots())
    rate = 4 * zeta * natural
    energy = least(osc, "left-rest")

    def potential(place):
        return a * place**2 / 2 + b * place**4 / 4 - push * place

    assert energy.value == pytest.approx(rate * (potential(saddle) - potential(well)), rel=1e-6)
    check(
        energy,
        {
            "natural_frequency": energy.value / natural,
            "damping_ratio": energy.value / zeta,
            "spring.linear": rate * (saddle**2 - well**2) / 2,
            "spring.cubic": rate * (saddle**4 - well**4) / 4,
            "excitations.0.force": -rate * (saddle - well),
        },
    )


@pytest.mark.slow
def test_the_first_contact_of_a_forced_linear_oscillator():
    """ΔU = 2ζω_n³ (b − max x)², on a face that moves with the stop."""
    values = {
        "natural_frequency": 1.0, "damping_ratio": 0.1, "barriers.0.position": 0.5, "excitations.0.amplitude": 0.1,
        "excitations.0.frequency": 0.57, "excitations.1.force": 0.05,
    }  # fmt: skip
    n, zeta, b, amplitude, w, push = symbols = sympy.symbols("n zeta b amplitude w push", positive=True)
    response = amplitude / sympy.sqrt((n**2 - w**2) ** 2 + (2 * zeta * n * w) ** 2) + push / n**2
    action = 2 * zeta * n**3 * (b - response) ** 2
    at = dict(zip(symbols, values.values(), strict=True))
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.1, barriers=(vk.Barrier(vk.Hertz(50.0), 0.5, "right"),),
        excitations=(vk.Harmonic(0.1, 0.57), vk.Constant(0.05)), noise=vk.WhiteNoise(1e-3),
    )  # fmt: skip
    energy = least(osc, "clear", exit=vk.FirstContact())
    assert energy.value == pytest.approx(float(action.subs(at)), rel=1e-6)
    check(
        energy,
        {name: action.diff(symbol).subs(at) for name, symbol in zip(values, symbols, strict=True)},
        rel=1e-5,
    )


@pytest.mark.long
def test_a_scene_given_by_stiffness_and_damping():
    """ΔU = cκ (b − f/κ)², the energy above with κ = ω_n² and c = 2ζω_n, by the numbers that the scene has."""
    stiffness, c, b, push = 1.7, 0.3, 0.5, 0.1
    osc = vk.Oscillator(
        stiffness=stiffness, damping=c, barriers=(vk.Barrier(vk.Hertz(50.0), b, "right"),),
        excitations=(vk.Constant(push),), noise=vk.WhiteNoise(1e-3),
    )  # fmt: skip
    energy, gap = least(osc, "rest", exit=vk.FirstContact()), b - push / stiffness
    assert energy.value == pytest.approx(c * stiffness * gap**2, rel=1e-9)
    check(
        energy,
        {
            "stiffness": c * gap**2 + 2 * c * gap * push / stiffness,
            "damping": stiffness * gap**2,
            "barriers.0.position": 2 * c * stiffness * gap,
            "excitations.0.force": -2 * c * gap,
        },
    )


@pytest.fixture(scope="module")
def hertz():
    osc = vk.load_scene("hertz-0.570")
    return osc, least(osc, "clear")


@pytest.mark.slow
def test_units_of_length_and_of_time_change_the_energy_of_the_paper_as_they_must(hertz):
    """Other units change parameters and ΔU (m² s⁻³) by known powers (Euler's theorem), and so does a shift."""
    osc, energy = hertz
    elastic = {name: value * energy.sensitivity[name] for name, value in osc.parameters.items()}
    time = {
        "natural_frequency": 1, "excitations.0.frequency": 1, "excitations.0.amplitude": 2, "excitations.1.force": 2,
        "barriers.0.law.stiffness": 2, "barriers.1.law.stiffness": 2,
    }  # fmt: skip
    length = {
        "barriers.0.position": 1, "barriers.1.position": 1, "excitations.0.amplitude": 1, "excitations.1.force": 1,
        "barriers.0.law.stiffness": -0.5, "barriers.1.law.stiffness": -0.5,
    }  # fmt: skip
    assert sum(power * elastic[name] for name, power in time.items()) == pytest.approx(3 * energy.value, rel=1e-6)
    assert sum(power * elastic[name] for name, power in length.items()) == pytest.approx(2 * energy.value, rel=1e-6)
    shift = ("barriers.0.position", "barriers.1.position", "excitations.1.force")  # ω_n = 1: x + s needs a force ω_n² s
    assert sum(energy.sensitivity[name] for name in shift) == pytest.approx(0, abs=1e-6 * energy.value)
    assert energy.sensitivity["excitations.0.phase"] == pytest.approx(0, abs=1e-5 * energy.value)


@pytest.mark.long
@pytest.mark.parametrize("name", ["excitations.0.frequency", "barriers.0.law.stiffness", "damping_ratio"])
def test_differences_of_energies_solved_for_anew(hertz, name):
    """Central differences of two sizes, extrapolated; the energies are solved for from the search on."""
    osc, energy = hertz
    value = osc.parameters[name]

    def slope(step):
        ends = [least(osc.replace({name: value + side * step}), "clear").value for side in (1, -1)]
        return (ends[0] - ends[1]) / (2 * step)

    step = 5e-4 * value
    anew = (4 * slope(step) - slope(2 * step)) / 3
    assert energy.sensitivity[name] == pytest.approx(anew, rel=1e-5)

"""Coefficients of restitution: closed forms of spring and dash-pot, and of the family k δⁿ (1 + a δ′/v)."""

import math

import mpmath
import pytest

import vibrokit as vk
from vibrokit.errors import ArgumentError, ParameterError
from vibrokit.parts.restitution import damping_of_rebound, rebound_of_damping

ADHESIVE = {0.3: 0.357857, 0.5: 0.215454, 0.75: 0.091191, 0.8: 0.070850, 0.9: 0.033518, 0.95: 0.016325}
CLIPPED = {0.3: 0.497239, 0.5: 0.255276, 0.75: 0.097158, 0.8: 0.074355, 0.9: 0.034265, 0.95: 0.016498}


@pytest.mark.parametrize(("table", "adhesive"), [(ADHESIVE, True), (CLIPPED, False)], ids=["adhesive", "clipped"])
def test_damping_ratio_of_a_restitution(table, adhesive):
    """Closed forms of δ″ + 2ζδ′ + δ = 0, also in mujoco issue #2080 and LAMMPS pull request #4068."""
    for e, ratio in table.items():
        law = vk.KelvinVoigt.from_restitution(e, stiffness=1e6, adhesive=adhesive)
        assert law.stiffness == 1e6
        assert law.damping / 2e3 == pytest.approx(ratio, abs=6e-7)
        assert law.rebound(adhesive) == pytest.approx(e, rel=1e-14)


def test_one_dash_pot_has_two_restitutions():
    law = vk.KelvinVoigt(stiffness=1.0, damping=2 * 0.091191)
    assert law.rebound(adhesive=True) == pytest.approx(0.7500, abs=5e-5)
    assert law.rebound() == pytest.approx(0.7626, abs=5e-5)


def test_overdamped_stops_are_those_of_the_literature_formula_continued():
    """With s = √(1 − ζ²), e = exp(−(ζ/s)(π − atan2(2ζs, 1 − 2ζ²))); for ζ > 1 from the two real exponents."""
    for ratio in (1e-9, 0.1, 0.7, 0.99):
        s = math.sqrt(1 - ratio**2)
        published = math.exp(-ratio / s * (math.pi - math.atan2(2 * ratio * s, 1 - 2 * ratio**2)))
        assert vk.KelvinVoigt(1.0, 2 * ratio).rebound() == pytest.approx(published, rel=1e-13)
    assert vk.KelvinVoigt(1.0, 2.0).rebound() == math.exp(-2)  # at t = 2, of δ = t e^(−t)
    for ratio in (1.01, 2.0, 30.0):
        slow, fast = -ratio + math.sqrt(ratio**2 - 1), -ratio - math.sqrt(ratio**2 - 1)
        time = 2 * math.log(fast / slow) / (slow - fast)  # where slow² e^(slow t) = fast² e^(fast t)
        speed = (slow * math.exp(slow * time) - fast * math.exp(fast * time)) / (slow - fast)
        assert vk.KelvinVoigt(1.0, 2 * ratio).rebound() == pytest.approx(-speed, rel=1e-10)
        assert vk.KelvinVoigt(1.0, 2 * ratio).rebound(adhesive=True) == 0


@pytest.mark.parametrize("e", [1.0, 1 - 2**-53, 0.2, math.exp(-2), 0.1, 1e-5, 1e-300, 5e-324])
@pytest.mark.parametrize("adhesive", [True, False])
def test_every_restitution_has_its_dash_pot(e, adhesive):
    law = vk.KelvinVoigt.from_restitution(e, 4.0, adhesive)
    # The exponent has an error of some units in its last place.
    assert law.rebound(adhesive) == pytest.approx(e, rel=1e-15 * (4 - 4 * math.log(e)))
    assert (law.damping == 0) == (e == 1)


@pytest.mark.slow
@pytest.mark.parametrize(("e", "adhesive"), [(0.75, True), (0.75, False), (0.1, False)])
def test_a_mass_comes_back_as_asked(e, adhesive):
    law = vk.KelvinVoigt.from_restitution(e, 1e4, adhesive)
    free = vk.Oscillator(stiffness=0.0, damping=0.0, barriers=[vk.Barrier(law, 0.0, "right", adhesive)])
    path = free.trajectory((0.0, 0.5), duration=0.5, samples=2, stepper=vk.Order8(tolerance=1e-12))
    assert path.v[-1] == pytest.approx(-0.5 * e, rel=1e-9)


@pytest.mark.parametrize("damping", [1e-6, 0.15, 0.75, 1.4, 3.0, 60.0])
def test_rebound_of_hysteresis_damping_by_the_function_of_lambert(damping):
    """a − ln(1 + a) = −a e − ln(1 − a e) is s e^(−s) = (1 + a) e^(−(1 + a)) for s = 1 − a e."""
    with mpmath.workdps(40):
        a = mpmath.mpf(damping)
        e = float((1 + mpmath.lambertw(-(1 + a) * mpmath.exp(-1 - a))) / a)
    assert rebound_of_damping(damping) == pytest.approx(e, rel=1e-14)
    assert damping_of_rebound(e) == pytest.approx(damping, abs=1e-15 * damping + 1e-14)


@pytest.mark.parametrize("e", [1.0, 0.999999, 0.5231, 0.5232, 0.5, 1e-3, 1e-300])
def test_every_restitution_has_its_hysteresis_damping(e):
    assert rebound_of_damping(damping_of_rebound(e)) == pytest.approx(e, rel=1e-14)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((0.0, 1.0), "KelvinVoigt.from_restitution: e must be a finite number greater than 0 and at most 1, got 0."),
        ((1.1, 1.0), "KelvinVoigt.from_restitution: e must be .* and at most 1, got 1.1."),
        ((math.nan, 1.0), "e must be .* and at most 1, got nan."),
        (("0.5", 1.0), "e must be .* and at most 1, got '0.5'."),
        ((0.5, 0.0), "KelvinVoigt.from_restitution: stiffness must be a finite number greater than 0, got 0."),
        ((0.5, -1.0), "stiffness must be a finite number greater than 0, got -1."),
        ((0.5, 1.0, "yes"), "KelvinVoigt.from_restitution: adhesive must be True or False, got 'yes'."),
        ((5e-324, 1e300), "KelvinVoigt: damping must be a finite number at least 0, got inf."),
    ],
    ids=str,
)
def test_what_is_no_restitution_is_refused(arguments, said):
    with pytest.raises(ParameterError, match=said):
        vk.KelvinVoigt.from_restitution(*arguments)


def test_a_missing_stiffness_is_named():
    with pytest.raises(ArgumentError, match="from_restitution needs a value of stiffness"):
        vk.KelvinVoigt.from_restitution(0.5)

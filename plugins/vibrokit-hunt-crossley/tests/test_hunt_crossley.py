"""The plug-in's law: what Hunt & Crossley's theory says of a bounce, and that it conforms."""

import math

import pytest
from scipy.optimize import brentq
from vibrokit_hunt_crossley import HuntCrossley

import vibrokit as vk
from vibrokit.errors import ParameterError
from vibrokit.testing import contact_law_checks

SCENE = """
natural_frequency = 1.0
damping_ratio = 0.01
[[barriers]]
law = { name = "hunt-crossley", stiffness = 50.0, dissipation = 0.2 }
position = 0.5
side = "right"
[[excitations]]
name = "harmonic"
amplitude = 0.18
frequency = 0.57
"""


def speed_after(law, speed, side="right"):
    """Speed at which a free mass leaves the stop that it hit at `speed`."""
    sign = 1.0 if side == "right" else -1.0
    free = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.0,
        spring=vk.CubicSpring(linear=0.0, cubic=0.0),
        barriers=(vk.Barrier(law, position=0.0, side=side),),
    )
    path = free.trajectory((0.0, sign * speed), duration=3.0, stepper=vk.RK4(steps=40000))
    assert sign * path.x[-1] < 0
    return -sign * float(path.v[-1])


def exact_speed_after(dissipation, speed):
    """Solve a v − ln(1 + a v) = −a w − ln(1 − a w), a = 3/2 c, for w: the equation of motion over the whole contact.

    With u = δ′, u du/dδ = −k δⁿ (1 + a u); k and n drop out between touching and leaving.
    """
    a = 1.5 * dissipation
    entered = a * speed - math.log1p(a * speed)
    return brentq(lambda w: -a * w - math.log1p(-a * w) - entered, 0.0, (1 - 1e-15) / a, xtol=1e-15)


@pytest.mark.parametrize("check", [pytest.param(make, id=name) for name, make in contact_law_checks(HuntCrossley)])
def test_conforms(check):
    check()


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("side", ["right", "left"])
def test_bounce_as_the_equation_of_motion_says(exponent, side):
    for dissipation, speed in ((0.2, 0.5), (1.0, 1.0), (3.0, 2.0)):
        law = HuntCrossley(stiffness=50.0, dissipation=dissipation, exponent=exponent)
        assert speed_after(law, speed, side) == pytest.approx(exact_speed_after(dissipation, speed), rel=1e-6)


def test_restitution_at_three_speeds():
    """Of (1 + a)/(1 − a e) = exp(a (1 + e)) with a = 3/2 c v, for c v = 0.1, 0.2 and 0.5."""
    law = HuntCrossley(stiffness=50.0, dissipation=0.2)
    for speed, e in ((0.5, 0.909016), (1.0, 0.832870), (2.5, 0.662962)):
        assert law.rebound(speed) == pytest.approx(e, abs=6e-7)
        assert law.rebound(speed) == pytest.approx(exact_speed_after(0.2, speed) / speed, rel=1e-12)
        again = HuntCrossley.from_restitution(law.rebound(speed), 50.0, speed)
        assert again.dissipation == pytest.approx(0.2, rel=1e-13)
    assert HuntCrossley(0.0, 0.2).rebound(1.0) == 0


@pytest.mark.parametrize(("e", "speed", "exponent"), [(1.0, 1.0, 1.5), (0.8, 0.5, 1.5), (0.1, 2.0, 2.0)])
def test_a_mass_comes_back_as_asked(e, speed, exponent):
    law = HuntCrossley.from_restitution(e, 50.0, speed, exponent)
    assert (law.stiffness, law.exponent) == (50.0, exponent)
    assert speed_after(law, speed) == pytest.approx(e * speed, rel=1e-6)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((0.0, 50.0, 1.0), "e must be a finite number greater than 0 and at most 1, got 0."),
        ((1.5, 50.0, 1.0), "e must be .* at most 1, got 1.5."),
        ((0.5, 0.0, 1.0), "stiffness must be a finite number greater than 0, got 0."),
        ((0.5, 50.0, 0.0), "speed must be a finite number greater than 0, got 0."),
    ],
    ids=str,
)
def test_what_is_no_restitution_is_refused(arguments, said):
    with pytest.raises(ParameterError, match=f"HuntCrossley.from_restitution: {said}"):
        HuntCrossley.from_restitution(*arguments)


def test_energy_is_lost_and_more_of_it_at_higher_speed():
    law = HuntCrossley(stiffness=50.0, dissipation=0.5)
    restitution = [speed_after(law, speed) / speed for speed in (0.1, 0.3, 1.0, 3.0)]
    assert 1 > restitution[0] > restitution[1] > restitution[2] > restitution[3] > 0


def test_slow_bounces_end_as_hunt_and_crossley_say():
    c = 0.4
    for speed in (0.02, 0.04, 0.08):
        lost = 1 - speed_after(HuntCrossley(stiffness=50.0, dissipation=c), speed) / speed
        assert lost == pytest.approx(c * speed, rel=1.5 * c * speed)  # to first order


def test_without_dissipation_it_is_hertz():
    assert speed_after(HuntCrossley(stiffness=50.0, dissipation=0.0), 0.7) == pytest.approx(0.7, rel=1e-7)
    hertz, law = vk.Hertz(stiffness=50.0), HuntCrossley(stiffness=50.0, dissipation=0.0)
    ends = [
        vk.Oscillator(
            natural_frequency=1.0, damping_ratio=0.01, barriers=(vk.Barrier(one, position=0.1, side="right"),)
        ).section_map([[0.0, 0.4]])
        for one in (hertz, law)
    ]
    assert ends[0] == pytest.approx(ends[1], rel=1e-12)


def test_derived_properties():
    contact = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.01,
        barriers=(vk.Barrier(HuntCrossley(stiffness=50.0, dissipation=0.2), position=0.1, side="right"),),
    ).model.contacts[0]
    assert not contact.conservative
    assert not contact.jumps
    assert contact.clamped
    assert contact.root == 2
    assert float(contact.exponent) == 1.5


def test_usable_by_name(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    osc = vk.load_scene(path)
    assert osc.barriers[0].law == HuntCrossley(stiffness=50.0, dissipation=0.2)
    vk.save_scene(osc, tmp_path / "again.toml")
    assert vk.load_scene(tmp_path / "again.toml") == osc
    assert osc.replace({"barriers.0.law.dissipation": 0.3}).barriers[0].law.dissipation == 0.3


@pytest.mark.parametrize(
    "wrong",
    [{"stiffness": -1.0}, {"dissipation": -0.1}, {"exponent": 0.0}, {"exponent": "1.5"}, {"stiffness": math.nan}],
)
def test_wrong_values_are_refused(wrong):
    (name,) = wrong
    with pytest.raises(ParameterError, match=f"HuntCrossley: {name} must be a finite number.*, got "):
        HuntCrossley(**({"stiffness": 50.0, "dissipation": 0.2} | wrong))

"""Published laws: the restitution that each really has, against impacts that SciPy and the toolkit integrate."""

import math
import re

import mpmath
import pytest
from scipy.integrate import solve_ivp
from vibrokit_contact_laws import (
    Flores,
    Gonthier,
    HerbertMcWhannell,
    HuGuo,
    KuwabaraKono,
    LankaraniNikravesh,
    LeeWang,
    ZhiyingQishao,
)

import vibrokit as vk
from vibrokit.errors import ParameterError
from vibrokit.testing import contact_law_checks

# Nominal restitution → what the law rebounds with, and the least it can have; by the function of Lambert.
NOMINAL = (0.9, 0.7, 0.5, 0.3)
LAWS = {
    HerbertMcWhannell: ("herbert-mcwhannell", lambda e: 6 * (1 - e) / ((2 * e - 1) ** 2 + 3)),
    LeeWang: ("lee-wang", lambda e: 0.75 * (1 - e)),
    LankaraniNikravesh: ("lankarani-nikravesh", lambda e: 0.75 * (1 - e**2)),
    Gonthier: ("gonthier", lambda e: (1 - e**2) / e),
    ZhiyingQishao: ("zhiying-qishao", lambda e: 0.75 * (1 - e**2) * mpmath.exp(2 - 2 * e)),
    Flores: ("flores", lambda e: 1.6 * (1 - e) / e),
    HuGuo: ("hu-guo", lambda e: 1.5 * (1 - e) / e),
}
STATED = {
    HerbertMcWhannell: (0.901, 0.723, 0.594, 0.520),
    LeeWang: (0.952, 0.869, 0.799, 0.739),
    LankaraniNikravesh: (0.913, 0.796, 0.725, 0.684),
    Gonthier: (0.876, 0.670, 0.488, 0.304),
    ZhiyingQishao: (0.896, 0.680, 0.483, 0.327),
    Flores: (0.894, 0.683, 0.470, 0.256),
    HuGuo: (0.900, 0.697, 0.488, 0.271),
}
LEAST = {HerbertMcWhannell: 0.488, LeeWang: 0.663, LankaraniNikravesh: 0.663, ZhiyingQishao: 0.179}
NAMES = [name for name, _ in LAWS.values()]


def by_lambert(damping):
    """ε of a − ln(1 + a) = −a ε − ln(1 − a ε): s = 1 − a ε has s e^(−s) = (1 + a) e^(−(1 + a))."""
    with mpmath.workdps(30):
        a = mpmath.mpf(damping)
        return float((1 + mpmath.lambertw(-(1 + a) * mpmath.exp(-1 - a))) / a)


@pytest.mark.parametrize("law", LAWS, ids=NAMES)
def test_rebounds_as_stated(law):
    _, factor = LAWS[law]
    for nominal, stated in zip(NOMINAL, STATED[law], strict=True):
        rebound = law(50.0, nominal, 0.5).rebound()
        assert rebound == pytest.approx(by_lambert(factor(nominal)), rel=1e-12)
        assert rebound == pytest.approx(stated, abs=6e-4)
        assert f"{stated:.3f}" in law.__doc__
    assert law(50.0, 0.7, 0.5).rebound(1.0) == pytest.approx(by_lambert(2 * factor(0.7)), rel=1e-12)
    assert law(50.0, 1.0, 0.5).rebound() == 1
    assert law(0.0, 0.7, 0.5).rebound() == 0


def test_half_the_factor_of_hu_and_guo_rebounds_as_stated():
    """What some public programs have."""
    stated = (0.947, 0.823, 0.663, 0.446)
    assert [by_lambert(0.75 * (1 - e) / e) for e in NOMINAL] == pytest.approx(stated, abs=6e-4)
    assert ", ".join(f"{one:.3f}" for one in stated) in HuGuo.__doc__


@pytest.mark.parametrize(("law", "share"), [(Flores, 16 / 15), (Gonthier, 4 / 3), (LeeWang, 1 / 2)])
def test_share_of_the_loss_that_is_lost_near_1(law, share):
    """For small a the loss 1 − ε is 2/3 a, to first order; a law without fault has a = 3/2 (1 − e) there."""
    assert (1 - law(50.0, 1 - 1e-6, 1.0).rebound()) / 1e-6 == pytest.approx(share, rel=1e-5)


@pytest.mark.parametrize("law", [HerbertMcWhannell, LankaraniNikravesh, ZhiyingQishao, HuGuo])
def test_others_lose_what_they_should_near_1(law):
    assert (1 - law(50.0, 1 - 1e-6, 1.0).rebound()) / 1e-6 == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize("law", LAWS, ids=NAMES)
def test_real_restitution_is_as_asked_or_refused(law):
    for e in (1.0, 0.9, 0.7):
        made = law.from_restitution(e, 50.0, 0.5, 2.0)
        assert made.rebound() == pytest.approx(e, rel=1e-13)
        assert (made.stiffness, made.speed, made.exponent) == (50.0, 0.5, 2.0)
    if law not in LEAST:
        assert law.from_restitution(1e-3, 50.0, 0.5).rebound() == pytest.approx(1e-3, rel=1e-12)
        return
    with pytest.raises(ParameterError, match=r"e must be greater than .* tends to 0, got 0.15.") as caught:
        law.from_restitution(0.15, 50.0, 0.5)
    least = float(re.search(r"greater than (\S+),", str(caught.value))[1])
    assert least == pytest.approx(LEAST[law], abs=6e-4)
    assert law.from_restitution(least + 1e-5, 50.0, 0.5).restitution < 0.01


def test_a_restitution_makes_one_force_of_all():
    laws = [law.from_restitution(0.8, 50.0, 0.5) for law in LAWS]
    forces = [float(law.force(0.2, 0.3)) for law in laws]
    assert forces == pytest.approx([forces[0]] * len(forces), rel=1e-13)


@pytest.mark.parametrize(("law", "exponent"), [(Flores, 1.5), (LankaraniNikravesh, 1.0), (ZhiyingQishao, 2.0)])
def test_an_impact_that_scipy_integrates(law, exponent):
    made = law(50.0, 0.6, 0.5, exponent)

    def rates(_, state):
        depth, rate = state
        return rate, -float(made.force(max(depth, 0.0), rate))

    def left(_, state):
        return state[0]

    left.terminal, left.direction = True, -1
    end = solve_ivp(rates, (0, 50), (0.0, 0.5), "DOP853", events=left, rtol=1e-9, atol=1e-12).y_events[0][0]
    assert -end[1] / 0.5 == pytest.approx(made.rebound(), rel=1e-6)


def integrated(law, speed):
    """Restitution of a free mass at speed 1 or so, in depth and rate, with release where the force becomes 0."""

    def rates(_, state):
        depth, rate = state
        root = math.sqrt(max(depth, 0.0))
        return rate, -root * (law.stiffness * depth + law.dissipation * rate)

    def push(time, state):
        return law.stiffness * state[0] + law.dissipation * state[1] if time else 1.0

    push.terminal = True
    ends = solve_ivp(rates, (0, 50), (0.0, speed), "Radau", events=push, rtol=1e-9, atol=1e-13).y_events[0]
    return -ends[0][1] / speed


@pytest.mark.parametrize("dissipation", [0.05, 1.0, 20.0])
def test_viscoelastic_rebound_is_that_of_the_equation_of_motion(dissipation):
    law = KuwabaraKono(2.0, dissipation)
    assert law.rebound(0.7) == pytest.approx(integrated(law, 0.7), rel=1e-5)


@pytest.mark.parametrize("damping", [1e-5, 1e-4, 1e-3])
def test_viscoelastic_rebound_is_the_series_for_small_damping(damping):
    """1 − C b + 3/5 C² b² + O(b^(5/2)), the coefficient of the last about 0.27 (Schwager and Pöschel 2008)."""
    c = 0.8 * 1.25**0.6 * math.gamma(0.6) * math.gamma(1.5) / math.gamma(2.1)
    e = KuwabaraKono(1.0, damping).rebound(1.0)
    assert abs(e - (1 - c * damping + 0.6 * (c * damping) ** 2)) < damping**2.5 + 1e-12


def test_viscoelastic_rebound_tends_to_its_limit_for_large_damping():
    """The mass stops at depth (3/2/b)^(2/3), in units, and is let go of at the speed depth/b."""
    for damping in (1e4, 1e8, 1e16):
        limit = 1.5 ** (2 / 3) * damping ** (-5 / 3)
        assert KuwabaraKono(1.0, damping).rebound(1.0) == pytest.approx(limit, rel=40 * damping ** (-5 / 3) + 1e-11)


@pytest.mark.parametrize("e", [1.0, 1 - 1e-15, 1 - 1e-9, 0.8, 0.3, 1e-3, 1e-12, 1e-100])
def test_viscoelastic_restitution_as_asked(e):
    law = KuwabaraKono.from_restitution(e, 50.0, 0.7)
    assert law.rebound(0.7) == pytest.approx(e, rel=1e-11)
    # It depends on c v^(1/5) alone.
    assert KuwabaraKono(50.0, law.dissipation * 2**0.2).rebound(0.35) == pytest.approx(e, rel=1e-11)


def test_viscoelastic_stop_without_stiffness_or_dissipation():
    assert KuwabaraKono(0.0, 1.0).rebound(1.0) == 0
    assert KuwabaraKono(2.0, 0.0).rebound(1.0) == pytest.approx(1, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "law",
    [Flores.from_restitution(0.6, 50.0, 0.7), KuwabaraKono.from_restitution(0.6, 50.0, 0.7)],
    ids=["flores", "kuwabara-kono"],
)
def test_a_mass_comes_back_as_asked(law):
    free = vk.Oscillator(stiffness=0.0, damping=0.0, barriers=[vk.Barrier(law, 0.0, "left")])
    path = free.trajectory((0.0, -0.7), duration=3.0, samples=2, stepper=vk.Order8(tolerance=1e-11))
    assert path.v[-1] == pytest.approx(0.6 * 0.7, rel=1e-6)


@pytest.mark.parametrize("law", [*LAWS, KuwabaraKono], ids=[*NAMES, "kuwabara-kono"])
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((0.0, 50.0, 1.0), "e must be a finite number greater than 0 and at most 1, got 0."),
        ((1.5, 50.0, 1.0), "e must be .* at most 1, got 1.5."),
        ((0.9, 0.0, 1.0), "stiffness must be a finite number greater than 0, got 0."),
        ((0.9, 50.0, -1.0), "speed must be a finite number greater than 0, got -1."),
    ],
    ids=str,
)
def test_what_is_no_restitution_is_refused(law, arguments, said):
    with pytest.raises(ParameterError, match=f"{law.__name__}.from_restitution: {said}"):
        law.from_restitution(*arguments)


def test_usable_by_name(tmp_path):
    path = tmp_path / "scene.toml"
    law = '{ name = "hu-guo", stiffness = 50.0, restitution = 0.8, speed = 0.5 }'
    path.write_text(
        f'natural_frequency = 1.0\ndamping_ratio = 0.01\n[[barriers]]\nlaw = {law}\nposition = 0.5\nside = "right"\n'
    )
    osc = vk.load_scene(path)
    assert osc.barriers[0].law == HuGuo(stiffness=50.0, restitution=0.8, speed=0.5)
    assert osc.replace({"barriers.0.law.restitution": 0.7}).barriers[0].law.restitution == 0.7


@pytest.mark.slow
@pytest.mark.parametrize("check", [pytest.param(make, id=name) for name, make in contact_law_checks(ZhiyingQishao)])
def test_conforms(check):
    """The law of the most involved factor; the others are checked with all registered parts."""
    check()

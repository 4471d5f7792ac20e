"""Forces that rise at first touch with an infinite slope: the motion, and which derivatives of it are refused."""

import math

import pytest

import vibrokit as vk
from vibrokit.errors import DerivationError


def contact(formula, *, side="right", adhesive=False, spring=None, **parameters):
    place = 0.5 if side == "right" else -0.5
    stop = vk.Barrier(vk.CustomLaw(formula, **parameters), place, side, adhesive=adhesive)
    return vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, spring=spring, barriers=(stop,))


@pytest.mark.parametrize(
    "formula", ["50*depth**0.2", "9*depth + depth**0.1", "log(1 + depth)**0.2", "depth**0.2*rate**2"]
)
def test_derivatives_under_steeper_forces_than_a_fourth_root_are_refused(formula):
    osc = contact(formula)
    osc.model.drift  # noqa: B018 - the motion itself can be followed
    with pytest.raises(DerivationError, match="fourth root of the depth"):
        osc.model.check_derivatives()


@pytest.mark.parametrize(
    "formula",
    ["50*depth**0.25", "depth**0.3", "depth**1.5 + depth**0.25*rate", "depth**0.5*rate**2 + depth", "sinh(depth)"],
)
def test_others_are_not(formula):
    contact(formula).model.check_derivatives()


def test_a_named_exponent_counts_by_its_value():
    contact("k*depth**n", k=50.0, n=0.25).model.check_derivatives()
    with pytest.raises(DerivationError):
        contact("k*depth**n", k=50.0, n=0.2).model.check_derivatives()


@pytest.mark.parametrize(("formula", "root", "smooth"), [
    ("depth", 1, True), ("depth**1.5", 2, True), ("depth**1.5 + depth**0.25*rate", 4, True), ("depth**0.6", 4, False),
])  # fmt: skip
def test_contacts_are_stepped_in_a_root_in_which_the_force_is_smooth(formula, root, smooth):
    derived = contact(formula).model.contacts[0]
    assert (derived.root, derived.smooth) == (root, smooth)


@pytest.mark.parametrize(("power", "error"), [(0.1, 1e-8), (0.33, 1e-9), (0.5, 1e-9), (0.75, 1e-9)])
def test_a_conservative_stop_keeps_the_energy(power, error):
    """It returns the energy that it took: x² + v² = 1 outside."""
    path = contact(f"50*depth**{power}").trajectory((0.0, 1.0), duration=2.5)
    assert path.x[-1] < 0.5
    assert float(path.x[-1] ** 2 + path.v[-1] ** 2) == pytest.approx(1.0, abs=error)


@pytest.mark.parametrize(
    ("stiffness", "share", "side", "adhesive"),
    [(50.0, 0.2, "right", False), (3e6, 0.05, "left", False), (50.0, 0.2, "right", True)],
)  # fmt: skip
def test_the_restitution_of_the_law_of_tsuji_does_not_depend_on_speed(stiffness, share, side, adhesive):
    """Its damping is c = α √k per unit mass; see Tsuji, Tanaka and Ishida, Powder Technology 71, 239 (1992).

    In s = ⅘ depth^(5/4) and a time τ with ds/dτ = rate it is a linear stop of stiffness 5k/4 and damping c, which has
    the damping ratio z = α/√5. That pulls at last, unless it is cut where it would.
    """
    z = share / math.sqrt(5.0)
    angle = math.pi if adhesive else math.pi - math.atan2(2 * z * math.sqrt(1 - z * z), 1 - 2 * z * z)
    restitution = math.exp(-z / math.sqrt(1 - z * z) * angle)
    osc = contact(
        "k*depth**1.5 + c*depth**0.25*rate", side=side, adhesive=adhesive, spring=vk.LinearSpring(0.0),
        k=stiffness, c=share * math.sqrt(stiffness),
    )  # fmt: skip
    sign = 1.0 if side == "right" else -1.0
    for speed in (0.01, 1.0, 30.0):
        lasts = 4.0 * (speed * speed / stiffness) ** 0.4 / speed
        path = osc.trajectory((sign * 0.5, sign * speed), duration=lasts)
        assert -sign * path.v[-1] / speed == pytest.approx(restitution, abs=2e-9)

"""Forces that rise at first touch more steeply than the root of the depth are refused."""

import pytest

import vibrokit as vk
from vibrokit.errors import DerivationError


def contact(formula, **parameters):
    law = vk.CustomLaw(formula, **parameters)
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, barriers=(vk.Barrier(law, 0.5, "right"),))
    return osc, osc.model.drift


@pytest.mark.parametrize(
    "formula", ["50*depth**0.33", "50*depth**0.1", "9*depth + depth**0.25", "log(1 + depth)**0.3", "depth**0.2*rate**2"]
)
def test_steeper_forces_are_refused(formula):
    with pytest.raises(DerivationError, match="root of the depth"):
        contact(formula)


@pytest.mark.parametrize("formula", ["50*depth**0.5", "depth**0.5*rate**2 + depth", "50*depth**1.3", "50*sinh(depth)"])
def test_others_are_not(formula):
    contact(formula)


def test_a_named_exponent_counts_by_its_value():
    contact("k*depth**n", k=50.0, n=0.5)
    with pytest.raises(DerivationError):
        contact("k*depth**n", k=50.0, n=0.4)


@pytest.mark.parametrize(("power", "error"), [(0.5, 1e-9), (0.75, 1e-7)])
def test_powers_that_are_accepted_keep_the_energy(power, error):
    """A conservative stop returns the energy that it took: x² + v² = 1 outside."""
    osc, _ = contact(f"50*depth**{power}")
    path = osc.trajectory((0.0, 1.0), duration=2.5)
    assert path.x[-1] < 0.5
    assert float(path.x[-1] ** 2 + path.v[-1] ** 2) == pytest.approx(1.0, abs=error)

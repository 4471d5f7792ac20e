"""Without forcing the activation energy is 4ζω_n times the barrier, whatever the damping."""

import pytest

import vibrokit as vk
from tests.layers import long

BARRIER = 0.25  # of −x²/2 + x⁴/4


def double_well(damping):
    osc = vk.load_scene("double-well").replace({"damping_ratio": damping})
    structure = vk.find_structure(osc, cells=(100, 100), starts=(8, 8), saddles=False, manifolds=False)
    assert [a.kind for a in structure.attractors] == ["equilibrium", "equilibrium"]
    assert [a.points[0, 0] for a in structure.attractors] == pytest.approx([-1.0, 1.0], abs=1e-9)
    return osc, structure


@pytest.mark.parametrize("damping", [long(0.02), 0.05, 0.3])
def test_ring_on_the_double_well(damping):
    osc, structure = double_well(damping)
    result = vk.ActionPlot(radius=1e-6, points=4000).run(osc, structure)
    exact = 4 * damping * BARRIER
    assert len(result.energies) == 2
    for energy in result.energies:
        assert energy.value == pytest.approx(exact, rel=0.01)
        assert energy.value >= exact * (1 - 1e-6)  # a path's action bounds the least one from above
        assert energy.target == 1 - energy.source


@pytest.mark.parametrize("damping", [long(0.01), 0.1, 0.5, 1.0])
def test_whole_domain_on_the_double_well(damping):
    """Starts are at 1 % of the exit distance, so the quadratic form costs 1e-6; refinement ends at 1e-4 a round."""
    osc, structure = double_well(damping)
    result = vk.ActionPlot(points=4000, source=1).run(osc, structure)
    (energy,) = result.energies
    exact = 4 * damping * BARRIER
    assert energy.value == pytest.approx(exact, rel=1e-3)
    assert energy.value >= exact * (1 - 1e-5)
    assert energy.value - energy.numerical_error <= exact <= energy.upper


@pytest.mark.long
@pytest.mark.parametrize("damping", [1.5, 2.0])
def test_far_overdamped_the_numerical_error_is_large(damping):
    """Paths cannot be shot through the funnel to the saddle in double precision; the exit found is a costly one."""
    osc, structure = double_well(damping)
    (energy,) = vk.ActionPlot(source=1).run(osc, structure).energies
    exact = 4 * damping * BARRIER
    assert energy.value >= exact
    assert energy.value - energy.numerical_error <= exact

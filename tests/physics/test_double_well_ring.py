"""Without forcing the activation energy is 4ζω_n times the barrier, whatever the damping."""

import pytest

import vibrokit as vk


@pytest.mark.parametrize("damping", [0.02, 0.05, 0.3])
def test_ring_on_the_double_well(damping):
    osc = vk.load_scene("double-well").replace({"damping_ratio": damping})
    structure = vk.find_structure(osc)
    assert [a.kind for a in structure.attractors] == ["equilibrium", "equilibrium"]
    assert [a.points[0, 0] for a in structure.attractors] == pytest.approx([-1.0, 1.0], abs=1e-9)
    result = vk.ActionPlot(points=4000).run(osc, structure)
    exact = 4 * damping * 0.25  # barrier of −x²/2 + x⁴/4 is 1/4
    assert len(result.energies) == 2
    for energy in result.energies:
        assert energy.value == pytest.approx(exact, rel=0.01)
        assert energy.value >= exact * (1 - 1e-6)  # a path's action bounds the least one from above
        assert energy.target == 1 - energy.source

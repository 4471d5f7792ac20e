"""Candidates from reversed relaxation: exact where detailed balance holds, guesses elsewhere, or none."""

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long
from vibrokit.analyzers.paths.reversed_relaxation import reversed_relaxations
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.problem import ExitProblem

WELLS = vk.CubicSpring(-1.0, 1.0)


def scene(damping=0.05, **parts):
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping, **{"spring": WELLS, "noise": vk.WhiteNoise(1e-4), **parts}
    )


def candidates(osc, exits=None, source=0):
    structure = vk.find_structure(osc, cells=(40, 40), starts=(8, 8), manifolds=False, saddles=exits is None)
    problem = ExitProblem(osc, structure, structure.attractors[source], exits or vk.LeaveBasin())
    return reversed_relaxations(problem, SegmentPropagator(problem.scene, vk.Order8(1e-10), 32))


@pytest.mark.parametrize("damping", [0.01, 0.3, 1.5])
def test_a_well_costs_four_zeta_times_its_barrier(damping):
    """ΔU = 4ζ · ¼, by quadrature over the samples."""
    (found,) = candidates(scene(damping))
    assert found.action == pytest.approx(damping, rel=1e-3)
    assert found.target == 1
    # H = p₁v + p₂(acceleration) + ½p₂² is 0 along a path that leaves an equilibrium.
    (x, v), (p1, p2) = found.states.T, found.momenta.T
    hamiltonian = p1 * v + p2 * (x - x**3 - 2 * damping * v) + 0.5 * p2**2
    assert np.abs(hamiltonian).max() < 1e-9


def test_it_ends_at_rest_on_a_face():
    """2ζω³b² for a linear oscillator that starts at rest."""
    osc = scene(
        0.1, spring=None, barriers=(vk.Barrier(vk.Hertz(50.0), 0.5, "right"), vk.Barrier(vk.Hertz(50.0), -0.6, "left"))
    )
    right, left = sorted(candidates(osc, vk.FirstContact()), key=lambda found: found.action)
    assert right.action == pytest.approx(2 * 0.1 * 0.5**2, rel=1e-3)
    assert left.action == pytest.approx(2 * 0.1 * 0.6**2, rel=1e-3)


def test_none_with_forcing():
    assert not candidates(scene(excitations=(vk.Harmonic(0.05, 0.8),), damping=0.1))


@pytest.mark.slow
@pytest.mark.parametrize(("damping", "energy"), [long(1e-3, 1e-3), (1e-2, 1e-2)])
def test_it_is_certified_without_a_search(damping, energy):
    """A graph too coarse to find anything, and no shooting."""
    osc = scene(damping)
    structure = vk.find_structure(osc, cells=(40, 40), starts=(8, 8), manifolds=False)
    analyzer = vk.LeastAction(source=0, shooting=None, graph=vk.GraphSearch(nodes=(32, 32)))
    found = analyzer.run(osc, structure).energy(0, 1)
    assert found.certificate is not None
    assert found.value == pytest.approx(energy, rel=1e-8)
    assert abs(found.value - energy) <= found.numerical_error + 1e-9 * energy


@pytest.mark.long
def test_without_detailed_balance_it_is_a_guess():
    """Damping that grows with x²: the polished path costs another action than the guess, and the search agrees."""
    osc = scene(0.05, spring=vk.CustomSpring("-x + x**3 + c*x**2*v", c=0.3))
    (guess,) = candidates(osc)
    structure = vk.find_structure(osc, cells=(40, 40), starts=(8, 8), manifolds=False)
    searched = vk.ActionPlot(source=0).run(osc, structure).energy(0, 1)
    found = vk.LeastAction(source=0, shooting=None).run(osc, structure).energy(0, 1)
    assert found.value == pytest.approx(searched.value, rel=1e-3)
    assert abs(guess.action - found.value) > 1e-3 * found.value

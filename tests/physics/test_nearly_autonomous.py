"""Weakly nonlinear resonance, where exit paths are nearly a family, against a direct minimization of the action.

The path is the first guess of the minimization, which shares no code with the toolkit (`reference_action`).
"""

import functools

import pytest

import vibrokit as vk
from tests.benchmarks.action_minimized import SAMPLES, model_of
from tests.benchmarks.gallery import SCENES
from tests.layers import long
from tests.physics import reference_action as reference
from tests.physics.reference_guesses import sampled

pytestmark = pytest.mark.slow

DUFFING = ("duffing, hardening", "duffing, weak forcing", "duffing, softening", "duffing, weakly damped")


@functools.cache
def structure_of(name):
    return vk.find_structure(SCENES[name], manifolds=False)


def minimized(osc, structure, energy):
    """The action of the same path after a minimization on grids of its own, with both orbits found anew."""
    model = model_of(osc)
    guess = sampled(model, energy.path, SAMPLES)
    ends = [structure.attractors[energy.source].points[0], structure.saddles[energy.saddle].points[0]]
    source, saddle = ((model.orbit(point), 1) for point in ends)
    return reference.least(guess.extended(source, 4, saddle, 4, SAMPLES))


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("double well, forced", 0),
        long("double well, forced", 1),
        *(long(name, label) for name in DUFFING for label in (0, 1)),
    ],
)
def test_each_state_is_certified_and_its_action_is_least(name, label):
    osc, structure = SCENES[name], structure_of(name)
    result = vk.LeastAction(source=label, graph=None).run(osc, structure)
    energy = result.energy(label, 1 - label)
    assert energy.certificate is not None
    assert energy.residual <= 1e-9
    assert energy.numerical_error <= 1e-5 * energy.value
    found = minimized(osc, structure, energy)
    # Where the manifolds are tangent to rounding, no minimization tells the members of the family apart.
    assert found.minimum or energy.certificate.transversality < 1e-7
    assert found.action == pytest.approx(energy.value, rel=1e-6)


@pytest.mark.long
def test_the_graph_covers_a_scene_from_which_motion_escapes():
    """Of the softening spring a quarter of the region leads to infinity, which is no place for nodes.

    The nodes reach to the saddles from which motion escapes, eight times as costly as the exit that is compared.
    """
    osc, structure = SCENES["duffing, softening"], structure_of("duffing, softening")
    certified = vk.LeastAction(source=1, graph=None).run(osc, structure).energy(1, 0)
    estimate = vk.ActionGraph(source=1, nodes=(200, 200)).run(osc, structure).energy(1, 0)
    assert estimate.value == pytest.approx(certified.value, rel=0.02)
    assert abs(estimate.value - certified.value) <= estimate.numerical_error

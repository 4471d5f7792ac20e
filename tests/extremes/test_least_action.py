"""Least action at the extremes: exact energies where a path is certified, bounds and findings where none is."""

import numpy as np
import pytest

import vibrokit as vk
from tests.extremes.scenes_of_action import damped_wells, first_contact, paper_scene, pressed_wells, tilted_wells
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.codes import Code
from vibrokit.results.energy import Bound
from vibrokit.structure.orbits import refine_orbit
from vibrokit.symbolic.flow_kind import Flow

pytestmark = pytest.mark.slow

EXACT = 1e-6  # relative, of certified energies
CERTIFIED = 1e-9  # residual
SHOOTING = vk.Shooting(points=2000)


def by_name(scenes, *names):
    known = {scene.name: scene for scene in scenes}
    return [pytest.param(known[name], id=name) for name in names]


def structure_of(scene):
    return vk.find_structure(scene.oscillator, region=scene.region, cells=(40, 40), starts=(8, 8), manifolds=False)


def exact_energies(scene, structure):
    """By label; the scene has them by growing x."""
    assert len(structure.attractors) == len(scene.exact)
    by_place = sorted(structure.attractors, key=lambda attractor: attractor.points[0, 0])
    return {attractor.label: exact for attractor, exact in zip(by_place, scene.exact, strict=True)}


MILD = [
    *by_name(damped_wells(), *(f"double well, zeta={z:g}" for z in (0.01, 2.0))),
    *by_name(pressed_wells("hertz"), "pressed well, hertz, k=1, zeta=0.05"),
    *by_name(tilted_wells(), "tilted well, 0.001 from its fold"),
]
GRAZING = by_name(first_contact("hertz"), *(f"first contact, hertz, gap {gap:g}" for gap in (1e-6, 1e-4, 1e-2)))
STIFF = by_name(pressed_wells("hertz"), "pressed well, hertz, k=10000, zeta=0.05")


def energies_of(scene):
    """Energies of the well that is pressed or tilted, each with its exact value, and the result."""
    structure = structure_of(scene)
    exact = exact_energies(scene, structure)
    by_place = sorted(structure.attractors, key=lambda attractor: attractor.points[0, 0])
    well = by_place[-1 if scene.oscillator.barriers else 0]
    graph = vk.GraphSearch(nodes=(64, 64), steps_per_period=8)
    result = vk.LeastAction(source=well.label, shooting=SHOOTING, graph=graph).run(scene.oscillator, structure)
    assert {energy.source for energy in result.energies} == {well.label}
    return [(energy, exact[energy.source]) for energy in result.energies], result


def check_certified(energy, exact):
    assert energy.residual <= CERTIFIED
    assert energy.value == pytest.approx(exact, rel=EXACT)
    check_bounds(energy, exact)


def check_bounds(energy, exact):
    assert energy.lower * (1 - EXACT) <= exact <= energy.upper * (1 + EXACT)


@pytest.mark.parametrize("scene", MILD)
def test_wells_cost_four_zeta_times_their_barriers(scene):
    for energy, exact in energies_of(scene)[0]:
        assert energy.certificate is not None
        check_certified(energy, exact)


@pytest.mark.parametrize("scene", STIFF)
def test_wells_at_a_stiff_stop_are_certified_or_found_not_to_be(scene):
    energies, result = energies_of(scene)
    uncertified = {(finding.source, finding.target) for finding in result.found(Code.NO_POLISHED_PATH)}
    for energy, exact in energies:
        assert (energy.certificate is None) == ((energy.source, energy.target) in uncertified)
        if energy.certificate is None:
            assert energy.bound is Bound.ESTIMATE
            check_bounds(energy, exact)
        else:
            check_certified(energy, exact)


@pytest.mark.long
@pytest.mark.parametrize("scene", GRAZING)
def test_the_first_contact_of_an_orbit_near_grazing(scene):
    structure = vk.find_structure(
        scene.oscillator, region=scene.region, cells=(16, 16), starts=(4, 4), saddles=False, manifolds=False
    )
    clear = next(attractor for attractor in structure.attractors if not attractor.impacts)
    exits = vk.FirstContact("right")
    result = vk.LeastAction(shooting=SHOOTING, graph=None, source=clear.label, exit=exits).run(
        scene.oscillator, structure
    )
    (energy,) = result.energies
    check_certified(energy, scene.contact)


@pytest.mark.long
def test_the_graph_of_an_overdamped_well_holds_the_exact_energy_in_its_bounds():
    (scene,) = (scene for scene in damped_wells() if scene.name == "double well, zeta=2")
    structure = structure_of(scene)
    exact = exact_energies(scene, structure)
    for energy in vk.ActionGraph(nodes=(120, 120)).run(scene.oscillator, structure).energies:
        assert energy.lower <= exact[energy.source] <= energy.upper


@pytest.mark.long
def test_steps_are_fine_enough_for_the_stability_of_an_orbit_at_a_stiff_stop():
    """With the default steps of ensembles, this orbit of period 6 exists, but is unstable."""
    osc = paper_scene("hertz", stiffness=1e4)
    structure = vk.find_structure(osc, cells=(20, 20), starts=(8, 8), saddles=False, manifolds=False)
    hammering = next(attractor for attractor in structure.attractors if attractor.impacts)
    stepper = ExitProblem(osc, structure, hammering, vk.LeaveBasin()).ensemble_stepper(Flow.STATE)
    orbit = refine_orbit(osc, hammering.points[0], hammering.period, stepper)
    sizes = np.sort(np.abs(np.linalg.eigvals(orbit.monodromy)))
    assert sizes == pytest.approx(np.sort(np.abs(hammering.multipliers)), abs=1e-3)


@pytest.mark.long
def test_a_path_with_many_short_impacts_is_certified():
    """Hammering between two stops: a contact lasts a fifteenth of the piece between two nodes of the path.

    ΔU is measured in m² s⁻³, so by Euler's theorem its derivatives in the lengths, weighted by them, sum to 2 ΔU, and
    those in the rates to 3 ΔU.
    """
    law = vk.Hertz(1e5)
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.05, excitations=(vk.Harmonic(0.2533, 1.25),),
        barriers=(vk.Barrier(law, 0.5, "right"), vk.Barrier(law, -0.5, "left")), noise=vk.WhiteNoise(1e-4),
    )  # fmt: skip
    structure = vk.find_structure(osc, cells=(60, 60), manifolds=False, rng=0)
    energy = (
        vk.LeastAction(source="hammering", graph=None, shooting=vk.Shooting(points=4000))
        .run(osc, structure)
        .energies[0]
    )
    assert energy.certificate is not None
    assert energy.residual <= CERTIFIED
    part = {name: osc.parameters[name] * slope / energy.value for name, slope in energy.sensitivity.items()}
    stiffness = part["barriers.0.law.stiffness"] + part["barriers.1.law.stiffness"]
    gap, force = part["barriers.0.position"] + part["barriers.1.position"], part["excitations.0.amplitude"]
    assert gap + force - stiffness / 2 == pytest.approx(2.0, abs=1e-4)
    rates = part["natural_frequency"] + part["excitations.0.frequency"]
    assert rates + 2 * force + 2 * stiffness == pytest.approx(3.0, abs=1e-4)

"""Bounds of the graph: above by the action of a whole path, below by what V may have lost; none without a path."""

import dataclasses
import functools
import math

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long
from vibrokit.analyzers.graph import tracing
from vibrokit.analyzers.graph.search import GraphSearch
from vibrokit.analyzers.graph.traced_path import whole_action
from vibrokit.analyzers.paths.local_potential import cycle_potential
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.codes import Code

pytestmark = pytest.mark.slow


# --- birhythmic van der Pol oscillator (Yamapi, Filatrella et al., arXiv 1212.0098): by averaging, weakly damped,
#     Ψ(A) = −2μ (A²/2 − A⁴/16 + αA⁶/48 − 5βA⁸/512) up to parts of order μ²


@functools.cache
def birhythmic(mu, alpha=0.144, beta=0.005, width=6.0):
    spring = vk.CustomSpring(
        "x - mu*(1 - x**2 + al*x**4 - be*x**6)*v", mu=mu, al=alpha, be=beta
    )  # fmt: skip
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, spring=spring, noise=vk.WhiteNoise(1e-3))
    region = ((-width, width), (-width, width))
    return osc, vk.find_structure(osc, region=region, cells=(60, 60), starts=(8, 8), manifolds=False)


def averaged(mu, alpha, beta):
    """ΔU from the small cycle and from the large one."""
    slope = np.polynomial.Polynomial([0, 1, 0, -1 / 4, 0, alpha / 8, 0, -5 * beta / 64])
    roots = slope.roots()
    amplitudes = np.sort(roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real)
    small, between, large = -2 * mu * slope.integ()(amplitudes)
    return between - small, between - large


@pytest.mark.parametrize("nodes", [60, long(90)])
@pytest.mark.parametrize(("source", "right"), [long("small-cycle", 0.0523), ("large-cycle", 0.037736)])
def test_the_interval_contains_the_energy_of_a_weakly_damped_cycle(source, right, nodes):
    """The right values are polished ones; averaging gives 0.0524 and 0.0378."""
    energies = averaged(0.1, 0.144, 0.005)
    assert energies[source == "large-cycle"] == pytest.approx(right, rel=0.01)
    (energy,) = vk.ActionGraph(source=source, nodes=(nodes, nodes)).run(*birhythmic(0.1)).energies
    assert energy.lower <= right * 1.005
    assert right * 0.995 <= energy.upper < 1.5 * right
    assert energy.value == pytest.approx(right, rel=0.5)


@pytest.mark.long
def test_shorter_steps_leak_no_more():
    (energy,) = vk.ActionGraph(source="large-cycle", nodes=(90, 90), steps_per_period=32).run(*birhythmic(0.1)).energies
    assert energy.lower <= 0.037736 <= 1.005 * energy.upper
    assert energy.upper < 0.06


@pytest.mark.long
@pytest.mark.parametrize("source", [0, 1])
def test_weaker_damping(source):
    """At μ = 0.02, 0.523787 μ and 0.378172 μ within O(μ²)."""
    (energy,) = vk.ActionGraph(source=source, nodes=(70, 70)).run(*birhythmic(0.02)).energies
    right = averaged(0.02, 0.144, 0.005)[source]
    assert right == pytest.approx((0.523787, 0.378172)[source] * 0.02, rel=1e-5)
    assert energy.lower <= right <= 1.01 * energy.upper


@pytest.mark.long
def test_another_pair_of_cycles():
    """α = 0.083, β = 0.0014: 13.6498 μ and 14.1987 μ as μ → 0."""
    assert averaged(1.0, 0.083, 0.0014) == pytest.approx((13.6498, 14.1987), rel=1e-5)
    for source, right in enumerate(averaged(0.01, 0.083, 0.0014)):
        (energy,) = vk.ActionGraph(source=source, nodes=(60, 60)).run(*birhythmic(0.01, 0.083, 0.0014, 10.0)).energies
        assert energy.lower <= right <= 1.01 * energy.upper


@pytest.mark.long
def test_a_search_that_is_stopped_has_an_interval_that_contains_the_energy():
    analyzer = vk.LeastAction(source="large-cycle", shooting=None, graph=GraphSearch(nodes=(60, 60)))
    osc, structure = birhythmic(0.1)
    for limit in (2.0, 6.0):
        for energy in analyzer.run(osc, structure, time_limit=limit).energies:
            assert energy.lower <= 0.037736 * 1.001
            assert energy.upper >= 0.037736 * 0.999


@pytest.mark.long
def test_the_quadratic_form_across_a_cycle():
    """Near the large cycle Ψ'' = −2μ (1 − 3A²/4 + 5αA⁴/8 − 35βA⁶/64) and Ψ = ½ Ψ'' (A − A₀)²."""
    osc, structure = birhythmic(0.02)
    cycle = structure.attractor("large-cycle")
    potential = cycle_potential(osc, cycle, vk.Order8())
    amplitude = 4.83953
    curvature = (
        -2 * 0.02 * np.polynomial.Polynomial([0, 1, 0, -1 / 4, 0, 0.144 / 8, 0, -5 * 0.005 / 64]).deriv()(amplitude)
    )
    reach = 0.01
    nodes = cycle.orbit[:: len(cycle.orbit) // 9]
    outward = nodes * (1 + reach / np.linalg.norm(nodes, axis=1))[:, None]
    np.testing.assert_allclose(potential.at(outward), 0.5 * curvature * reach**2, rtol=0.1)
    assert potential.at(nodes).max() < 1e-3 * curvature * reach**2


# --- an equilibrium out of detailed balance: Langevin double wells (CriticalTransitions.jl, issue 325)


@functools.cache
def wells(friction):
    spring = vk.CustomSpring("-x + x**3 + (1 - e*(1 - x**2))*v", e=friction)
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, spring=spring, noise=vk.WhiteNoise(0.05))
    return osc, vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)


@pytest.mark.parametrize(("friction", "right"), [long(0.0, 0.5), long(0.1, 0.47525), (0.3, 0.4280)])
@pytest.mark.parametrize("source", [0, long(1)])
def test_graph_and_action_plot_alone_agree_within_their_errors(friction, right, source):
    """0.5 by detailed balance; the others by a boundary value problem of Hamilton's equations, ±3e-4."""
    (graph,) = vk.ActionGraph(source=source, nodes=(64, 64)).run(*wells(friction)).energies
    (plot,) = vk.ActionPlot(source=source).run(*wells(friction)).energies
    accuracy = 3e-4 if friction else 1e-9
    for energy in (graph, plot):
        assert energy.lower - accuracy <= right <= energy.upper + accuracy
        assert abs(energy.value - right) <= energy.numerical_error + accuracy
        assert energy.upper == pytest.approx(right, rel=5e-3)


# --- paths that lead nowhere, and none


def problem(osc, structure, source=0):
    return ExitProblem(osc, structure, structure.attractors[source], vk.LeaveBasin())


def test_without_a_path_there_are_no_bounds(monkeypatch):
    monkeypatch.setattr(tracing, "backtrack", lambda *_: None)
    result = vk.ActionGraph(source=0, nodes=(64, 64)).run(*wells(0.0))
    (energy,) = result.energies
    assert (energy.lower, energy.upper) == (0.0, math.inf)
    assert result.found(Code.GRAPH_PATH_LOST)
    assert not result.found(Code.NOISE_NOT_WEAK)
    assert "not bounded" in str(result.summary)


def test_a_path_that_ends_in_its_own_basin_is_none():
    found = problem(*wells(0.0))
    (estimate,) = GraphSearch(nodes=(64, 64)).search(found).behind
    path = estimate.paths[0]
    assert whole_action(found, path) == pytest.approx(0.5, rel=5e-3)
    half = int(np.argmax(path.states[:, 0] > -0.5))
    short = dataclasses.replace(path, states=path.states[: half + 1], start=tracing.TraceStart(path.states[half]))
    assert whole_action(found, short) == math.inf

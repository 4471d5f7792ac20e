"""Exits from and through limit cycles, where damping depends on the energy: closed forms.

With x″ + x + γ(E) v = √D ξ and E = (v² + x²)/2, the stationary density is proportional to exp(−2 ∫γ dE / D)
(Caughey and Ma, Int. J. Non-Linear Mech. 17, 1982), so that the action from one level of E to a higher one is 2 ∫γ dE.
Cycles are the zeros of γ. All phases of a cycle are equivalent: exit paths form a family.
"""

import functools

import numpy as np
import pytest
import scipy.integrate

import vibrokit as vk
from tests.layers import long
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.polishing.polish import polish
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.results.energy import Bound

G, INNER, OUTER, STOP = 0.3, 0.5, 1.0, 1.7
FORMULA = "x + g*v*(E - inner)*(E - outer)".replace("E", "(x**2/2 + v**2/2)")
QUICK = {"shooting": None, "graph": vk.GraphSearch(nodes=(120, 120))}


def damping(energy):
    return G * (energy - INNER) * (energy - OUTER)


def cost(low, high):
    return 2 * scipy.integrate.quad(damping, low, high)[0]


@functools.cache
def self_excited(*, stops=False):
    given = {"g": G, "inner": INNER, "outer": OUTER}
    sides = (("right", STOP), ("left", -STOP)) if stops else ()
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.0, spring=vk.CustomSpring(FORMULA, **given), noise=vk.WhiteNoise(1e-4),
        barriers=tuple(vk.Barrier(vk.Hertz(20.0), position, side) for side, position in sides),
    )  # fmt: skip
    return osc, vk.find_structure(osc, cells=(60, 60), starts=(8, 8))


def reversed_motion(start, duration):
    """The path with the damping reversed, by SciPy, sampled eight times in 2π."""

    def rate(t, state):
        x, v = state
        return v, -x + v * damping(v**2 / 2 + x**2 / 2)

    times = np.arange(0, duration, 2 * np.pi / 8)
    return times, scipy.integrate.solve_ivp(rate, (0, duration), start, t_eval=times, rtol=1e-10, atol=1e-12).y.T


def test_structure_has_the_cycles():
    _, structure = self_excited()
    assert [attractor.kind for attractor in structure.attractors] == ["equilibrium", "limit cycle"]
    (cycle,) = (saddle for saddle in structure.saddles)
    x = cycle.points[0, 0]
    assert x**2 / 2 == pytest.approx(INNER, rel=1e-9)


@functools.cache
def polished(source):
    osc, structure = self_excited()
    attractor = structure.attractor(source)
    start = attractor.points[0] * (1 - 1e-4) if source == 1 else (1e-4, 0.0)
    candidate = Candidate(source, 1 - source, *reversed_motion(start, 250.0), 1.0, "test")
    (branch,) = polish(ExitProblem(osc, structure, attractor, vk.LeaveBasin()), [candidate]).branches
    return branch


@pytest.mark.slow
@pytest.mark.parametrize("source", [0, long(1)])
def test_path_between_rest_and_cycle_is_certified(source):
    branch = polished(source)
    assert branch.certificate is not None
    exact = cost(0, INNER) if source == 0 else cost(OUTER, INNER)
    assert branch.value == pytest.approx(exact, rel=1e-8)
    assert abs(branch.value - exact) < 10 * branch.numerical_error + 1e-12


@pytest.mark.slow
def test_sensitivities_are_the_derivatives_of_the_closed_form():
    branch = polished(1)
    exact = G * (OUTER - INNER) ** 3 / 3
    assert exact == pytest.approx(cost(OUTER, INNER))
    wanted = {"g": exact / G, "outer": G * (OUTER - INNER) ** 2, "inner": -G * (OUTER - INNER) ** 2}
    for name, value in wanted.items():
        assert branch.sensitivity[f"spring.{name}"] == pytest.approx(value, rel=1e-5, abs=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("source", [0, 1])
def test_least_action_certifies_both(source):
    osc, structure = self_excited()
    (energy,) = vk.LeastAction(source=source, **QUICK).run(osc, structure).energies
    exact = cost(0, INNER) if source == 0 else cost(OUTER, INNER)
    assert energy.bound is Bound.CERTIFIED
    assert energy.value == pytest.approx(exact, rel=1e-7)


@pytest.mark.long
def test_first_contact_from_the_cycle():
    osc, structure = self_excited(stops=True)
    (energy,) = vk.LeastAction(source=1, exit=vk.FirstContact(), **QUICK).run(osc, structure).energies
    assert energy.value == pytest.approx(cost(OUTER, STOP**2 / 2), rel=1e-9)


@pytest.mark.slow
def test_shots_from_rest_reach_the_cycle_although_they_pass_its_boundary_slowly():
    osc, structure = self_excited()
    (energy,) = vk.ActionPlot(source=0, points=2000, rounds=6).run(osc, structure).energies
    assert energy.value == pytest.approx(cost(0, INNER), rel=1e-3)


@pytest.mark.long
def test_energy_is_followed_along_a_parameter():
    osc, _ = self_excited()
    values, analyzer = np.linspace(OUTER, 1.1, 3), vk.LeastAction(source="cycle", **QUICK)
    along = vk.energy_continuation(osc, "spring.outer", values, analyzer=analyzer, search=(OUTER,))
    exact = G * (values - INNER) ** 3 / 3
    np.testing.assert_allclose(along.energy("cycle", "rest"), exact, rtol=1e-6)

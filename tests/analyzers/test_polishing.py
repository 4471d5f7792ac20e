"""Polishing: from poor guesses to extremals, and what becomes of guesses that lead nowhere."""

import numpy as np
import pytest
from scipy.integrate import simpson, solve_ivp

import vibrokit as vk
from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.polishing.branches import polish_all
from vibrokit.analyzers.polishing.carrier import Carrier
from vibrokit.analyzers.polishing.certify import certify
from vibrokit.analyzers.polishing.course import course_of
from vibrokit.analyzers.polishing.ends import linear_end
from vibrokit.analyzers.polishing.heteroclinic import Polisher, solved_again
from vibrokit.errors import StructureError
from vibrokit.kernels.choice import single_stepper
from vibrokit.symbolic.flow_kind import Flow

DAMPING = 0.3
PIECE = 2 * np.pi / 8  # of a candidate; ω_n = 1
BARRIER = 0.25


def well(damping):
    osc = vk.load_scene("double-well").replace({"damping_ratio": damping})
    return osc, vk.find_structure(osc, cells=(40, 40), starts=(8, 8), manifolds=False)


@pytest.fixture(scope="module")
def scene():
    return well(DAMPING)


def guess(path, action=0.33):
    """A candidate along states (count, 2), said to cost a tenth more than the path does at the usual damping."""
    states = np.asarray(path, dtype=float)
    return Candidate(0, 1, PIECE * np.arange(len(states)), states, action, "guess")


def straight(count=9, end=0.3):
    """From the well over the saddle at a constant speed, which no extremal does."""
    x = np.linspace(-1.0, end, count)
    return np.stack([x, np.full(count, (end + 1.0) / (count - 1) / PIECE)], axis=1)


def spiral(turns=3, growth=0.25):
    """Out of the well in equal turns, to beyond the saddle."""
    t = PIECE * np.arange(8 * turns + 3)
    size = np.exp(growth * (t - t[-3])) * 0.9
    x = -1.0 + size * np.cos(1.4 * (t - t[-3]))
    states = np.stack([x, -1.4 * size * np.sin(1.4 * (t - t[-3]))], axis=1)
    states[-2:] = [[0.1, 0.2], [0.4, 0.4]]
    return states


def only(found):
    (branch,) = found.branches
    return branch


GUESSES = {"straight": straight(), "few nodes": straight(4), "spiral": spiral(), "far beyond": straight(12, 0.9)}


@pytest.mark.parametrize("path", GUESSES.values(), ids=GUESSES)
def test_poor_guesses_come_to_the_barrier(scene, path):
    branch = only(polish_all(*scene, 0, (guess(path),), vk.LeaveBasin()))
    assert branch.value == pytest.approx(4 * DAMPING * BARRIER, rel=1e-6)
    assert branch.residual <= 1e-9
    assert (branch.source, branch.target, branch.saddle) == (0, 1, 0)


@pytest.mark.parametrize("damping", [0.05, 1.0])
def test_whatever_the_damping(damping):
    branch = only(polish_all(*well(damping), 0, (guess(straight()),), vk.LeaveBasin()))
    assert branch.value == pytest.approx(4 * damping * BARRIER, rel=1e-6)


def test_two_guesses_of_one_path_are_one_branch(scene):
    both = polish_all(*scene, 0, (guess(straight()), guess(spiral())), vk.LeaveBasin())
    assert len(both.branches) == 1
    assert both.words == ()


def test_a_guess_far_dearer_than_a_known_path_is_left_out_and_counted(scene):
    seen = []
    candidates = (guess(spiral(), 1.0), guess(straight()))
    found = polish_all(*scene, 0, candidates, vk.LeaveBasin(), None, lambda *part: seen.append(part))
    assert only(found).value == pytest.approx(4 * DAMPING * BARRIER, rel=1e-6)
    assert found.words == (
        "Attractor 0: 1 of 2 candidates cost over 1.25 times the least path known and were not polished.",
    )
    assert seen == [(1, 2), (2, 2)]


NOWHERE = {
    "never away": np.tile([-1.0, 0.0], (9, 1)),
    "one state": [[-1.0, 0.0]],
    "far out": [[-1.0, 0.0], [1e6, 1e6], [1e8, 0.0]],
    "not finite": [[-1.0, 0.0], [np.nan, 0.0], [0.5, 0.0]],
}


@pytest.mark.parametrize("path", NOWHERE.values(), ids=NOWHERE)
def test_a_guess_that_leads_nowhere_yields_words_or_the_truth(scene, path):
    """There is one way out only: a number can be that of the barrier, and none other."""
    found = polish_all(*scene, 0, (guess(path, 0.123),), vk.LeaveBasin())
    if found.branches:
        assert only(found).value == pytest.approx(4 * DAMPING * BARRIER, rel=1e-6)
    else:
        (words,) = found.words
        assert words.startswith("A candidate of the guess with action 0.123 led to no path: ")
        assert words.endswith(".")


@pytest.mark.parametrize("path", [NOWHERE["one state"], NOWHERE["not finite"]], ids=["one state", "not finite"])
def test_no_number_comes_of_no_path(scene, path):
    found = polish_all(*scene, 0, (guess(path),), vk.LeaveBasin())
    assert found.branches == ()
    assert len(found.words) == 1


def test_no_candidate_no_word(scene):
    found = polish_all(*scene, 0, (), vk.LeaveBasin())
    assert (found.branches, found.words) == ((), ())


def test_progress_counts_candidates(scene):
    seen, candidates = [], (guess(straight()), guess(NOWHERE["one state"]))
    polish_all(*scene, 0, candidates, vk.LeaveBasin(), None, lambda *part: seen.append(part))
    assert seen == [(1, 2), (2, 2)]


# --- the path itself


@pytest.fixture(scope="module")
def path(scene):
    return only(polish_all(*scene, 0, (guess(straight()),), vk.LeaveBasin())).path


def rates(t, z):
    """Hamilton's equations of H = p₁ v + p₂ (−2ζv + x − x³) + p₂²/2, by hand."""
    x, v, p1, p2 = z
    return [v, -2 * DAMPING * v + x - x**3 + p2, -p2 * (1 - 3 * x**2), -p1 + 2 * DAMPING * p2]


def test_it_goes_from_the_attractor_to_the_saddle(path):
    np.testing.assert_allclose(path.q[0], [-1.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(path.q[-1], [0.0, 0.0], atol=1e-3)
    np.testing.assert_allclose(path.p[[0, -1]], 0.0, atol=1e-2)
    assert np.all(np.diff(path.t) > 0)
    assert path.t[0] == 0


def test_hamilton_s_function_is_zero_along_it(path):
    x, v = path.q.T
    p1, p2 = path.p.T
    terms = np.array([p1 * v, p2 * (-2 * DAMPING * v + x - x**3), p2**2 / 2])
    assert np.abs(terms.sum(axis=0)).max() < 1e-9 * np.abs(terms).max()


def test_it_is_the_closed_form(path):
    """p = ∂Ψ/∂q with Ψ = 4ζE, so p₂ = 4ζv and p₁ = 4ζ(x³ − x)."""
    x, v = path.q.T
    np.testing.assert_allclose(path.p[:, 0], 4 * DAMPING * (x**3 - x), atol=1e-7)
    np.testing.assert_allclose(path.p[:, 1], 4 * DAMPING * v, atol=1e-7)
    energy = v**2 / 2 + x**4 / 4 - x**2 / 2 + BARRIER
    np.testing.assert_allclose(path.action, 4 * DAMPING * energy, atol=1e-7)


def test_it_solves_hamilton_s_equations(path):
    """From several of its samples, SciPy comes to the samples half a period on."""
    z = np.hstack([path.q, path.p])
    for start in range(0, len(z) - 65, max(1, len(z) // 12)):
        times = path.t[start : start + 65]
        done = solve_ivp(rates, (times[0], times[-1]), z[start], "DOP853", times, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(done.y.T, z[start : start + 65], atol=1e-8)


def test_the_action_is_what_the_noise_pays(path):
    paid = simpson(path.p[:, 1] ** 2 / 2, x=path.t)
    assert path.action[-1] - path.action[0] == pytest.approx(paid, rel=1e-6)
    assert 0 <= path.action[0] < 1e-5 * path.action[-1]
    assert np.all(np.diff(path.action) >= 0)
    assert path.action[-1] == pytest.approx(4 * DAMPING * BARRIER, rel=1e-5)


# --- paths that begin on the orbit itself, in a finite time


@pytest.fixture(scope="module")
def held(scene):
    osc, structure = scene
    (goal,), _ = vk.LeaveBasin().goals(osc, structure, 0)
    carrier = Carrier(goal.scene(osc), single_stepper(osc, Flow.HAMILTONIAN_VARIATIONAL))
    source = linear_end(carrier, structure.attractor(0).points[0], 1).on_orbit()
    cuts = goal.destination(carrier).cuts(course_of(carrier, guess(straight()), 32))
    return carrier, Polisher(carrier, source).polished(cuts)


def test_less_time_costs_more(held):
    carrier, found = held
    exact = 4 * DAMPING * BARRIER
    assert found.points[0, :2] == pytest.approx([-1.0, 0.0], abs=1e-12)
    costs = [solved_again(carrier, found, added, 0).action for added in (-16, -8, 0, 16, 32)]
    assert np.all(np.diff(costs) < 0)
    assert exact < costs[-1] < (1 + 1e-4) * exact


def test_its_certificate_says_what_time_costs(held):
    proof = certify(*held)
    assert proof.by_start > 0 > proof.by_length
    assert abs(proof.by_stepper) < 1e-9


def test_none_is_made_shorter_than_it_is(held):
    carrier, found = held
    with pytest.raises(StructureError, match="cannot be made"):
        solved_again(carrier, found, -len(found.points), 0)

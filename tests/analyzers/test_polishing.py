"""Polishing: from poor guesses to extremal paths, and what becomes of guesses that lead nowhere."""

import dataclasses
import functools

import numpy as np
import pytest
from scipy.integrate import simpson, solve_ivp
from scipy.linalg import solve_continuous_lyapunov

import vibrokit as vk
from tests.scenes import Coloured, scene
from vibrokit.analyzers.exits import LeaveRegion
from vibrokit.analyzers.paths.candidate import Candidate
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.certified import certify
from vibrokit.analyzers.polishing.ending import resampled
from vibrokit.analyzers.polishing.ends import ending_at
from vibrokit.analyzers.polishing.linearize import linearized_orbit
from vibrokit.analyzers.polishing.path_solver import PathSolver, solved_again
from vibrokit.analyzers.polishing.polish import Polishing, Shared, polish
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.kernels.choice import single_stepper
from vibrokit.progress import working
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Code
from vibrokit.results.energy import Bound
from vibrokit.structure.autonomous import equilibria
from vibrokit.symbolic.flow_kind import Flow

DAMPING = 0.3
PIECE = 2 * np.pi / 8  # of a candidate; ω_n = 1
BARRIER = 0.25


def problem_of(osc, structure, label=0, leaving=None):
    return ExitProblem(osc, structure, structure.attractor(label), leaving or vk.LeaveBasin())


@functools.cache
def well(damping):
    osc = vk.load_scene("double-well").replace({"damping_ratio": damping})
    return problem_of(osc, vk.find_structure(osc, cells=(40, 40), starts=(8, 8), manifolds=False))


@pytest.fixture(scope="module")
def problem():
    return well(DAMPING)


def guess(path, action=0.33):
    """A candidate along states (count, 2), with an action a tenth above that of the path at the usual damping."""
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


GUESSES = {
    "straight": (DAMPING, straight()),
    "few nodes": (DAMPING, straight(4)),
    "spiral": (DAMPING, spiral()),
    "far beyond": (DAMPING, straight(12, 0.9)),
    "weakly damped": (0.05, straight()),
    "strongly damped": (1.0, straight()),
}


@pytest.mark.parametrize(("damping", "path"), GUESSES.values(), ids=GUESSES)
def test_poor_guesses_lead_to_the_barrier_which_their_branch_bounds_from_above_only(damping, path):
    branch, exact = only(polish(well(damping), (guess(path),))), 4 * damping * BARRIER
    assert branch.value == pytest.approx(exact, rel=1e-6)
    assert (branch.source, branch.target, branch.saddle) == (0, 1, 0)
    assert (branch.bound, branch.lower) == (Bound.UPPER, 0)
    assert branch.upper == branch.value + branch.numerical_error
    assert abs(branch.value - exact) <= branch.numerical_error < 1e-6 * branch.value
    assert branch.residual <= 1e-9


def test_two_guesses_of_one_path_are_one_branch_and_a_far_costlier_one_is_skipped(problem):
    found = polish(problem, (guess(straight(12, 0.9), 1.0), guess(straight()), guess(spiral())))
    assert only(found).value == pytest.approx(4 * DAMPING * BARRIER, rel=1e-6)
    (finding,) = found.findings
    assert finding.code is Code.CANDIDATES_SKIPPED
    assert finding.values == {"skipped": 1, "total": 3, "factor": 1.25}


def test_a_shot_that_newton_s_method_does_not_lead_to_a_path_descends(problem):
    far = dataclasses.replace(guess(straight(), 0.305), momenta=np.full_like(straight(), 5.0))
    assert only(polish(problem, (far,))).value == pytest.approx(4 * DAMPING * BARRIER, rel=1e-6)


NOWHERE = {
    "one state": [[-1.0, 0.0]],
    "not finite": [[-1.0, 0.0], [np.nan, 0.0], [0.5, 0.0]],
    "never away": np.tile([-1.0, 0.0], (9, 1)),
    "far out": [[-1.0, 0.0], [1e6, 1e6], [1e8, 0.0]],
}


@pytest.mark.parametrize(
    ("path", "action", "rounds", "paths"),
    [(straight(), 0.33, 2, 1), (NOWHERE["not finite"], 0.33, 2, 0), (straight(), 300.0, 1, 1)],
    ids=["path", "no path", "path of no cost"],
)
def test_a_candidate_is_polished_from_few_of_several_orbits_that_lead_to_the_same(problem, path, action, rounds, paths):
    """From one only where it has a thousand times the action of its path: that is no more than an error of its grid."""
    (well,), shared = equilibria(problem.scene, -1.5, -0.5), Shared()
    several, iterations, candidate = [Polishing(problem, well, shared) for _ in range(4)], [], guess(path, action)
    for one in several:
        with working() as work:
            one.add((candidate,))
        iterations.append(work.stats.newton_iterations)
    assert iterations[rounds:] == [0] * (4 - rounds)
    assert [len(one.polished().branches) for one in several] == [paths, 0, 0, 0]


@pytest.mark.parametrize("name", NOWHERE)
def test_a_guess_that_leads_nowhere_yields_a_finding_or_the_truth(problem, name):
    """There is only one exit path: a number can be that of the barrier, and no other."""
    found = polish(problem, (guess(NOWHERE[name], 0.123),))
    if found.branches and name not in ("one state", "not finite"):
        assert only(found).value == pytest.approx(4 * DAMPING * BARRIER, rel=1e-6)
    else:
        assert found.branches == ()
        (finding,) = found.findings
        assert finding.code is Code.CANDIDATE_FAILED
        assert (finding.values["finder"], finding.values["action"]) == ("guess", 0.123)


def test_candidates_and_newton_iterations_are_counted(problem):
    assert polish(problem, ()).branches == ()
    seen = []
    candidates = (guess(straight()), guess(NOWHERE["one state"]))
    with working(lambda update: seen.append((update.stage, update.unit, update.done, update.total))) as work:
        polish(problem, candidates)
    assert ("polishing", "candidates", 2, 2) in seen
    assert seen[-1] == ("certifying", "paths", 1, 1)
    assert work.stats.newton_iterations > 10


@pytest.mark.parametrize(("doing", "certified"), [("polishing", 1), ("certifying", 0)])
def test_what_was_found_before_a_stop_is_kept(problem, doing, certified):
    def interrupt(update):
        if update.stage == doing and update.done == certified and not update.finished:
            raise KeyboardInterrupt

    with working(interrupt):
        found = polish(problem, (guess(straight()), guess(spiral(), 0.5)))
    assert [branch.certificate is not None for branch in found.branches] == [bool(certified)]
    (finding,) = (finding for finding in found.findings if finding.code is Code.STOPPED)
    assert finding.values == {"stage": doing, "reason": "interrupt"}


def test_a_path_whose_certificate_fails_is_an_upper_bound(problem, monkeypatch):
    """With the action and the error that it was accepted with."""

    def failing(propagator, found):
        raise StructureError("no solution nearby.")

    exact = polish(problem, (guess(straight()),)).branches[0]
    monkeypatch.setattr("vibrokit.analyzers.polishing.certified.certify", failing)
    found = polish(problem, (guess(straight()),))
    (branch,) = found.branches
    assert branch.value == exact.value
    assert branch.certificate is None
    assert branch.bound is Bound.UPPER
    assert branch.numerical_error == pytest.approx(1e-6 * branch.value)
    assert Code.NO_CERTIFICATE in [finding.code for finding in found.findings]


# --- ends that cannot be used


def with_saddles(problem, **changes):
    saddles = tuple(dataclasses.replace(saddle, **changes) for saddle in problem.structure.saddles)
    return dataclasses.replace(problem, structure=dataclasses.replace(problem.structure, saddles=saddles))


def test_no_path_is_polished_to_a_chaotic_set_or_where_there_is_no_orbit(problem):
    for changes in ({"kind": "chaotic"}, {"nodes": np.array([[np.nan, 0.0]])}):
        found = polish(with_saddles(problem, **changes), (guess(straight()),))
        assert found.branches == ()
        assert [finding.code for finding in found.findings] == [Code.SADDLE_NOT_USABLE, Code.CANDIDATE_FAILED]
        assert found.findings[0].values["saddle"] == 0


def test_a_path_to_an_orbit_inside_a_chaotic_set_is_a_bound_unless_another_costs_less(problem):
    inside = with_saddles(problem, embedded=True)
    found = polish(inside, (guess(straight()),))
    assert only(found).value == pytest.approx(4 * DAMPING * BARRIER, rel=1e-6)
    assert (only(found).bound, only(found).saddle) == (Bound.BRACKET, 0)
    (finding,) = found.findings
    assert (finding.code, finding.values) == (Code.CHAOTIC_BOUNDARY, {"saddles": [0]})
    saddles = (*problem.structure.saddles, *inside.structure.saddles)
    both = dataclasses.replace(problem, structure=dataclasses.replace(problem.structure, saddles=saddles))
    found = polish(both, (guess(straight()),))
    assert (only(found).saddle, only(found).bound) == (0, Bound.UPPER)
    assert [finding.code for finding in found.findings] == [Code.CHAOTIC_BOUNDARY]


def test_saddles_of_others_are_used_where_there_is_no_own_one(problem):
    found = polish(with_saddles(problem, leads_to=(1, ESCAPED)), (guess(straight()),))
    assert [finding.code for finding in found.findings] == [Code.SADDLES_OF_OTHERS, Code.ONE_SADDLE_TO_SEVERAL]
    assert [branch.target for branch in found.branches] == [1, ESCAPED]
    assert [branch.value for branch in found.branches] == pytest.approx([4 * DAMPING * BARRIER] * 2, rel=1e-6)


# --- the path itself


@pytest.fixture(scope="module")
def path(problem):
    return only(polish(problem, (guess(straight()),))).path


def rates(t, z):
    """Hamilton's equations of H = p₁ v + p₂ (−2ζv + x − x³) + p₂²/2, by hand."""
    x, v, p1, p2 = z
    return [v, -2 * DAMPING * v + x - x**3 + p2, -p2 * (1 - 3 * x**2), -p1 + 2 * DAMPING * p2]


def test_it_goes_from_the_attractor_to_the_saddle_in_closed_form(path):
    """p = ∂Ψ/∂q with Ψ = 4ζE, so p₂ = 4ζv and p₁ = 4ζ(x³ − x); H = 0."""
    (x, v), (p1, p2) = path.q.T, path.p.T
    np.testing.assert_allclose(path.q[[0, -1]], [[-1.0, 0.0], [0.0, 0.0]], atol=1e-3)
    assert path.t[0] == 0
    assert np.all(np.diff(path.t) > 0)
    terms = np.array([p1 * v, p2 * (-2 * DAMPING * v + x - x**3), p2**2 / 2])
    assert np.abs(terms.sum(axis=0)).max() < 1e-9 * np.abs(terms).max()
    np.testing.assert_allclose(p1, 4 * DAMPING * (x**3 - x), atol=1e-7)
    np.testing.assert_allclose(p2, 4 * DAMPING * v, atol=1e-7)
    np.testing.assert_allclose(path.action, 4 * DAMPING * (v**2 / 2 + x**4 / 4 - x**2 / 2 + BARRIER), atol=1e-7)


def test_it_solves_hamilton_s_equations(path):
    """From several of its samples, SciPy comes to the samples half a period on; the action is what the noise pays."""
    z = np.hstack([path.q, path.p])
    for start in range(0, len(z) - 65, max(1, len(z) // 12)):
        times = path.t[start : start + 65]
        done = solve_ivp(rates, (times[0], times[-1]), z[start], "DOP853", times, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(done.y.T, z[start : start + 65], atol=1e-8)
    assert path.action[-1] - path.action[0] == pytest.approx(simpson(path.p[:, 1] ** 2 / 2, x=path.t), rel=1e-6)
    assert 0 <= path.action[0] < 1e-5 * path.action[-1]
    assert np.all(np.diff(path.action) >= 0)


def test_a_candidate_with_momenta_follows_hamilton_s_equations_between_its_samples(problem, path):
    """Every 16th sample of a path, brought to nodes at half that distance, is the path again."""
    few = slice(None, None, 16)
    candidate = Candidate(0, 1, path.t[few], path.q[few], 0.33, "samples", path.p[few])
    propagator = SegmentPropagator(problem.scene, single_stepper(problem.scene, Flow.HAMILTONIAN_VARIATIONAL), 16)
    found = resampled(propagator, candidate)
    np.testing.assert_allclose(found.states[:40], path.q[::8][:40], atol=1e-8)
    np.testing.assert_allclose(found.momenta[:40], path.p[::8][:40], atol=1e-8)


# --- paths that start on the orbit itself and take a finite time


def test_less_time_costs_more_and_the_certificate_says_so(problem):
    propagator = SegmentPropagator(problem.scene, single_stepper(problem.scene, Flow.HAMILTONIAN_VARIATIONAL))
    (end,) = problem.path_ends
    cuts = ending_at(end, problem, propagator).cuts(resampled(propagator, guess(straight())))
    well = linearized_orbit(propagator, problem.attractor.points[:1], 1, 0.0).with_start_on_orbit()
    found, exact = PathSolver(propagator, well).solve(cuts), 4 * DAMPING * BARRIER
    assert found.points[0, :2] == pytest.approx([-1.0, 0.0], abs=1e-12)
    costs = [solved_again(propagator, found, added, 0).action for added in (-16, -8, 0, 16, 32)]
    assert np.all(np.diff(costs) < 0)
    assert exact < costs[-1] < (1 + 1e-4) * exact
    proof = certify(propagator, found)
    assert proof.by_start > 0 > proof.by_length
    assert abs(proof.by_stepper) < 1e-9
    with pytest.raises(StructureError, match="cannot be made"):
        solved_again(propagator, found, -len(found.points), 0)


# --- faces of a region: ½ d²/Σ, d the least distance from the attractor and Σ the stationary variance per D


class LeaveBox(LeaveRegion):
    """Leaving a box in (x, v)."""

    x: tuple[float, float] = (-np.inf, np.inf)
    v: tuple[float, float] = (-np.inf, np.inf)

    def bounds(self, osc):
        return np.array([self.x, self.v])


NATURAL, ZETA, RATE = 1.3, 0.2, 0.6
FORCED = vk.Harmonic(amplitude=0.3, frequency=0.57)


@functools.cache
def linear(forced, filtered):
    noise = Coloured(intensity=1e-3, rate=RATE) if filtered else vk.WhiteNoise(1e-3)
    excitations = (FORCED,) if forced else ()
    osc = scene(natural_frequency=NATURAL, damping_ratio=ZETA, excitations=excitations, noise=noise)
    return osc, vk.find_structure(osc, cells=(8, 8), starts=(3, 3), saddles=False, manifolds=False)


def variances(filtered):
    flow = np.array([[0, 1, 0], [-(NATURAL**2), -2 * ZETA * NATURAL, 1], [0, 0, -RATE]])
    noise = np.diag([0, 0, RATE**2]) if filtered else np.diag([0, 1])
    size = len(noise)
    return np.diag(solve_continuous_lyapunov(flow[:size, :size], -noise))


def swing(forced, times):
    """The noise-free motion, as (x, v)."""
    if not forced:
        return np.zeros((len(times), 2))
    turning = np.exp(1j * FORCED.frequency * times)
    answer = FORCED.amplitude / (NATURAL**2 - FORCED.frequency**2 + 2j * ZETA * NATURAL * FORCED.frequency)
    return np.stack([(answer * turning).real, (1j * FORCED.frequency * answer * turning).real], axis=1)


def spiralling(forced, filtered, period, reach, turns=4):
    """A candidate that leaves the orbit in growing turns, until it is far beyond every face."""
    times = period / 16 * np.arange(16 * turns + 1)
    size = reach * np.exp(0.4 * (times - times[-1]))
    away = np.stack([size * np.cos(NATURAL * times), -size * np.sin(NATURAL * times)], axis=1)
    states = np.hstack([swing(forced, times) + away, np.zeros((len(times), int(filtered)))])
    return Candidate(0, -1, times, states, 1.0, "guess")


FACES = {"right": ("x", 0, 1), "left": ("x", 0, -1), "up": ("v", 1, 1), "down": ("v", 1, -1)}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("forced", "filtered"), [(False, False), (True, False), (True, True)], ids=["autonomous", "forced", "filtered"]
)
@pytest.mark.parametrize("face", FACES.values(), ids=FACES)
def test_the_least_action_to_a_face(face, forced, filtered):
    name, axis, sign = face
    osc, structure = linear(forced, filtered)
    leaving = LeaveBox(**{name: (-np.inf, 1.0) if sign > 0 else (-1.0, np.inf)})
    candidate = spiralling(forced, filtered, osc.section_interval, 3.0)
    found = polish(problem_of(osc, structure, 0, leaving), (candidate,))
    branch = only(found)
    farthest = np.max(sign * swing(forced, np.linspace(0, 2 * np.pi / FORCED.frequency, 100_001))[:, axis])
    exact = 0.5 * (1.0 - farthest) ** 2 / variances(filtered)[axis]
    assert branch.value == pytest.approx(exact, rel=1e-8)
    assert (branch.target, branch.saddle) == (-1, -1)
    assert branch.residual <= 1e-9
    end, momenta = branch.path.q[-1], branch.path.p[-1]
    assert end[axis] == pytest.approx(sign, abs=1e-9)
    assert np.abs(np.delete(momenta, axis)).max() < 1e-7 * np.abs(branch.path.p).max()
    assert np.all(sign * branch.path.q[:-1, axis] < 1.0)


def test_a_path_that_leaves_by_another_face_first_is_refused():
    """From an attractor next to one face, the path to the far one swings through the near one."""
    osc, structure = linear(False, False)
    candidate = spiralling(False, False, osc.section_interval, 3.0)
    found = polish(problem_of(osc, structure, 0, LeaveBox(x=(-0.1, 1.0))), (candidate,))
    assert only(found).value == pytest.approx(0.5 * 0.1**2 / variances(False)[0], rel=1e-8)
    assert only(found).path.q[-1, 0] == pytest.approx(-0.1)

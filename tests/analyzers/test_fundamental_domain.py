"""The fundamental domain on linear oscillators, where flow and covariance are closed forms."""

import math

import numpy as np
import pytest
import scipy.linalg

import vibrokit as vk
from vibrokit.analyzers.paths.local_potential import Phase, local_potential, potential_along
from vibrokit.analyzers.shooting.boxes import Boxes, nearest
from vibrokit.analyzers.shooting.starts import FundamentalDomain, on_sphere, shells_of
from vibrokit.structure.orbits import refine_orbit

PERIOD, PHASES, RADIUS = 2 * math.pi / 0.57, 16, 1e-3
DAMPINGS = [0.01, 0.3, 2.0]


def covariance(damping):
    """⟨δx²⟩ = 1/(4ζω_n³), ⟨δv²⟩ = 1/(4ζω_n), per unit intensity; ω_n = 1."""
    return np.diag([1 / (4 * damping), 1 / (4 * damping)])


def flow(damping, duration):
    return scipy.linalg.expm(np.array([[0.0, 1.0], [-1.0, -2 * damping]]) * duration)


def domain(damping):
    step = PERIOD / PHASES
    phases = [Phase(step * k, np.array([0.3, -0.2]), covariance(damping), flow(damping, step)) for k in range(PHASES)]
    return FundamentalDomain(shells_of(phases), RADIUS, 0.01, 1.0)


def fractions_of(shell, states):
    """Where states lie between the edges, in fractions of their logarithmic distance; in [0, 1) inside the shell."""
    place = np.linalg.solve(shell.root, (states[:, :2] - shell.point).T)
    length, before = np.linalg.norm(place, axis=0), np.linalg.norm(shell.back @ place, axis=0)
    return np.log(length / RADIUS) / np.log(length / before)


def growth(damping, duration):
    """Extremals run relaxation backward: δq′ = −Aᵀ δq where Σ is a multiple of 1."""
    return flow(damping, -duration).T


@pytest.mark.parametrize("damping", DAMPINGS)
def test_growth_is_what_hamilton_s_equations_make_of_the_quadratic_form(damping):
    """δq ↦ (M + C M⁻ᵀ Σ⁻¹) δq, from the exponential of the linear Hamiltonian flow, over a time that it can take."""
    drift = np.array([[0.0, 1.0], [-1.0, -2 * damping]])
    both = scipy.linalg.expm(np.block([[drift, np.diag([0.0, 1.0])], [np.zeros((2, 2)), -drift.T]]) * 0.5)
    expected = both[:2, :2] + both[:2, 2:] @ np.linalg.inv(covariance(damping))
    np.testing.assert_allclose(growth(damping, 0.5), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("damping", DAMPINGS)
def test_each_orbit_enters_once(damping):
    """Random paths, followed backward and forward in time in closed form, are in one shell at one time."""
    made = domain(damping)
    count = len(made.shells)
    step = PERIOD / count
    slow, fast = damping - math.sqrt(max(damping**2 - 1, 0)), damping + math.sqrt(max(damping**2 - 1, 0))
    around = math.ceil(math.log(1e3) / slow / step)
    angle = np.random.default_rng(1).uniform(0, 2 * np.pi, 200)
    length = RADIUS * 10 ** np.random.default_rng(2).uniform(-1, 1, 200) * math.sqrt(1 / (4 * damping))
    paths = length * np.stack([np.cos(angle), np.sin(angle)])
    assert fast * around * step < 300  # no overflow
    entered = np.zeros(200, dtype=int)
    for k in range(-around, around):
        shell = made.shells[k % count]
        fractions = fractions_of(shell, shell.point + (growth(damping, k * step) @ paths).T)
        entered += (fractions >= 0) & (fractions < 1)
    np.testing.assert_array_equal(entered, 1)


@pytest.mark.parametrize("damping", DAMPINGS)
def test_the_outer_edge_is_the_image_of_the_inner(damping):
    made = domain(damping)
    root = np.linalg.cholesky(covariance(damping))
    angle = np.linspace(0, 2 * np.pi, 50)
    inner = RADIUS * np.stack([np.cos(angle), np.sin(angle)]).T @ root.T
    image = inner @ growth(damping, PERIOD / len(made.shells)).T
    fractions = fractions_of(made.shells[0], made.shells[0].point + image)
    np.testing.assert_allclose(fractions, 1.0, rtol=1e-9)
    stiffness = np.linalg.inv(covariance(damping))
    assert np.all(np.einsum("ij,jk,ik->i", image, stiffness, image) > RADIUS**2)


@pytest.mark.parametrize("damping", DAMPINGS)
def test_starts_lie_where_their_places_say(damping):
    made = domain(damping)
    places = np.random.default_rng(2).random((500, 2))
    states, times = made.states(places)
    offset = states[:, :2] - made.shells[0].point
    np.testing.assert_allclose(states[:, 2:4], offset * 4 * damping, rtol=1e-9, atol=1e-14)
    np.testing.assert_allclose(states[:, 4], 2 * damping * np.sum(offset**2, axis=1), rtol=1e-9)
    for number, shell in enumerate(made.shells):
        here = times == shell.time
        fractions = (number + fractions_of(shell, states[here])) / len(made.shells)
        np.testing.assert_allclose(fractions, places[here, 1], atol=1e-9)


def test_strong_damping_needs_more_shells():
    assert len(domain(0.01).shells) == 1
    assert len(domain(2.0).shells) > 1
    medium = domain(0.3).shells
    assert 1 < len(medium) < PHASES
    assert max(1 / np.linalg.svd(shell.back, compute_uv=False)[-1] for shell in medium) <= 10


@pytest.mark.slow
def test_phases_close_after_a_period(paper):
    """Whole periods and pieces are integrated apart, so they agree as far as the steps are fine."""
    osc, structure = paper
    stepper = vk.Order8(1e-12)
    for attractor in structure.attractors:
        orbit = refine_orbit(osc, attractor.points[0], 1, stepper)
        phases = potential_along(osc, orbit, stepper)
        last = phases[-1]
        potential = local_potential(osc, orbit, stepper)
        scale = np.abs(potential.covariance).max()
        np.testing.assert_allclose(phases[0].covariance, potential.covariance, rtol=1e-9, atol=1e-9 * scale)
        np.testing.assert_allclose(phases[0].point, orbit.point)
        # Σ = M Σ Mᵀ + C over the last piece too: what is left, C, has no negative eigenvalue.
        gathered = phases[0].covariance - phases[0].monodromy @ last.covariance @ phases[0].monodromy.T
        assert np.linalg.eigvalsh(gathered).min() > -1e-9 * np.linalg.eigvalsh(potential.covariance).max()


def test_directions_are_unit_vectors_in_any_number():
    for size in (1, 2, 3):
        vectors = on_sphere(np.random.default_rng(3).random((100, size)))
        assert vectors.shape == (100, size + 1)
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0)


def test_boxes_cover_the_cube_and_close_in_on_a_least_value():
    """A value that jumps, least at the edge of the jump: f = 1 + distance on one side, infinite on the other."""
    boxes = Boxes.grid((20, 10))

    def value(places):
        apart = np.hypot(places[:, 0] - 0.4321, places[:, 1] - 0.6789)
        return np.where(places[:, 0] > 0.4321, 1 + apart, np.inf)

    for _ in range(10):
        values = value(boxes.centres)
        boxes = boxes.split(boxes.promising(values, np.zeros(len(values), dtype=int), 20))
    assert np.sum(np.prod(boxes.first * 3.0 ** -boxes.splits[:, None], axis=1)) == pytest.approx(1.0)
    assert value(boxes.centres).min() == pytest.approx(1.0, abs=1e-4)
    best = boxes.minima(value(boxes.centres))
    assert len(best) == 1
    np.testing.assert_allclose(boxes.centres[best[0]], [0.4321, 0.6789], atol=1e-4)


def test_neighbours_meet_across_the_start_of_the_circle():
    boxes = Boxes.grid((12, 3))
    first = int(np.argmin(np.abs(boxes.centres - [0.5 / 12, 0.5]).sum(axis=1)))
    near = boxes.centres[nearest(boxes.centres, boxes.first)[first]]
    assert np.isclose(near[:, 0], 11.5 / 12).any()

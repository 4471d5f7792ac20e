"""Minimal fatal shocks, against the stable manifold of the saddle as SciPy integrates it."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk


def separatrix(damping=0.05):
    """The double well's basin boundary: from the saddle at rest, backwards along its stable direction."""
    rate = -damping - np.sqrt(damping**2 + 1)
    start = 1e-8 * np.array([1.0, rate])
    crossings = [lambda t, y: y[0] + 1, lambda t, y: y[0] - 1]
    return solve_ivp(
        lambda t, y: [y[1], -2 * damping * y[1] + y[0] - y[0] ** 3], (0, -40), start,
        method="DOP853", rtol=1e-12, atol=1e-15, dense_output=True, events=crossings,
    )  # fmt: skip


@pytest.fixture(scope="module")
def well():
    osc = vk.load_scene("double-well")
    structure = vk.find_structure(osc, cells=(100, 100), region=((-2, 2), (-2, 2)), saddles=False)
    return vk.shape_stability(osc, structure)


def test_the_smallest_kick_is_the_distance_to_the_separatrix(well):
    branch = separatrix()
    curve = branch.sol(np.linspace(0, -40, 400_001))
    both = np.concatenate([curve.T, -curve.T])
    for stability, place in zip(well, (-1.0, 1.0), strict=True):
        distance = np.hypot(both[:, 0] - place, both[:, 1]).min()  # ω_n = 1
        assert stability.any_kick.size == pytest.approx(distance, abs=1e-6)
        speed = min(np.abs(crossings[:, 1]).min() for crossings in branch.y_events)  # its mirror image is one as well
        assert stability.velocity_kick.size == pytest.approx(speed, abs=1e-7)
        assert stability.velocity_kick.kick[0] == pytest.approx(0.0, abs=1e-15)


def test_the_wells_mirror_each_other(well):
    left, right = well
    assert (left.any_kick.target, right.any_kick.target) == (1, 0)
    np.testing.assert_allclose(left.any_kick.kick, -right.any_kick.kick, atol=1e-9)
    assert left.basin_fraction == right.basin_fraction


@pytest.mark.slow
def test_a_fatal_kick_is_fatal_and_a_smaller_one_is_not(paper):
    osc, structure = paper
    for stability in vk.shape_stability(osc, structure, phases=4, directions=16):
        shock = stability.any_kick
        states = np.array([shock.state + share * shock.kick for share in (0.5, 0.98, 1.001)])
        rest = osc.period - shock.time
        ends = []
        for state in states:
            at_section = osc.trajectory(state, duration=rest, start_time=shock.time, stepper=vk.RK4(256)).states[-1]
            ends.append(osc.section_map(at_section[None], 500, stepper=vk.RK4(256))[0])
        points = np.array([attractor.points[0] for attractor in structure.attractors])
        fates = [int(np.argmin(np.linalg.norm(points - end, axis=1))) for end in ends]
        assert fates == [stability.label, stability.label, shock.target]
        assert stability.velocity_kick.size >= shock.size - shock.error

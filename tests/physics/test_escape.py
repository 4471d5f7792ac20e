"""Escape from a well, and from one of many wells that are alike: closed forms, and SciPy for where motions end."""

import functools
import math

import numpy as np
import pytest
import scipy.integrate

import vibrokit as vk
from tests.layers import slow
from vibrokit.results.basins import AT_COPY, ESCAPED
from vibrokit.results.codes import Code

QUICK = vk.LeastAction(shooting=None, graph=vk.GraphSearch(nodes=(60, 60)))
DAMPING = 0.1
PUSH = 0.2  # too little to keep a pendulum turning: that takes more than about 4/π · 2ζ = 0.25


@functools.cache
def cubic_well():
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=DAMPING, spring=vk.CustomSpring("x - x**2"), noise=vk.WhiteNoise(1e-3)
    )
    return osc, vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)


@functools.cache
def pendulum(push):
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=DAMPING, spring=vk.CustomSpring("sin(x)"), noise=vk.WhiteNoise(1e-3),
        excitations=(vk.Constant(push),) if push else (),
    )  # fmt: skip
    return osc, vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)


def test_the_only_well_is_left_by_escape():
    osc, structure = cubic_well()
    assert [saddle.leads_to for saddle in structure.saddles] == [(0, ESCAPED)]
    result = QUICK.run(osc, structure)
    (energy,) = result.energies
    assert energy.value == pytest.approx(4 * DAMPING / 6, rel=1e-9)  # the barrier of x²/2 − x³/3
    assert energy.lower < 4 * DAMPING / 6 < energy.upper * (1 + 1e-12)
    assert (energy.target, result.exit_of(energy)) == (ESCAPED, "rest → escape")
    assert result.energy("rest", "escape") is energy


def test_shots_find_the_escape():
    osc, structure = cubic_well()
    found = vk.ActionPlot(points=2000, rounds=6).run(osc, structure)
    (energy,) = found.energies
    assert energy.target == ESCAPED
    assert energy.value == pytest.approx(4 * DAMPING / 6, rel=1e-3)


@pytest.mark.parametrize("push", [slow(0.0), PUSH])
def test_a_pendulum_has_one_rest_that_is_left_over_the_lower_barrier(push):
    osc, structure = pendulum(push)
    (rest,) = structure.attractors
    np.testing.assert_allclose(rest.points[0], [math.asin(push), 0.0], atol=1e-9)
    assert structure.shift == pytest.approx(2 * math.pi, rel=1e-6)
    assert [finding.code for finding in structure.findings].count(Code.SHIFTED_COPIES) == 1
    barrier = 2 * math.cos(rest.points[0, 0]) - push * (math.pi - 2 * rest.points[0, 0])
    (energy,) = QUICK.run(osc, structure).energies
    assert energy.value == pytest.approx(4 * DAMPING * barrier, rel=1e-9)
    assert energy.target == ESCAPED


def test_cells_of_a_pendulum_have_a_label_of_their_own_if_they_end_in_another_well():
    _, structure = pendulum(0.0)
    centres = structure.basins.region.cell_centres(structure.basins.labels.shape)
    labels = structure.basins.labels.ravel()
    picked = np.random.default_rng(0).choice(len(labels), 60, replace=False)
    for state, label in zip(centres[picked], labels[picked], strict=True):
        motion = scipy.integrate.solve_ivp(
            lambda _, z: (z[1], -2 * DAMPING * z[1] - math.sin(z[0])), (0, 100), state, method="DOP853", rtol=1e-9
        )  # fmt: skip
        assert (label == 0) == (abs(motion.y[0, -1]) < math.pi)
    assert set(labels.tolist()) == {0, AT_COPY}


def test_a_region_keeps_all_wells_of_a_pendulum():
    osc, _ = pendulum(0.0)
    wide = vk.find_structure(osc, region=((-9.0, 9.0), (-2.0, 2.0)), cells=(40, 40), starts=(9, 4), saddles=False)
    rests = sorted(round(float(each.points[0, 0]) / (2 * math.pi), 6) for each in wide.attractors)
    assert (wide.circle, rests[rests.index(-1.0) : rests.index(1.0) + 1]) == (False, [-1.0, 0.0, 1.0])


def test_a_second_state_between_the_tops_of_barriers_is_found():
    # Resonance of a softening well (J. M. T. Thompson, Proc. R. Soc. A 421, 195, 1989): starts near rest see one state.
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.05, spring=vk.CustomSpring("x - x**2"),
        excitations=(vk.Harmonic(amplitude=0.05, frequency=0.85),),
    )  # fmt: skip
    found = vk.find_structure(osc, saddles=False, cells=(40, 40))
    assert len(found.attractors) == 2
    for each in found.attractors:
        motion = scipy.integrate.solve_ivp(
            lambda t, z: (z[1], -0.1 * z[1] - z[0] + z[0] ** 2 + 0.05 * math.cos(0.85 * t)),
            (0, 2 * math.pi / 0.85), each.points[0], method="DOP853", rtol=1e-12, atol=1e-14,
        )  # fmt: skip
        np.testing.assert_allclose(motion.y[:, -1], each.points[0], atol=1e-9)

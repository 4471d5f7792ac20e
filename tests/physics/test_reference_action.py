"""The reference itself: against closed forms, and its own numbers of the paper's scenes recomputed on coarse grids."""

import numpy as np
import pytest

from tests.layers import long
from tests.physics import reference_action as reference
from tests.physics.reference_guesses import blended, known_sections, pieced

pytestmark = pytest.mark.slow

COARSE = 96  # elements a period; elements at the stops are 40 times shorter


@pytest.mark.parametrize(("damping", "before"), [(0.05, 45), (0.3, 10), (1.0, 10), (2.0, 10)])
def test_double_well(damping, before):
    """Without forcing ΔU = 4ζ times the barrier, 1/4."""
    model = reference.Model(damping, linear=-1.0, cubic=1.0)
    after = 12 if damping < 1 else 30  # the strongly damped saddle is left and entered slowly
    guess = blended(model, ((-1.0, 0.0), 1), ((0.0, 0.0), 1), before, 6, after, 32)
    assert reference.least(guess).action == pytest.approx(damping, rel=1e-8)


@pytest.mark.parametrize("damping", [0.05, 0.5])
@pytest.mark.parametrize("away", [(0.3, 0.0), (-0.1, 0.2)])
def test_linear_oscillator_from_its_forced_orbit(damping, away):
    """Ψ = 2ζ (δx² + δv²) for ω = 1 and unit noise, about whatever orbit the forcing keeps up."""
    model = reference.Model(damping, tones=((0.3, 0.7),), push=0.1)
    orbit = model.orbit((0.0, 0.0)), 1
    path = blended(model, orbit, orbit, 20, 1, 20, 32)
    path.nodes[-1, :2] += away
    assert reference.least(path).action == pytest.approx(2 * damping * np.dot(away, away), rel=1e-8)


def test_cut_off_and_grid_of_the_double_well():
    """Short windows and coarse grids cost action, and never gain any."""
    model = reference.Model(0.1, linear=-1.0, cubic=1.0)
    ends = ((-1.0, 0.0), 1), ((0.0, 0.0), 1)
    actions = [reference.least(blended(model, *ends, before, 4, 4, 24)).action for before in (4, 8, 16)]
    assert actions[0] > actions[1] > actions[2] >= 0.1 * (1 - 1e-9)


@pytest.mark.parametrize("frequency", [0.570, long(0.525)])
def test_clear_states(frequency):
    """From guesses that know nothing of the path."""
    model, source, target = (reference.paper(frequency), *ends(frequency, "clear"))
    guess = blended(model, source, target, 45, 3, 12, COARSE)
    check(reference.followed_in(guess, model.period / COARSE / 40), reference.ENERGIES[frequency, "clear"])


@pytest.mark.long
@pytest.mark.parametrize(("frequency", "before"), [(0.570, 24), (0.525, 16)])
def test_hammering_states(frequency, before):
    model, source, target = (reference.paper(frequency), *ends(frequency, "hammering"))
    guess = pieced(model, source, target, known_sections(frequency), COARSE, before, 6)
    check(reference.followed_in(guess, model.period / COARSE / 40), reference.ENERGIES[frequency, "hammering"])


def ends(frequency, name):
    return reference.known_orbit(frequency, name), reference.known_orbit(frequency, "saddle")


def check(path, known):
    """A coarse grid and a short window cost up to a thousandth; less than the known value would refute it."""
    value, error = known
    assert path.minimum
    assert value - error <= path.action <= value * 1.001
    # What quadrature leaves out, at most a tenth of that: the same path priced at four times as many places.
    halved = path.refined().refined()
    weights = np.diff(halved.times)[:, None] * reference.WEIGHTS
    assert 0.5 * np.sum(weights * halved.noise(halved.nodes)[0] ** 2) == pytest.approx(path.action, rel=1e-4)


def test_no_orbit_is_said():
    with pytest.raises(ValueError, match="no orbit of 1 periods"):
        reference.Model(0.0, push=1.0, tones=((1.0, 1.0),)).orbit((0.0, 0.0))

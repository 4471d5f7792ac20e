"""What the paper's two scenes do without noise, found from nothing but the scenes, and what it differs in from there.

The paper describes two states at each frequency. At ω = 0.525 there is a third, a chaotic attractor of fourteen bands
beside the hammering orbit, which steps of 1/256 of a period are too coarse to keep.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vibrokit as vk
from tests.layers import long


@pytest.fixture(scope="module")
def slower():
    osc = vk.load_scene("hertz-0.525")
    return osc, vk.find_structure(osc, cells=(40, 40), starts=(16, 16), manifolds=False)


def flow(osc, point, periods):
    """The section map by SciPy, and its derivative, with every contact located."""
    numbers = osc.parameters
    amplitude, frequency, push = (numbers[f"excitations.{path}"] for path in ("0.amplitude", "0.frequency", "1.force"))

    def rates(t, z):
        depth = np.array([z[0] - 0.5, -0.5 - z[0]]).clip(0.0)
        force = 50.0 * (depth[1] ** 1.5 - depth[0] ** 1.5)
        slope = 75.0 * np.sqrt(depth).sum()
        pull = amplitude * np.cos(frequency * t) + push - z[0] - 0.02 * z[1] + force
        deviations = z[2:].reshape(2, 2)
        return [z[1], pull, *deviations[1], *(-(1 + slope) * deviations[0] - 0.02 * deviations[1])]

    contacts = [lambda t, z, s=side: abs(z[0]) - 0.5 for side in (0,)]
    z, t, end = np.array([*point, 1.0, 0.0, 0.0, 1.0]), 0.0, periods * osc.period
    contacts[0].terminal = True
    while t < end:
        motion = solve_ivp(rates, (t, end), z, method="DOP853", rtol=1e-12, atol=1e-14, events=contacts, max_step=0.2)
        z, t = motion.y[:, -1], motion.t[-1]
        if t < end:  # step off the event, by a step too short to matter
            nudge = solve_ivp(rates, (t, t + 1e-9), z, method="DOP853", rtol=1e-12, atol=1e-14)
            z, t = nudge.y[:, -1], nudge.t[-1]
    return z[:2], z[2:].reshape(2, 2)


def test_two_states_and_one_saddle_at_0570(paper):
    _, structure = paper
    clear, hammering = structure.attractors
    assert (clear.hits, clear.period) == ({"right": 0, "left": 0}, 1)
    assert (hammering.hits, hammering.period) == ({"right": 2, "left": 0}, 1)  # the paper counts one impact
    (saddle,) = structure.saddles
    assert (saddle.kind, saddle.period, set(saddle.leads_to)) == ("saddle", 1, {0, 1})
    assert structure.survival == ()


@pytest.mark.long
def test_a_third_attractor_at_0525(slower):
    _, structure = slower
    clear, hammering, wandering = structure.attractors
    assert (clear.kind, clear.period, clear.impacts) == ("periodic", 1, 0)
    assert (hammering.kind, hammering.period, hammering.hits) == ("periodic", 4, {"right": 8, "left": 0})
    assert (wandering.kind, wandering.period) == ("chaotic", 0)
    assert wandering.exponents[0].real > 5 * wandering.exponent_error > 0
    for report in wandering.survival:  # at two accuracies
        quiet = report.periods - report.settled_after.max()
        assert report.survivors * quiet >= 200_000 or report.periods == 20_000
        assert report.survivors > report.starts / 4
    assert structure.survival[0].lifetime < 2000  # of those that settle: a long chaotic transient
    assert min(attractor.basin_fraction for attractor in structure.attractors) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", long("slower")])
def test_orbits_are_those_that_scipy_finds(request, name):
    osc, structure = request.getfixturevalue(name)
    orbits = [*(a for a in structure.attractors if a.repeats), *(s for s in structure.saddles if s.kind == "saddle")]
    assert len(orbits) >= 3
    for orbit in orbits:
        image, derivative = flow(osc, orbit.points[0], orbit.period)
        np.testing.assert_allclose(image, orbit.points[0], atol=1e-8)
        assert orbit.residual <= 1e-10
        assert orbit.error <= 1e-8
        ours, theirs = (np.sort_complex(m) for m in (orbit.multipliers, np.linalg.eigvals(derivative)))
        np.testing.assert_allclose(ours, theirs, atol=1e-5)
        # Liouville: together the multipliers are what friction leaves of an area.
        assert np.prod(orbit.multipliers).real == pytest.approx(np.exp(-0.02 * orbit.duration), rel=1e-7)

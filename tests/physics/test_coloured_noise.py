"""Least actions under noise with extra states: x″ + 0.1 x′ + x = z and first contact at x = 1, by Lyapunov's equation.

The least action to be at x = 1 is 1/(2Σ), where Σ is the stationary variance of x per unit D.
"""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

import vibrokit as vk
from tests.layers import long
from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.errors import SceneError
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.streams import streams_of
from vibrokit.registry import Group, load_all
from vibrokit.results.codes import Code
from vibrokit.results.energy import Bound
from vibrokit.symbolic.flow_kind import Flow

WHITE = 4 * 0.05 * 0.5  # 4ζω_n V(1)


def contact(noise, **more):
    stop = vk.Barrier(vk.Hertz(50.0), 1.0, "right")
    return vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, barriers=(stop,), noise=noise, **more)


def variances(flow, driven):
    """Stationary variances per unit D of y′ = A y + B W′."""
    driven = np.array(driven)
    return np.diag(solve_continuous_lyapunov(np.array(flow), -np.outer(driven, driven)))


def coloured(rate):
    return variances([[0, 1, 0], [-1, -0.1, 1], [0, 0, -rate]], [0, 0, rate])


def filtered(frequency, zeta):
    width = 2 * zeta * frequency
    flow = [[0, 1, 0, 0], [-1, -0.1, 0, 1], [0, 0, 0, frequency], [0, 0, -frequency, -width]]
    return variances(flow, [0, 0, 0, width])


def least(osc):
    structure = vk.find_structure(osc, cells=(12, 12), rng=0, saddles=False, manifolds=False)
    shooting = vk.Shooting(points=500, rounds=1)
    return vk.LeastAction(shooting=shooting, exit=vk.FirstContact()).run(osc, structure)


@pytest.mark.parametrize(("rate", "energy"), [(0.3, 0.933333), (1.0, 21 / 110), (3.0, 0.110753)])
def test_the_reference_itself(rate, energy):
    assert 0.5 / coloured(rate)[0] == pytest.approx(energy, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.3, *map(long, (1.0, 3.0, 30.0, 300.0))])
def test_first_contact_under_coloured_noise(rate):
    result = least(contact(vk.ColouredNoise(1e-3, rate)))
    (energy,) = result.energies
    assert energy.value == pytest.approx(0.5 / coloured(rate)[0], rel=1e-9)
    assert energy.lower == pytest.approx(WHITE, rel=1e-9)  # white noise of the same intensity
    assert energy.lower <= energy.value <= energy.upper
    assert energy.bound is Bound.UPPER
    assert result.found(Code.NOT_SEARCHED)


@pytest.mark.long
@pytest.mark.parametrize(("frequency", "zeta"), [(1.0, 0.02), (0.5, 0.1), (4.0, 0.3)])
def test_first_contact_under_a_narrow_band(frequency, zeta):
    (energy,) = least(contact(vk.FilteredNoise(1e-3, frequency, zeta))).energies
    assert energy.value == pytest.approx(0.5 / filtered(frequency, zeta)[0], rel=1e-8)
    assert WHITE * (1 - 1e-9) <= energy.lower <= energy.value


# --- what the methods do with such noise, as docs/how-to/noise.rst says


PAGE = (Path(__file__).parents[2] / "docs/how-to/noise.rst").read_text(encoding="utf-8")
TABLE = dict(re.findall(r"^(\S+)  +((?:yes|poor|refused)\b.*(?:\n {10,}.*)*)", PAGE, re.MULTILINE))


def test_the_table_has_every_analyzer():
    built_in = {
        name for name, kind in load_all(Group.ANALYZERS, Analyzer).items() if kind.__module__[:9] == "vibrokit."
    }
    assert set(TABLE) == built_in


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, said in TABLE.items() if said.startswith("refused")])
def test_what_is_refused_is_refused_with_the_sentence_of_the_table(name):
    osc = contact(vk.ColouredNoise(1e-3, 1.0))
    structure = vk.find_structure(osc, cells=(12, 12), rng=0, saddles=False, manifolds=False)
    (sentence,) = re.findall('"(.*)"', TABLE[name])
    with pytest.raises(SceneError, match=sentence):
        load_all(Group.ANALYZERS, Analyzer)[name](exit=vk.FirstContact()).run(osc, structure)


# --- simulation


@pytest.mark.slow
@pytest.mark.parametrize(
    ("noise", "spread"),
    [
        (vk.ColouredNoise(1e-3, 1.0), coloured(1.0)),
        (vk.ColouredNoise(1e-3, 50.0), coloured(50.0)),  # default steps follow the noise
        (vk.FilteredNoise(1e-3, 1.0, 0.1), filtered(1.0, 0.1)),
    ],
    ids=repr,
)
def test_stationary_variances(noise, spread):
    """After 30 turns a start is forgotten, as e^-9; 4096 walkers give a variance to 2.2 %."""
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, noise=noise)
    stepper, starts = ensemble_stepper(osc, Flow.NOISY), np.zeros((4096, len(spread)))
    ended = run_ensemble(osc, Flow.NOISY, stepper, starts, 30, streams=streams_of(1, np.arange(len(starts))))
    assert ended.states.var(axis=0) == pytest.approx(1e-3 * spread, rel=4 * math.sqrt(2 / 4096))

"""What the searches for structure refuse, with the words that say why."""

import math
from functools import partial

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import scene
from tests.structure.stable import saddle
from vibrokit.errors import NoSectionError, ParameterError, StructureError
from vibrokit.structure.attractors.wandering import lyapunov_exponent
from vibrokit.structure.autonomous import equilibrium_exponents, find_cycle, refine_cycle
from vibrokit.structure.manifolds import grow_manifolds
from vibrokit.structure.orbits import refine_orbit

PAPER, DUFFING, WELL = (vk.load_scene(name) for name in ("hertz-0.570", "duffing", "double-well"))
FREQUENCY, STOP = "excitations.0.frequency", "barriers.0.position"
TWO_TONES = scene(damping_ratio=0.1, excitations=(vk.Harmonic(0.1, 1.0), vk.Harmonic(0.1, 2**0.5)))
CHAOTIC = WELL.replace(excitations=(vk.Harmonic(0.5, 1.2),), damping_ratio=0.15)
FORMULA = scene(damping_ratio=0.05, spring=vk.CustomSpring("x + e*x**5", e=0.2))
SPIRAL, STEPS = scene(damping_ratio=0.001), vk.RK4(256)
VAN_DER_POL = scene(damping_ratio=0.0, spring=vk.CustomSpring("x + mu*(x**2 - 1)*v", mu=1.0))
RUNAWAY = DUFFING.replace({"spring.cubic": -0.3})

ARGUMENTS = {  # of `find_structure`
    "region": (StructureError, [((1, -1), (0, 1)), ((0, 0), (0, 1)), ((0, math.nan), (0, 1)), 3, ((0, 1),)]),
    "cells": (StructureError, [200, (0, 2), (2.5, 3), (10**6, 10**6)]),
    "starts": (StructureError, [None, (0, 0)]),
    "settling": (StructureError, [0, -1.0, "a"]),
    "budget": (StructureError, [0, -1, 1.5, True, 10**30]),
    "edge_budget": (StructureError, [0, 1.5, "a", True]),
    "time_limit": (StructureError, [0, -1.0, math.nan, "1", True]),
    "rng": (ParameterError, [-1, "x", 1.5]),
}


@pytest.mark.parametrize(
    ("name", "error", "value"), [(name, error, value) for name, (error, many) in ARGUMENTS.items() for value in many]
)
def test_arguments_of_find_structure(name, error, value):
    with pytest.raises(error, match=name):
        vk.find_structure(PAPER, **{name: value})


@pytest.mark.parametrize(
    ("osc", "given", "error", "words"),
    [
        (PAPER.replace({"damping_ratio": 0.0}), {}, StructureError, "damping"),
        (TWO_TONES, {}, NoSectionError, "no common period"),
        (CHAOTIC, {"budget": 1, "starts": (4, 4), "cells": (4, 4)}, StructureError, "raise budget"),
    ],
)
def test_scenes_without_attractors(osc, given, error, words):
    with pytest.raises(error, match=words):
        vk.find_structure(osc, **given)


@pytest.mark.parametrize(
    ("osc", "parameter", "values", "error", "words"),
    [
        (PAPER, "excitations.0.frequenc", [1.0], ParameterError, "nearest is 'excitations.0.frequency'"),
        (PAPER, 3, [1.0], ParameterError, "no parameter 3"),
        (PAPER, FREQUENCY, [], ParameterError, "one or more"),
        (PAPER, FREQUENCY, 1.0, ParameterError, "sequence of numbers"),
        (PAPER, FREQUENCY, "12", ParameterError, "sequence of numbers"),
        (PAPER, FREQUENCY, [1.0, math.nan], ParameterError, "finite numbers"),
        (PAPER, FREQUENCY, [1.0, True], ParameterError, "finite numbers"),
        (PAPER, FREQUENCY, [1.0, 2.0, 1.0], ParameterError, "1 more than once"),
        (PAPER, {}, [0.5], ParameterError, "factors"),
        (PAPER, {STOP: 1.0, FREQUENCY: 1.0}, [0.5], ParameterError, "cannot be tied"),
        (PAPER, {STOP: 0.0}, [0.5], ParameterError, "factor"),
        (PAPER, {STOP: "1"}, [0.5], ParameterError, "factor"),
        (PAPER, {STOP: 1.0, "barriers.7.position": 1.0}, [0.5], ParameterError, "barriers.7"),
        (FORMULA, "spring.formula", ["x", "x**3"], ParameterError, "shapes the equations"),
    ],
)
def test_parameters_and_values(osc, parameter, values, error, words):
    with pytest.raises(error, match=words):
        vk.continuation(osc, parameter, values)


PERIODS = [0, -1, 1.0, True, "1", None, 10**9]
STARTS = [3, (0, 1), (1.0, 2), (10**5, 10**5), None, (1, 2, 3)]
CONTINUED = partial(vk.continuation, DUFFING, FREQUENCY, [1.3, 1.4])
GROWN = partial(grow_manifolds, WELL, 0, region=((-1.0, 1.0), (-1.0, 1.0)))
SADDLE = saddle([0.0, 0.0])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (partial(CONTINUED, cells=(0, 3)), "cells"),
        (partial(CONTINUED, starts=5), "starts"),
        (partial(CONTINUED, region=((1, 0), (0, 1))), "region"),
        *((partial(vk.unstable_orbits, DUFFING, period), "period must be") for period in PERIODS),
        *((partial(vk.unstable_orbits, DUFFING, 1, starts=starts), "starts must be") for starts in STARTS),
        (partial(vk.unstable_orbits, DUFFING, 1, region=((1, -1), (0, 1))), "region"),
        (partial(vk.unstable_orbits, WELL, 2), "equilibria"),
        (partial(find_cycle, SPIRAL, np.array([1.0, 0.0]), STEPS, longest=30.0), "does not repeat within 30 s"),
        (partial(find_cycle, VAN_DER_POL, np.array([0.5, 0.0]), STEPS, longest=3.0), "does not repeat"),
        (partial(find_cycle, DUFFING, np.zeros(2), STEPS, longest=10.0), "periodic excitation"),
        (partial(refine_cycle, SPIRAL, np.array([1.0, 0.0]), 6.3, STEPS), "equilibrium"),
        (partial(equilibrium_exponents, VAN_DER_POL, np.array([0.5, 0.0])), "not an equilibrium"),
        (partial(equilibrium_exponents, DUFFING, np.zeros(2)), "periodic excitation"),
        (partial(refine_orbit, DUFFING, np.array([[30.0, 0.0], [-30.0, 50.0]]), 1, STEPS), "no orbit of period 1"),
        (partial(lyapunov_exponent, DUFFING, np.zeros((0, 2)), STEPS), "0 starts"),
        (partial(lyapunov_exponent, DUFFING, np.zeros((1, 2)), STEPS, periods=0), "over 0 periods"),
        (partial(lyapunov_exponent, RUNAWAY, np.array([[5.0, 5.0], [6.0, 6.0]]), STEPS), "all 2 trajectories ran out"),
        (partial(GROWN, saddle([1.0, 0.0])), r"multipliers of the orbit are .*, but only a saddle has manifolds"),
        (partial(GROWN, saddle([0.0, 0.0, 0.0])), r"this scene has 3 states\.$"),
        (partial(GROWN, saddle([0.0, 0.0], kind="chaotic", period=0)), r"chaotic set without an orbit\.$"),
        (partial(GROWN, saddle([0.0, 0.0], duration=3.0)), r"this is a limit cycle\.$"),
        (partial(GROWN, SADDLE, spacing=0.0), r"spacing must be a number above 0, at most 1\.0, got 0\.0\.$"),
        (partial(GROWN, SADDLE, bend=2.0), r"bend must be a number above 0, at most 1\.5, got 2\.0\.$"),
        (partial(GROWN, SADDLE, arc_length=math.nan), r"arc_length must be any number above 0, got nan\.$"),
    ],
)
def test_what_is_refused(call, words):
    with pytest.raises(StructureError, match=words):
        list(call())


@pytest.mark.parametrize("bad", [{"phases": 0}, {"phases": 1.5}, {"directions": 2}, {"directions": True}], ids=str)
def test_counts_of_kicks(paper, bad):
    with pytest.raises(StructureError, match=next(iter(bad))):
        vk.shape_stability(*paper, **bad)

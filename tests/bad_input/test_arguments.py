"""Classes, functions and methods called with arguments that they do not take, and abstract classes."""

import inspect
import math
import pickle

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.errors import ArgumentError, DerivationError, VibrokitError
from vibrokit.parts.functions import sin
from vibrokit.results.trajectory import Trajectory

SCENE = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1)

WRONG = [
    (lambda: vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, weight=2.0), "weight"),
    (lambda: vk.Harmonic(amplitude=1.0, hz=50.0), "hz"),
    (lambda: vk.WhiteNoise(psd=1.0), "psd"),
    (lambda: vk.Barrier(vk.Hertz(1.0), position=1.0, side="left", gap=1.0), "gap"),
    (lambda: vk.Hertz(stifness=1.0), "'stiffness'"),
    (lambda: vk.Order8(tolerence=1e-8), "'tolerance'"),
    (lambda: vk.RK4(256, steps=3), "steps"),
    (lambda: vk.SGCM(intensity=1e-3), "'intensities'"),
    (lambda: vk.MFET(seeds=3), "'seed'"),
    (lambda: vk.LeastAction(acuracy=0.1), "'accuracy'"),
    (lambda: vk.GraphSearch(node=(40, 40)), "'nodes'"),
    (lambda: vk.Shooting(point=100), "'points'"),
    (lambda: vk.FirstContact(sides="left"), "'side'"),
    (vk.Constant, "force"),
    (lambda: vk.find_structure(SCENE, region_=((-1, 1), (-1, 1))), "'region'"),
    (lambda: vk.find_structure(SCENE, ((-1, 1), (-1, 1))), "1 value without a name, got 2"),
    (vk.find_structure, "osc"),
    (lambda: vk.continuation(SCENE, "damping_ratio"), "values"),
    (lambda: vk.unstable_orbits(SCENE, 3, start=(8, 8)), "'starts'"),
    (lambda: vk.evolve_density(SCENE, ((-1, 1), (-1, 1)), node=(40, 40)), "'nodes'"),
    (lambda: SCENE.trajectory((0.0, 0.0), period=3), "'periods'"),
    (lambda: SCENE.trajectory((0.0, 0.0), 3, 4), "2 values without a name, got 3"),
    (SCENE.section_map, "states"),
    (vk.occupancies, "result"),
    (lambda: vk.Transitions(1), "energies, lower, upper"),
    (lambda: vk.Transitions.of(result=1), "result"),
    (lambda: vk.ExitProblem(osc=SCENE), "structure"),
    (vk.load_result, "path"),
    (lambda: vk.LeastAction().run(SCENE), "structure"),
    (lambda: vk.Finding(cod=1), "'code'"),
    (lambda: vk.CubicSpring(1.0, 2.0, 3.0), "cubic"),
]


@pytest.mark.parametrize(("make", "words"), WRONG)
def test_wrong_arguments_are_refused_with_what_is_allowed(make, words):
    with pytest.raises(ArgumentError, match=words) as raised:
        make()
    assert isinstance(raised.value, TypeError)
    assert isinstance(raised.value, VibrokitError)


class Endless(vk.Excitation):
    """Its author has forgotten the period."""

    def force(self, t):
        return t


class Undone(vk.Analyzer):
    """Its author has forgotten everything."""


@pytest.mark.parametrize(("kind", "missing"), [(Endless, "period"), (Undone, "analyze"), (vk.Spring, "force")])
def test_an_abstract_class_says_what_it_lacks(kind, missing):
    with pytest.raises(ArgumentError, match=missing):
        kind()


class Sweep(vk.Excitation):
    """A sine whose author gives the period."""

    frequency: float = vk.parameter("f", "s^-1", above=0)
    length: float = vk.parameter("T", "s", above=0)
    period = property(lambda self: self.length)

    def force(self, t):
        return sin(2 * math.pi * self.frequency * t) * (1 + sin(math.pi * self.frequency * t))


@pytest.mark.parametrize("length", [0.5, 0.75, 2.0 * math.pi, 1.001])  # right: 1
def test_a_period_after_which_the_force_does_not_repeat_is_refused(length):
    with pytest.raises(DerivationError, match=r"Sweep\.period is .*, but its force changes by .*\.$"):
        _ = SCENE.replace(excitations=(Sweep(frequency=2.0, length=length),)).model.excitations


@pytest.mark.parametrize("length", [1.0, 3.0, 1.0 + 1e-8])
def test_a_period_may_be_a_multiple_and_have_rounding_errors(length):
    assert SCENE.replace(excitations=(Sweep(frequency=2.0, length=length),)).model.excitations


class Faulty(vk.Shooting):
    def __post_init__(self):
        raise TypeError("of the class itself")


def test_errors_of_a_class_itself_are_its_own():
    with pytest.raises(TypeError, match="of the class itself") as raised:
        Faulty()
    assert not isinstance(raised.value, VibrokitError)


def test_signatures_are_those_of_the_constructors():
    assert list(inspect.signature(vk.Harmonic).parameters) == ["amplitude", "frequency", "phase"]
    assert list(inspect.signature(vk.CustomLaw).parameters) == ["formula", "constants"]
    assert pickle.loads(pickle.dumps(vk.Harmonic(1.0, 2.0))) == vk.Harmonic(1.0, 2.0)


HUGE = 10**400  # no float
WRONG_TYPES = [
    lambda: vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, barriers=np.array(3.0)),
    lambda: vk.Barrier(vk.Hertz(1.0), position=1.0, side=np.array([1, 2])),
    lambda: vk.FirstContact(side=np.array([1, 2])),
    lambda: vk.SGCM(intensities=HUGE),
    lambda: vk.MFET(intensities=np.array(3.0)),
    lambda: vk.MFET(target_error=HUGE),
    lambda: vk.MFET(splitting=np.array([])),
    lambda: vk.ActionPlot(radius=HUGE),
    lambda: vk.find_structure("hertz"),
    lambda: vk.find_structure(SCENE, settling=HUGE),
    lambda: vk.find_structure(SCENE, time_limit=HUGE),
    lambda: vk.continuation(SCENE, "damping_ratio", np.array(3.0)),
    lambda: vk.continuation(SCENE, "damping_ratio", [HUGE]),
    lambda: vk.evolve_density(SCENE.replace(noise=vk.WhiteNoise(1.0)), ((-1, 1), (-1, 1)), np.array(3.0) * np.nan),
    lambda: vk.evolve_density(SCENE.replace(noise=vk.WhiteNoise(1.0)), ((-1, 1), (-1, 1)), phase=HUGE),
    lambda: vk.unstable_orbits(SCENE, 1, classifier="basins"),
    lambda: vk.plausibility(3),
    lambda: vk.plausibility("hertz-0.570"),
    lambda: vk.occupancies(3),
    lambda: vk.Transitions.of("result"),
    lambda: vk.Transitions(3, 1, 1, 1),
    lambda: vk.Transitions(("a",), [[0.0]], [[0.0]], [[0.0]]),
    lambda: SCENE.trajectory((0.0, 0.0), 1, samples=HUGE),
    lambda: SCENE.trajectory((0.0, 0.0), 1, stepper=np.array([])),
    lambda: SCENE.section_map([[0.0, 0.0]], HUGE),
    lambda: SCENE.section_map([[0.0, 0.0]], executor="threads"),
    lambda: Trajectory(np.arange(2.0), np.zeros((2, 2)), ()).plot(ax="here"),
    lambda: vk.save_scene(SCENE, 3),
    lambda: vk.save_scene(SCENE, "a\0b"),
    lambda: vk.load_result(3),
    lambda: vk.load_result("a\0b"),
]


@pytest.mark.parametrize("call", WRONG_TYPES)
def test_values_of_wrong_types_are_refused_in_a_sentence(call):
    with pytest.raises(VibrokitError, match=r"(?s)\.$"):
        call()


def users_functions():
    """Public functions, and the methods that users call with arguments."""
    classes = [vk.Oscillator, vk.Analyzer, vk.Transitions, vk.StationaryDensity, vk.Record]
    classes += [kind for one in map(vars(vk).get, vk.__all__) if inspect.isclass(one) for kind in one.__subclasses__()]
    classes = [kind for kind in classes if kind.__module__.startswith("vibrokit.")]
    for name in vk.__all__:
        if inspect.isfunction(getattr(vk, name)):
            yield name, getattr(vk, name)
    for kind in dict.fromkeys(one for one in classes if not issubclass(one, vk.Analyzer) or one is vk.Analyzer):
        for name, value in vars(kind).items():
            if name in USED and not getattr(value, "__isabstractmethod__", False):
                yield f"{kind.__name__}.{name}", value


USED = {
    "trajectory", "section_map", "error_estimate", "run", "route", "stationary_weights", "found", "save", "energy",
    "exit_of", "plot", "attractor", "plot_orbits", "plot_paths", "plot_history", "plot_quasi_potential", "changes",
    "mean_time", "probability_of_leaving", "allowed_intensity", "occupancy", "sensitivities", "table", "shares",
    "verdicts_of",
}  # fmt: skip


@pytest.mark.parametrize(("name", "function"), list(users_functions()))
def test_every_function_of_users_refuses_a_word_that_it_does_not_know(name, function):
    with pytest.raises(ArgumentError, match="no_such_word"):
        function(no_such_word=1)
    assert "no_such_word" not in inspect.signature(function).parameters
    assert pickle.loads(pickle.dumps(vk.find_structure)) is vk.find_structure

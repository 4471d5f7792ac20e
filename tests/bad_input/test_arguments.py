"""Constructors called with arguments that they do not take, and abstract classes."""

import inspect
import pickle

import pytest

import vibrokit as vk
from vibrokit.errors import ArgumentError, VibrokitError

WRONG = [
    (lambda: vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, mass=2.0), "mass"),
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

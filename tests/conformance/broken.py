"""Parts that are wrong in one way each, and the check that must say so."""

import math
import os
from abc import ABC
from typing import ClassVar

import sympy

from vibrokit import ContactLaw, Excitation, Friction, Hertz, NoiseModel, Spring, parameter
from vibrokit.parts.functions import Rational, cos, sqrt


def unchecked(part):
    """Stand in for a `__post_init__` that forgot the range checks."""


class Law(ContactLaw, ABC):
    """A sound linear law."""

    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * depth


class Stiff(Spring, ABC):
    """A sound linear spring."""

    stiffness: float = parameter("kappa", "s^-2")

    def force(self, x, v):
        return self.stiffness * x


class Wave(Excitation, ABC):
    """A sound excitation."""

    amplitude: float = parameter("f", "m s^-2")

    def force(self, t):
        return self.amplitude * cos(t)

    @property
    def period(self):
        return 2 * math.pi


def with_formula(base, **formula):
    """A class that differs from a sound one in a single formula; its name is that of the formula's flaw."""
    (name, function), method = formula.popitem(), "amplitude" if base is NoiseModel else "force"
    return type(base)(name, (base,), {method: function, "__module__": __name__})


# -- contact laws ---------------------------------------------------------------------------------------------------


class RefusesItsRange(Law):
    def __post_init__(self):
        super().__post_init__()
        if self.stiffness > 0:
            raise ArithmeticError("too stiff for me")


class HasNoUnit(ContactLaw):
    stiffness: float

    def force(self, depth, rate):
        return self.stiffness**2 * depth


class HasNoSymbol(Law):
    stiffness: float = parameter("k of the wall", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * depth


class TakesAnything(Law):
    __post_init__ = unchecked


class UsesStrangeSymbol(Law):
    def force(self, depth, rate):
        return self.stiffness * depth * sympy.Symbol("temperature")


class HoldsAList(Law):
    def __post_init__(self):
        object.__setattr__(self, "stiffness", [self.stiffness])


class HashesItsPlace(Law):
    def __hash__(self):
        return id(self)


def class_in_a_function():
    """Return a class that no other process can find."""

    class Local(Law):
        pass

    return Local


class ForgetsInPickles(Law):
    def __reduce__(self):
        return type(self), (2 * self.stiffness,)


class TakesAnotherName(Law):
    """To be checked as an instance: its constructor does not take what it declares."""

    stiffness: float = parameter("k", "s^-2")

    def __init__(self, hardness):
        object.__setattr__(self, "stiffness", hardness)

    def force(self, depth, rate):
        return self.stiffness * depth


class DoublesWhatItIsGiven(Law):
    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "stiffness", 2 * self.stiffness)


class DependsOnTheProcess(Law):
    def force(self, depth, rate):
        return self.stiffness * depth * (1 + os.getpid())


class KelvinVoigt(ContactLaw):
    """A sound law, which jumps at first touch, and pulls at release unless it is guarded."""

    stiffness: float = parameter("k", "s^-2", above=0)
    dissipation: float = parameter("c", "s^-1", above=0)

    def force(self, depth, rate):
        return self.stiffness * depth + self.dissipation * rate


# The model derives these properties from a law and its values. No law misleads it, so that it is misled here.
MISLED = [
    ("never pulls", KelvinVoigt, {"clamped": False}),
    ("jump at first touch", KelvinVoigt, {"jumps": False}),
    ("leading power", Hertz, {"exponent": sympy.Integer(2)}),
    ("smoothness at first touch", Hertz, {"root": 1}),
]

LAWS = [
    ("construction", RefusesItsRange),
    ("symbols and units", HasNoUnit),
    ("symbols and units", HasNoSymbol),
    ("ranges", TakesAnything),
    ("formula", UsesStrangeSymbol),
    (
        "formula",
        with_formula(Law, Branches=lambda law, depth, rate: law.stiffness * depth if depth < 0.1 else depth**2),
    ),
    (
        "numbers as symbols",
        with_formula(
            Law, AsksWhatItWasGiven=lambda law, depth, rate: law.stiffness * (depth if depth.is_Symbol else depth**2)
        ),
    ),
    (
        "no force at rest at the stop",
        with_formula(Law, PushesAtRest=lambda law, depth, rate: law.stiffness * (depth + 1)),
    ),
    ("pushes back", with_formula(Law, Pulls=lambda law, depth, rate: -law.stiffness * depth)),
    (
        "pushes back",
        with_formula(Law, IsComplex=lambda law, depth, rate: law.stiffness * depth * sqrt(Rational(1, 2) - depth)),
    ),
    ("formula", with_formula(Law, Staircase=lambda law, depth, rate: law.stiffness * depth * sympy.floor(10 * depth))),
    ("formula", with_formula(Law, DoesNotCompile=lambda law, depth, rate: law.stiffness * sympy.gamma(2 + depth))),
    ("frozen", HoldsAList),
    ("frozen", HashesItsPlace),
    ("pickle", class_in_a_function()),
    ("pickle", ForgetsInPickles),
    ("parameters and back", TakesAnotherName(3.0)),
    ("parameters and back", DoublesWhatItIsGiven),
    ("another process", DependsOnTheProcess),
    ("another process", class_in_a_function()),
]


# -- springs --------------------------------------------------------------------------------------------------------


SPRINGS = [
    ("finite force", with_formula(Stiff, SpringWithAPole=lambda spring, x, v: spring.stiffness / x)),
]


# -- friction -------------------------------------------------------------------------------------------------------


class FrictionThatGrowsWithoutBound(Friction):
    magnitude: float = parameter("f", "m s^-2", minimum=0.1)

    def force(self, x, v):
        return self.magnitude / v


FRICTIONS = [("finite force", FrictionThatGrowsWithoutBound)]


# -- excitations ----------------------------------------------------------------------------------------------------


class WrongPeriod(Wave):
    frequency: float = parameter("omega", "s^-1", above=0)

    def force(self, t):
        return self.amplitude * cos(self.frequency * t)

    @property
    def period(self):
        return math.pi / self.frequency


class SaysItIsConstant(Wave):
    @property
    def period(self):
        return None


class NegativePeriod(Wave):
    @property
    def period(self):
        return -2 * math.pi


class NoPeriod(Wave):
    @property
    def period(self):
        return self.frequency


EXCITATIONS = [
    ("period", WrongPeriod),
    ("period", SaysItIsConstant),
    ("period", NegativePeriod),
    ("period", NoPeriod),
    ("formula", with_formula(Wave, DependsOnTheState=lambda wave, t: wave.amplitude * sympy.Symbol("x", real=True))),
    ("finite force", with_formula(Wave, Spike=lambda wave, t: wave.amplitude / sympy.sin(t))),
]


# -- noise models ---------------------------------------------------------------------------------------------------


class TakesNegativeIntensity(NoiseModel):
    intensity: float = parameter("D", "m^2 s^-3")

    def amplitude(self, x, v):
        return 1


class CountsIntensityTwice(NoiseModel):
    def amplitude(self, x, v):
        return self.intensity**0.5


class LacksARate(NoiseModel):
    extra_states: ClassVar = ("y", "w")

    rate: float = parameter("r", "s^-1", above=0)

    def amplitude(self, x, v):
        return 1

    def force(self, y, w):
        return w

    def drift(self, x, v, y, w):
        return (-self.rate * w,)


class StateNamedTwice(NoiseModel):
    extra_states: ClassVar = ("x",)

    def amplitude(self, x, v):
        return 1

    def drift(self, x, v, y):
        return (-y,)


ImaginaryAmplitude = with_formula(NoiseModel, ImaginaryAmplitude=lambda noise, x, v: sqrt(x))

NOISE_MODELS = [
    ("intensity", TakesNegativeIntensity),
    ("intensity", CountsIntensityTwice),
    ("finite amplitude", ImaginaryAmplitude),
    ("finite amplitude", with_formula(NoiseModel, InfiniteAmplitude=lambda noise, x, v: 1 / x)),
    ("diffusion", ImaginaryAmplitude),
    ("extra states", LacksARate),
    ("extra states", StateNamedTwice),
]

"""Parts that are wrong in one way each, and the check that must say so."""

import math
import os
from typing import ClassVar

import sympy

from vibrokit import ContactLaw, Excitation, Hertz, NoiseModel, Spring, parameter
from vibrokit.parts.functions import Rational, cos, sqrt


def unchecked(part):
    """Stand in for a `__post_init__` that forgot the range checks."""


# -- contact laws ---------------------------------------------------------------------------------------------------


class RefusesItsRange(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def __post_init__(self):
        super().__post_init__()
        if self.stiffness > 0:
            raise ArithmeticError("too stiff for me")

    def force(self, depth, rate):
        return self.stiffness * depth


class HasNoUnit(ContactLaw):
    stiffness: float

    def force(self, depth, rate):
        return self.stiffness**2 * depth


class HasNoSymbol(ContactLaw):
    stiffness: float = parameter("k of the wall", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * depth


class TakesAnything(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    __post_init__ = unchecked

    def force(self, depth, rate):
        return self.stiffness * depth


class UsesStrangeSymbol(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * depth * sympy.Symbol("temperature")


class Branches(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * depth if depth < 0.1 else self.stiffness * depth**2


class AsksWhatItWasGiven(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * (depth if depth.is_Symbol else depth**2)


class PushesAtRest(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * (depth + 1)


class Pulls(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return -self.stiffness * depth


class IsComplex(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * depth * sqrt(Rational(1, 2) - depth)


class Staircase(ContactLaw):
    """SymPy has no derivative of it."""

    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * depth * (1 + sympy.floor(10 * depth))


class _Ramp(sympy.Function):
    """A function with a wrong derivative: that of x² is said to be x."""

    _imp_ = staticmethod(lambda x: x * x)

    def fdiff(self, argindex=1):
        return self.args[0]


class WrongSlope(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * _Ramp(depth)


class DoesNotCompile(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * sympy.gamma(2 + depth)


class _Inflated(sympy.Function):
    """A function whose printed code is not what it is."""

    _imp_ = staticmethod(lambda x: x)

    def fdiff(self, argindex=1):
        return sympy.Integer(1)

    def _pythoncode(self, printer):
        return f"(1.000001*{printer._print(self.args[0])})"


class CompilesToSomethingElse(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        return self.stiffness * _Inflated(depth)


class HoldsAList(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def __post_init__(self):
        object.__setattr__(self, "stiffness", [self.stiffness])

    def force(self, depth, rate):
        return self.stiffness * depth


class HashesItsPlace(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def __hash__(self):
        return id(self)

    def force(self, depth, rate):
        return self.stiffness * depth


def class_in_a_function():
    """Return a class that no other process can find."""

    class Local(ContactLaw):
        stiffness: float = parameter("k", "s^-2", minimum=0)

        def force(self, depth, rate):
            return self.stiffness * depth

    return Local


class ForgetsInPickles(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def __reduce__(self):
        return type(self), (2 * self.stiffness,)

    def force(self, depth, rate):
        return self.stiffness * depth


class TakesAnotherName(ContactLaw):
    """To be checked as an instance: its constructor does not take what it declares."""

    stiffness: float = parameter("k", "s^-2")

    def __init__(self, hardness):
        object.__setattr__(self, "stiffness", hardness)

    def force(self, depth, rate):
        return self.stiffness * depth


class DoublesWhatItIsGiven(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "stiffness", 2 * self.stiffness)

    def force(self, depth, rate):
        return self.stiffness * depth


class DependsOnTheProcess(ContactLaw):
    stiffness: float = parameter("k", "s^-2", minimum=0)

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
    ("formula", Branches),
    ("numbers as symbols", AsksWhatItWasGiven),
    ("no force at rest at the stop", PushesAtRest),
    ("pushes back", Pulls),
    ("pushes back", IsComplex),
    ("derivatives", Staircase),
    ("derivatives", WrongSlope),
    ("compiled", DoesNotCompile),
    ("compiled", CompilesToSomethingElse),
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


class SpringOfStrangeSymbol(Spring):
    stiffness: float = parameter("kappa", "s^-2")

    def force(self, x, v):
        return self.stiffness * x * sympy.Symbol("temperature")


class SpringWithAPole(Spring):
    stiffness: float = parameter("kappa", "s^-2")

    def force(self, x, v):
        return self.stiffness / x


class SpringOfWrongSlope(Spring):
    stiffness: float = parameter("kappa", "s^-2")

    def force(self, x, v):
        return self.stiffness * _Ramp(x)


class SpringThatDoesNotCompile(Spring):
    stiffness: float = parameter("kappa", "s^-2")

    def force(self, x, v):
        return self.stiffness * sympy.gamma(2 + x)


class SpringOfAProcess(Spring):
    stiffness: float = parameter("kappa", "s^-2")

    def force(self, x, v):
        return self.stiffness * x * (1 + os.getpid())


class SpringThatForgets(Spring):
    stiffness: float = parameter("kappa", "s^-2")

    def __reduce__(self):
        return type(self), (2 * self.stiffness,)

    def force(self, x, v):
        return self.stiffness * x


class SpringThatDoubles(Spring):
    stiffness: float = parameter("kappa", "s^-2")

    def __post_init__(self):
        super().__post_init__()
        object.__setattr__(self, "stiffness", 2 * self.stiffness)

    def force(self, x, v):
        return self.stiffness * x


SPRINGS = [
    ("formula", SpringOfStrangeSymbol),
    ("finite force", SpringWithAPole),
    ("derivatives", SpringOfWrongSlope),
    ("compiled", SpringThatDoesNotCompile),
    ("pickle", SpringThatForgets),
    ("parameters and back", SpringThatDoubles),
    ("another process", SpringOfAProcess),
]


# -- excitations ----------------------------------------------------------------------------------------------------


class WrongPeriod(Excitation):
    amplitude: float = parameter("f", "m s^-2")
    frequency: float = parameter("omega", "s^-1", above=0)

    def force(self, t):
        return self.amplitude * cos(self.frequency * t)

    @property
    def period(self):
        return math.pi / self.frequency


class SaysItIsConstant(Excitation):
    amplitude: float = parameter("f", "m s^-2")

    def force(self, t):
        return self.amplitude * cos(t)

    @property
    def period(self):
        return None


class NegativePeriod(Excitation):
    amplitude: float = parameter("f", "m s^-2")

    def force(self, t):
        return self.amplitude * cos(t)

    @property
    def period(self):
        return -2 * math.pi


class NoPeriod(Excitation):
    amplitude: float = parameter("f", "m s^-2")

    def force(self, t):
        return self.amplitude * cos(t)

    @property
    def period(self):
        return self.frequency


class DependsOnTheState(Excitation):
    amplitude: float = parameter("f", "m s^-2")

    def force(self, t):
        return self.amplitude * sympy.Symbol("x", real=True) * cos(t)

    @property
    def period(self):
        return 2 * math.pi


class Spike(Excitation):
    amplitude: float = parameter("f", "m s^-2")

    def force(self, t):
        return self.amplitude / sympy.sin(t)

    @property
    def period(self):
        return 2 * math.pi


class Uncompiled(Excitation):
    amplitude: float = parameter("f", "m s^-2")

    def force(self, t):
        return self.amplitude * sympy.gamma(2 + cos(t))

    @property
    def period(self):
        return 2 * math.pi


EXCITATIONS = [
    ("period", WrongPeriod),
    ("period", SaysItIsConstant),
    ("period", NegativePeriod),
    ("period", NoPeriod),
    ("formula", DependsOnTheState),
    ("finite force", Spike),
    ("compiled", Uncompiled),
]


# -- noise models ---------------------------------------------------------------------------------------------------


class TakesNegativeIntensity(NoiseModel):
    intensity: float = parameter("D", "m^2 s^-3")

    def amplitude(self, x, v):
        return 1


class ImaginaryAmplitude(NoiseModel):
    def amplitude(self, x, v):
        return sqrt(x)


class InfiniteAmplitude(NoiseModel):
    def amplitude(self, x, v):
        return 1 / x


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


class WrongAmplitudeSlope(NoiseModel):
    def amplitude(self, x, v):
        return _Ramp(v)


class UncompiledAmplitude(NoiseModel):
    def amplitude(self, x, v):
        return sympy.gamma(2 + v)


NOISE_MODELS = [
    ("intensity", TakesNegativeIntensity),
    ("finite amplitude", ImaginaryAmplitude),
    ("finite amplitude", InfiniteAmplitude),
    ("diffusion", ImaginaryAmplitude),
    ("extra states", LacksARate),
    ("extra states", StateNamedTwice),
    ("derivatives", WrongAmplitudeSlope),
    ("compiled", UncompiledAmplitude),
]

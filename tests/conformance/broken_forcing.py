"""Excitations that are wrong in time and the check that must say so; sound parts that are hard to check."""

import math
from typing import ClassVar

from sympy import Mod, Piecewise, Rational, cos, pi

import vibrokit as vk


class TwiceThePeriod(vk.Excitation):
    """Repeats twice in what it says is its period, so that a motion of that period has the name of a longer one."""

    amplitude: float = vk.parameter("f", "m s^-2", above=0)
    repeat: float = vk.parameter("T", "s", above=0)

    def force(self, t):
        return self.amplitude * Piecewise((1, Mod(2 * t / self.repeat, 1) < Rational(1, 3)), (0, True))

    @property
    def period(self):
        return self.repeat


class JumpsTooEarly(vk.Excitation):
    """A square wave whose period has four digits, so that its jumps come earlier from period to period."""

    amplitude: float = vk.parameter("f", "m s^-2", above=0)
    frequency: float = vk.parameter("omega", "s^-1", above=0)

    def force(self, t):
        return self.amplitude * Piecewise((1, Mod(self.frequency * t, 6.283185307179586) < 3.0), (-1, True))

    @property
    def period(self):
        return 6.3 / self.frequency


class TooShortABlow(vk.Excitation):
    """A blow shorter than steppers look for: they miss its impulse."""

    impulse: float = vk.parameter("J", "m s^-1", above=0)
    repeat: float = vk.parameter("T", "s", above=0)

    def force(self, t):
        share = Mod(t / self.repeat - Rational(3, 10), 1)
        return 200_000 * self.impulse / self.repeat * Piecewise((1, share < Rational(1, 200_000)), (0, True))

    @property
    def period(self):
        return self.repeat


class VariesFaster(vk.Excitation):
    """A stiffness that varies twice in what it says is its period."""

    stiffness: float = vk.parameter("kappa", "s^-2", above=0)
    frequency: float = vk.parameter("omega", "s^-1", above=0)

    def force(self, t, x, v):
        return -self.stiffness * cos(2 * self.frequency * t) * x

    @property
    def period(self):
        return 2 * math.pi / self.frequency


class VariesSlower(vk.Excitation):
    """A stiffness that has not yet repeated after what it says is its period."""

    stiffness: float = vk.parameter("kappa", "s^-2", above=0)
    frequency: float = vk.parameter("omega", "s^-1", above=0)

    def force(self, t, x, v):
        return -self.stiffness * cos(self.frequency * t / 2) * x**3

    @property
    def period(self):
        return 2 * math.pi / self.frequency


EXCITATIONS = [
    ("period", VariesFaster),
    ("period", VariesSlower),
    ("period", TwiceThePeriod),
    ("period", JumpsTooEarly),
    ("motion", TooShortABlow),
]


class SquareWave(vk.Excitation):
    """Sound: it jumps twice in a period that is rounded, at 0 and inside."""

    amplitude: float = vk.parameter("f", "m s^-2", above=0)
    frequency: float = vk.parameter("omega", "s^-1", above=0)
    share: float = vk.parameter("d", "", above=0, maximum=1)

    def force(self, t):
        on = Mod(self.frequency * t / (2 * pi), 1) < self.share
        return self.amplitude * Piecewise((1, on), (0, True))

    @property
    def period(self):
        return 2 * math.pi / self.frequency


class NarrowBand(vk.NoiseModel):
    """Sound: two extra states, of which the white noise drives the second, in a motion that also feeds them."""

    extra_states: ClassVar = ("y", "w")

    frequency: float = vk.parameter("Omega", "s^-1", above=0)
    feed: float = vk.parameter("c", "s^-1", default=0.3)

    def amplitude(self, x, v):
        return self.frequency**2

    def force(self, y, w):
        return y

    def drift(self, x, v, y, w):
        return w, -(self.frequency**2) * y - self.frequency / 5 * w + self.feed * v

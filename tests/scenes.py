"""Scenes and parts that several tests use."""

from __future__ import annotations

from typing import ClassVar

import vibrokit as vk


def scene(*stops, **more):
    """ω_n = 1, ζ = 0.01, with some stops; anything can be changed by name."""
    return vk.Oscillator(**{"natural_frequency": 1.0, "damping_ratio": 0.01, "barriers": stops} | more)


def impacting(**more):
    """The paper's oscillator: Hertz stops on both sides, forced; its noise is stronger."""
    stops = vk.Barrier(vk.Hertz(50.0), 0.5, "right"), vk.Barrier(vk.Hertz(50.0), -0.5, "left")
    return scene(
        *stops, **{"excitations": (vk.Harmonic(0.18, 0.57), vk.Constant(0.2)), "noise": vk.WhiteNoise(1e-3)} | more
    )


def double_well(stiffening=1.0, *, damping_ratio=0.05, **more):
    """x″ + 2ζ x′ − x + x³ = 0."""
    return scene(damping_ratio=damping_ratio, spring=vk.CubicSpring(linear=-1.0, cubic=stiffening), **more)


class Coloured(vk.NoiseModel):
    """Ornstein–Uhlenbeck noise: white noise through a low pass, with a state of its own."""

    extra_states: ClassVar = ("y",)

    rate: float = vk.parameter("r", "s^-1", above=0)

    def amplitude(self, x, v):
        return self.rate

    def force(self, y):
        return y

    def drift(self, x, v, y):
        return (-self.rate * y,)


class Coupled(vk.NoiseModel):
    """Noise through a low pass that the motion feeds, too."""

    extra_states: ClassVar = ("y",)

    rate: float = vk.parameter("a", "s^-1", above=0)

    def amplitude(self, x, v):
        return 2

    def force(self, y):
        return y

    def drift(self, x, v, y):
        return (-self.rate * y + v / 5,)

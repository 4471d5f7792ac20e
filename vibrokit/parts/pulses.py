"""Trains of pulses, each of one impulse."""

from __future__ import annotations

from typing import Any, Self

from vibrokit.errors import ParameterError
from vibrokit.parts.excitation import Excitation
from vibrokit.parts.functions import Max, Min, Mod
from vibrokit.parts.parameter import Parameter, parameter

_SHORTEST = 1 / 30_000  # of a period: steps are not made for shorter pulses
_HEIGHT = Parameter("height", "height", "h", "m s^-2")
_NO_TIME = 1e-90  # so that an edge without duration divides by no zero


class PulseTrain(Excitation):
    """Equal pulses of the impulse J, one in each period: rectangular, or smooth with edges u²(3 − 2u).

    The height is J/w whatever the edges are, because w is the width at half the height.

    Parameters
    ----------
    impulse : float
        J: time integral of the force of one pulse, in m s⁻¹.
    period : float
        T: time from one pulse to the next, in s, positive.
    width : float
        w: width at half the height, in s, at least T/30 000, and with r at most T.
    rise : float
        r: time in which the force rises, and in which it falls, in s, from 0 (rectangular pulses) to w (bells).
    delay : float
        t_0: time at which one pulse begins, in s.
    """

    impulse: float = parameter("J", "m s^-1", mass_power=1)
    repeat: float = parameter("T", "s", above=0, name="period")
    width: float = parameter("w", "s", above=0)
    rise: float = parameter("r", "s", minimum=0, default=0.0)
    delay: float = parameter("t_0", "s", default=0.0)

    def __init__(self, impulse: float, period: float, width: float, rise: float = 0.0, delay: float = 0.0) -> None:
        for field, value in zip(self._declared, (impulse, period, width, rise, delay), strict=True):
            object.__setattr__(self, field.attribute, value)
        self.__post_init__()

    def __post_init__(self) -> None:
        super().__post_init__()
        least, most = _SHORTEST * self.repeat, self.repeat - self.rise
        if not least <= self.width <= most:
            allowed = f"from 1/30000 of the period to the period without the rise, {least:g} to {most:g}"
            raise ParameterError(f"PulseTrain: width must be {allowed}, got {self.width:g}.")
        if self.rise > self.width:
            raise ParameterError(f"PulseTrain: rise must be at most the width, {self.width:g}, got {self.rise:g}.")

    @classmethod
    def of_height(cls, height: float, period: float, width: float, rise: float = 0.0, delay: float = 0.0) -> Self:
        """Return a train of pulses of a height (m s⁻²), whose impulse is height times width."""
        duration = next(one for one in cls._declared if one.name == "width").known("PulseTrain", width)
        return cls(_HEIGHT.known("PulseTrain", height) * duration, period, width, rise, delay)

    def force(self, t: Any) -> Any:
        """Force at time t: up to J/w and back in every period."""
        since = Mod(t - self.delay, self.repeat)
        return self.impulse / self.width * (self._edge(since) - self._edge(since - self.width))

    def _edge(self, since: Any) -> Any:
        """From 0 to 1 within the time of rise."""
        share = Max(0, Min(1, since / (self.rise + _NO_TIME)))
        return share**2 * (3 - 2 * share)

    @property
    def period(self) -> float:
        """Period T (s)."""
        return self.repeat

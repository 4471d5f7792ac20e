"""The time after which several excitations repeat together, and the whole-number ratios near those that have none."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

from vibrokit.construction import called
from vibrokit.errors import NoSectionError, ParameterError
from vibrokit.parts.parameter import Parameter

MOST_CYCLES = 1000
"""Of the slowest excitation in a common period, and of any other in one cycle of the slowest."""
_FREQUENCY = Parameter("frequency", "frequency", "omega", "rad s^-1", above=0)
_SAME = 1e-12  # relative difference of equal ratios
_OFFERED = (1e-2, 1e-3, 1e-4)  # errors, for each of which the shortest section is offered


class Ratio(NamedTuple):
    """A ratio of whole numbers near that of two frequencies.

    Attributes
    ----------
    slow, fast : int
        Cycles of the slower and the faster excitation in one section.
    error : float
        Relative change of the ratio slow/fast, positive if the whole numbers have the larger ratio.
    section : float
        Time between sections (s) if the period of the slower excitation stays.
    """

    slow: int
    fast: int
    error: float
    section: float

    def __str__(self) -> str:
        """One line, for people."""
        off = f"off by {abs(self.error):.1e}" if abs(self.error) > _SAME else "exact"
        return f"{self.slow}/{self.fast} ({off}, a section of {self.section:.4g} s)"


@called
def common_ratios(first: float, second: float) -> tuple[Ratio, ...]:
    """Return ratios of whole numbers near that of two frequencies, each nearer and with a longer section than the last.

    They are the best rational approximations (of the first kind), which a continued fraction has among its convergents
    and between them, up to 1000 cycles of the slower excitation.

    Parameters
    ----------
    first, second : float
        Frequencies in rad s⁻¹, or with their unit (``"65 Hz"``), positive, in any order.

    Returns
    -------
    tuple of Ratio

    Raises
    ------
    ParameterError
        A frequency is not a positive number, or one is more than 1000 times the other.

    Examples
    --------
    >>> print(common_ratios(2 * math.pi * 65.0, 2 * math.pi * 91.3)[3])
    5/7 (off by 3.3e-03, a section of 0.07692 s)
    """
    slow, fast = sorted(_FREQUENCY.known("common_ratios", value) for value in (first, second))
    if fast > MOST_CYCLES * slow or math.isinf(2 * math.pi / slow):
        raise ParameterError(
            f"common_ratios: one frequency may be at most {MOST_CYCLES} times the other, got {slow:g} and {fast:g}."
        )
    return _ratios(2 * math.pi / slow, 2 * math.pi / fast)


@functools.lru_cache(maxsize=256)
def _ratios(longest: float, period: float) -> tuple[Ratio, ...]:
    exact, found, nearest = period / longest, list[Ratio](), math.inf
    for slow in range(1, MOST_CYCLES + 1):
        fast = round(slow / exact)
        error = slow / fast / exact - 1
        if abs(error) < nearest - _SAME:
            nearest = abs(error)
            found.append(Ratio(slow, fast, error, slow * longest))
    return tuple(found)


def common_period(periods: Sequence[float]) -> float:
    """Return the common period (s) of excitations of some periods; raises NoSectionError if there is none."""
    longest = max(periods)
    if math.isinf(longest):
        raise NoSectionError(
            "scene: an excitation never repeats, so there is no section; give every excitation a finite period, or "
            "follow the motion with trajectory(state, duration=...)."
        )
    multiple = 1
    for period in periods:
        ratio = Fraction(longest / period).limit_denominator(MOST_CYCLES)
        if ratio > MOST_CYCLES or not math.isclose(float(ratio), longest / period, rel_tol=_SAME):
            raise NoSectionError(
                f"scene: excitations of periods {longest:.10g} and {period:.10g} have no common period, so there is "
                f"no section; {_offer(longest, period)}give frequencies whose ratio is one of whole numbers up to "
                f"{MOST_CYCLES}."
            )
        multiple = math.lcm(multiple, ratio.denominator)
    return longest * multiple


def _offer(longest: float, period: float) -> str:
    """The shortest section for each of some errors, in words."""
    if longest > MOST_CYCLES * period:
        return ""
    ratios = _ratios(longest, period)
    near = [next((one for one in ratios if abs(one.error) <= most), ratios[-1]) for most in _OFFERED]
    return f"near the ratio of their frequencies are {', '.join(map(str, dict.fromkeys(near)))}; "

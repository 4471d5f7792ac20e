"""Follows a family of steady motions from one value of a parameter to another, and notes what happens on the way."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import VibrokitError
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.structure.tracing.bifurcations import Located, Stage, bifurcations_between, grazing_ahead, stage
from vibrokit.structure.tracing.families import FAMILIES, Family, Member

_MOST_STEPS = 800
_LONGEST = 0.01  # share of the region's size that a motion may move in one step
_SHORTEST = 1e-6  # the same, below which a family counts as lost
_ASTRAY = 0.3  # share of a step that Newton's method may correct
_FAR = 0.01  # share of the region's size that it may correct, whatever the step
_NARROW = 1e-3  # length of a step in which a bifurcation may stay bracketed
_STRAIGHT = 0.9  # least cosine of the angle between one tangent and the next

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Followed:
    """Where a family led.

    Attributes
    ----------
    end : Member or None
        At the value it was followed to; None if it does not reach it.
    stable : bool
        Whether the end is.
    bifurcations : tuple of Located
    """

    end: Member | None
    stable: bool
    bifurcations: tuple[Located, ...]


def family_of(
    osc: Oscillator, path: str, attractor: Attractor, start: float, target: float, size: Array, stepper: Stepper
) -> Family:
    """Return the family that an attractor at a value of the parameter belongs to.

    Parameters
    ----------
    osc : Oscillator
    path : str
    attractor : Attractor
        One that repeats.
    start, target : float
        Its value of the parameter, and that to which it will be followed.
    size : array (2,)
        Width of the region in x and in v.
    stepper : Stepper
    """
    point = attractor.points[0]
    sizes = np.append(size, np.full(len(point) - 2, size[1]))
    if attractor.kind == "limit cycle":
        sizes[1] = attractor.duration
    span, middle = abs(target - start), 0.5 * (start + target)
    return FAMILIES[attractor.kind](osc, path, attractor.period, sizes, span, middle, stepper)


def follow(family: Family, attractor: Attractor, start: float, target: float) -> Followed:
    """Follow a family by pseudo-arclength continuation until the target, or until it turns back.

    H. B. Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems", 1977.
    """
    unknowns = attractor.points[0].copy()
    if family.kind == "limit cycle":
        unknowns[1] = attractor.duration
    ahead = np.append(np.zeros(len(unknowns)), math.copysign(1.0, target - start))
    across = np.abs(ahead)
    try:
        first = family.corrected(family.place_of(unknowns, start), np.zeros(len(unknowns)), across)
        here = stage(family, first, ahead)
    except VibrokitError:
        return Followed(None, False, ())
    found: list[Located] = []
    length = 1.0
    for _ in range(_MOST_STEPS):
        guess, normal, arriving = _predicted(here, length, target / family.span, across)
        length = float(np.linalg.norm(guess - here.member.place))
        there = _step(family, here, guess, normal)
        passed = bifurcations_between(family, here, there) if there else []
        if there is None or (length > _NARROW and any(one.bracketed for one in passed)):
            length /= 2
            if length < _SHORTEST:
                found += grazing_ahead(family, here)
                break
            continue
        found += passed
        if there.tangent @ ahead < 0:
            break
        if arriving:
            return Followed(there.member, there.stable, tuple(found))
        here, length = there, 2 * length
    return Followed(None, False, tuple(found))


def _predicted(here: Stage, length: float, target: float, across: Array) -> tuple[Array, Array, bool]:
    """A guess along the tangent, the plane to look for the family in, and whether it is the plane of the target."""
    place, tangent = here.member.place, here.tangent
    reach = min(length, _LONGEST / max(float(np.linalg.norm(tangent[:-1])), 1e-300))
    left = (target - place[-1]) / tangent[-1] if tangent[-1] else math.inf
    if not 0 < left <= 1.01 * reach:
        return place + reach * tangent, tangent, False
    guess = place + left * tangent
    guess[-1] = target
    return guess, across, True


def _step(family: Family, here: Stage, guess: Array, normal: Array) -> Stage | None:
    """The next stage, or None if the step was too long for it."""
    length = float(np.linalg.norm(guess - here.member.place))
    try:
        there = stage(family, family.corrected(guess, here.slope, normal), here.tangent)
    except VibrokitError:
        return None
    astray = float(np.linalg.norm(there.member.place - guess))
    straight = there.tangent @ here.tangent >= _STRAIGHT
    if astray > min(_ASTRAY * length, _FAR) or not straight or family.closes_early(there.member):
        return None
    return there

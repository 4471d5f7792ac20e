"""Follows a family of steady motions from one value of a parameter to another, and records its bifurcations."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import VibrokitError
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.structure.parameter_values import ParameterLine
from vibrokit.structure.tracing.bifurcations import Located, Stage, bifurcations_between, grazing_ahead
from vibrokit.structure.tracing.families import FAMILIES, Family, Member

_LONGEST = 0.01  # fraction of the region's size that a motion may move in one step

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Followed:
    """The bifurcations of a family, and its last member, if it reaches the target."""

    end: Member | None
    stable: bool
    bifurcations: tuple[Located, ...]


@dataclasses.dataclass(frozen=True, eq=False)
class Follower:
    """Follows families of steady motions along a parameter, by pseudo-arclength continuation.

    The method is that of H. B. Keller, "Numerical solution of bifurcation and nonlinear eigenvalue problems", 1977.
    """

    osc: Oscillator
    line: ParameterLine
    size: Array  # (2,), width of the region in x and in v
    stepper: Stepper

    def at(self, value: float) -> Oscillator:
        """Return the scene at a value of the parameter."""
        return self.line.at(self.osc, value)

    def follow(self, attractor: Attractor, start: float, target: float) -> Followed:
        """Follow the family of an attractor that repeats, until the parameter reaches the target or turns back."""
        unknowns = attractor.points[0].copy()
        sizes = np.append(self.size, np.full(len(unknowns) - 2, self.size[1]))
        if attractor.kind == "limit cycle":
            unknowns[1] = sizes[1] = attractor.duration
        span, middle = abs(target - start), 0.5 * (start + target)
        family = FAMILIES[attractor.kind](self.osc, self.line, attractor.period, sizes, span, middle, self.stepper)
        ahead = np.append(np.zeros(len(unknowns)), math.copysign(1.0, target - start))
        try:
            place = np.append(unknowns / sizes, start / span)
            here = Stage.of(family.corrected(place, np.zeros(len(unknowns)), np.abs(ahead)), ahead)
        except VibrokitError:
            return Followed(None, False, ())
        return _followed(here, target, ahead)


def _followed(here: Stage, target: float, ahead: Array) -> Followed:
    """Go on from a stage in steps that are halved where they fail and doubled where they do not."""
    family, found, length = here.member.family, list[Located](), 1.0
    for _ in range(800):
        guess, normal, arriving = _predicted(here, length, target / family.span, np.abs(ahead))
        length = float(np.linalg.norm(guess - here.member.place))
        there = _step(family, here, guess, normal)
        passed = bifurcations_between(here, there) if there else []
        if there is None or (length > 1e-3 and any(one.bracketed for one in passed)):
            length /= 2
            if length < 1e-6:  # the family is lost
                found += grazing_ahead(here)
                break
            continue
        found += passed
        if there.tangent @ ahead < 0:
            break
        if arriving:
            return Followed(there.member, there.member.stable, tuple(found))
        here, length = there, 2 * length
    return Followed(None, False, tuple(found))


def _predicted(here: Stage, length: float, target: float, across: Array) -> tuple[Array, Array, bool]:
    """Return a guess along the tangent, the plane to search for the family in, and whether that is the target's."""
    place, tangent = here.member.place, here.tangent
    reach = min(length, _LONGEST / max(float(np.linalg.norm(tangent[:-1])), 1e-300))
    left = (target - place[-1]) / tangent[-1] if tangent[-1] else math.inf
    if not 0 < left <= 1.01 * reach:
        return place + reach * tangent, tangent, False
    guess = place + left * tangent
    guess[-1] = target
    return guess, across, True


def _step(family: Family, here: Stage, guess: Array, normal: Array) -> Stage | None:
    """Return the next stage, or None if the step was too long for it."""
    length = float(np.linalg.norm(guess - here.member.place))
    try:
        there = Stage.of(family.corrected(guess, here.member.slope, normal), here.tangent)
    except VibrokitError:
        return None
    astray = float(np.linalg.norm(there.member.place - guess))
    straight = there.tangent @ here.tangent >= 0.9
    if astray > min(0.3 * length, _LONGEST) or not straight or family.closes_early(there.member):
        return None
    return there

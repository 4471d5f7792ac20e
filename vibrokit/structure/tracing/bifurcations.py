"""Bifurcations: what changes between two neighbouring members of a family, and where."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from vibrokit.errors import VibrokitError
from vibrokit.results.continuation import GRAZING
from vibrokit.structure.tracing.families import FOLD, HOPF, TORUS, Family, Member
from vibrokit.structure.tracing.turns import NEXT_TO, Surface, surfaces_of, turns_at

_CROSSING = "pitchfork or transcritical"
_JUST_AHEAD = 1e-3  # in units of the span: how far ahead a grazing may lie, and how far back an extrapolation begins
_SHARP = 1e-13  # fraction of a step that roots are found to

Array = NDArray[np.float64]
Test = Callable[[Member], float]
"""A function that is 0 at a bifurcation."""


@dataclasses.dataclass(frozen=True, eq=False)
class Stage:
    """A member of a family, with what depends on the way there."""

    member: Member
    tangent: Array  # (n + 1,), of the family, in the direction of travel
    reaches: Mapping[Surface, Array]  # at the turns towards each surface, the farthest first; negative short of it

    @classmethod
    def of(cls, member: Member, ahead: Array) -> Stage:
        """Evaluate a member; `ahead` is the direction of travel. A VibrokitError is raised where motion diverges."""
        osc = member.family.at(member.value)
        return cls(member, member.tangent(ahead), turns_at(member, osc, surfaces_of(osc)))


@dataclasses.dataclass(frozen=True, eq=False)
class Located:
    """A bifurcation of a family.

    Its error is how far its value moves when the integration is tightened; where it is only known to lie between two
    members, half their distance; where it can be approached from one side only, how far the nearest member is.
    """

    kind: str
    value: float  # of the parameter
    error: float
    period: int  # of the orbit, in forcing periods; for a period doubling, of the orbit that doubles
    point: Array  # (n,), of the orbit, on the section
    side: str = ""  # for grazing, of the stop
    bracketed: bool = False  # whether it is only known to lie between two members


def bifurcations_between(before: Stage, after: Stage) -> list[Located]:
    """Locate the bifurcations of a family of attractors between two members; those of unstable motion are left out."""
    if not (before.member.stable or after.member.stable):
        return []
    found, interval = [], _Interval(before.member.family, before, after)
    for name, value in before.member.tests.items():
        if value * after.member.tests[name] < 0:
            found.append(interval.located(name, _test(name)))
    for surface in before.reaches:
        counts = sorted(int(np.sum(each.reaches[surface] > 0)) for each in (before, after))
        found += [_grazing_between(interval, surface, turn) for turn in range(*counts)]
    return [bifurcation for bifurcation in found if bifurcation is not None]


def _grazing_between(interval: _Interval, surface: Surface, turn: int) -> Located | None:
    """Locate where a turn of a motion is tangent to a surface between two members; None if it is no grazing."""
    family = interval.family
    reach, side = _reach(family, surface, turn), family.osc.barriers[surface.stop].side
    short = _short_of_touch(family, surface, turn)
    found = dataclasses.replace(interval, family=short).located(GRAZING, reach, side)
    if found is None or not found.bracketed or short is family:
        return found
    clear = min(interval.before, interval.after, key=lambda each: float(each.reaches[surface].max()))
    towards = clear if clear is interval.before else dataclasses.replace(clear, tangent=-clear.tangent)
    return _passed(short, towards, reach, side) or found


def grazing_ahead(here: Stage) -> list[Located]:
    """Locate grazing just beyond the last stage that a family could be followed to.

    Beyond grazing with a stiff stop an orbit may no longer exist, or turn back too soon to be followed; short of it,
    the family is smooth. An orbit that does not touch the stop is followed through it; of any other, the reach is
    extrapolated to 0, from members ever closer to it.
    """
    found, family = [], here.member.family
    for surface, reaches in here.reaches.items() if here.member.stable else ():
        turn = int(np.sum(reaches > 0))
        if turn < len(reaches) and reaches[turn] > -NEXT_TO:
            short = _short_of_touch(family, surface, turn)
            locate = _extrapolated if short is family else _passed
            found.append(locate(short, here, _reach(family, surface, turn), family.osc.barriers[surface.stop].side))
    return [grazing for grazing in found if grazing is not None]


def _short_of_touch(family: Family, surface: Surface, turn: int) -> Family:
    """Return the family with a stop out of its way: the same one short of the first touch, and smooth beyond it.

    A family that touches the stop at other turns, or follows a parameter of the stop itself, is returned as it is.
    """
    barrier = family.osc.barriers[surface.stop]
    if turn or surface.leaving or family.line.begins(f"barriers.{surface.stop}."):
        return family
    away = barrier.position + barrier.sign * float(family.sizes[0])
    return dataclasses.replace(family, osc=family.osc.replace({f"barriers.{surface.stop}.position": away}))


def _passed(family: Family, here: Stage, depth: Test, side: str) -> Located | None:
    """Locate the root of a depth between a stage and a member of a smooth family just ahead; None if it is not there.

    The distance to that member is doubled until the depth is positive.
    """
    distance = _SHARP
    try:
        while distance <= _JUST_AHEAD:
            ahead = family.corrected(here.member.place + distance * here.tangent, here.member.slope, here.tangent)
            if depth(ahead) > 0:
                return _Interval(family, here, Stage.of(ahead, here.tangent)).located(GRAZING, depth, side)
            distance *= 2
    except VibrokitError:
        pass  # no such member exists
    return None


def _extrapolated(family: Family, here: Stage, depth: Test, side: str) -> Located | None:
    """Approach the root of a depth along the tangent from short of it; None if it does not lie just ahead."""

    def member(distance: float) -> Member:
        return family.corrected(here.member.place + distance * here.tangent, here.member.slope, here.tangent)

    distance, now, remaining = 0.0, here.member, math.inf
    try:
        before, last, deep = -_JUST_AHEAD, depth(member(-_JUST_AHEAD)), depth(now)
        for _ in range(8):
            remaining = -deep * (distance - before) / (deep - last) if deep > last else math.inf
            if not 0 <= remaining <= _JUST_AHEAD:
                return None
            nearer = member(distance + 0.9 * remaining)
            new = depth(nearer)
            if not deep < new <= 0:
                break
            before, last, distance, deep, now = distance, deep, distance + 0.9 * remaining, new, nearer
    except VibrokitError:
        pass  # no nearer member exists
    if not math.isfinite(remaining):
        return None
    ahead = float(remaining * here.tangent[-1]) * family.span
    error = abs(ahead) + 4 * float(np.spacing(abs(now.value)))
    return Located(GRAZING, now.value + ahead, error, family.period, now.point, side)


def _test(name: str) -> Test:
    return lambda member: member.tests[name]


def _reach(owner: Family, surface: Surface, turn: int) -> Test:
    """Return the reach of a member at one of its turns, for a surface where it is in the scenes of the owner."""

    def reach(member: Member) -> float:
        reaches = turns_at(member, owner.at(member.value), [surface])[surface]
        return float(reaches[turn]) if turn < len(reaches) else -1.0

    return reach


@dataclasses.dataclass(frozen=True, eq=False)
class _Interval:
    """Two neighbouring members of a family, between which bifurcations are located."""

    family: Family
    before: Stage
    after: Stage

    def member(self, fraction: float) -> Member:
        """Return the member at a fraction of the chord, on the plane across it."""
        start, slope = self.before.member.place, self.before.member.slope
        chord = self.after.member.place - start
        slope = slope + fraction * (self.after.member.slope - slope)
        return self.family.corrected(start + fraction * chord, slope, chord / np.linalg.norm(chord))

    def located(self, kind: str, test: Test, side: str = "") -> Located | None:
        """Locate the root of a test; None if it is no bifurcation of that kind."""
        if kind == FOLD and self.before.tangent[-1] * self.after.tangent[-1] > 0:
            kind = _CROSSING
        try:
            fraction = brentq(
                lambda fraction: test(self.member(fraction)), 0.0, 1.0, xtol=_SHARP, rtol=8 * np.finfo(float).eps
            )
            member = self.member(fraction)
            if _spurious(kind, member, test):
                return None
            error = self._error(fraction, test)
        except (VibrokitError, ValueError, FloatingPointError):  # Newton's method converged to another family
            first, last = self.before.member, self.after.member
            error = 0.5 * abs(last.value - first.value) + float(np.spacing(abs(first.value)))
            value = 0.5 * (first.value + last.value)
            return Located(kind, value, error, self.family.period, first.point, side, bracketed=True)
        return Located(kind, member.value, error, self.family.period, member.point, side)

    def _error(self, fraction: float, test: Test) -> float:
        """Return how far a root moves when the integration is tightened, in the parameter."""
        family = dataclasses.replace(self.family, stepper=self.family.stepper.refined())
        finer = dataclasses.replace(self, family=family)
        low, high = max(fraction - 1e-4, 0.0), min(fraction + 1e-4, 1.0)
        steepness = (test(self.member(high)) - test(self.member(low))) / (high - low)
        moved = -test(finer.member(fraction)) / steepness
        tight = finer.member(min(max(fraction + moved, 0.0), 1.0))
        value = self.member(fraction).value
        return abs(tight.value - value) + 4 * float(np.spacing(abs(value))) + _SHARP * family.span


def _spurious(kind: str, member: Member, test: Test) -> bool:
    """Whether a test vanishes for another reason: two real rates of opposite sign, or a turn that came or went."""
    if kind in (TORUS, HOPF):
        return not (np.abs(member.rates.imag) > 1e-9).any()
    return kind == GRAZING and not abs(test(member)) < 1e-6

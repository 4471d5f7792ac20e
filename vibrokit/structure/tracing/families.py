"""Families of steady motions: an orbit, an equilibrium or a limit cycle at every value of one parameter."""

from __future__ import annotations

import dataclasses
import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.structure.autonomous import cycle_equations, equilibrium_equations
from vibrokit.structure.newton import Evaluation, newton
from vibrokit.structure.orbits import section_equations
from vibrokit.structure.parameter_values import ParameterLine
from vibrokit.structure.scales import units_of

FOLD, DOUBLING, TORUS, HOPF = "fold", "period doubling", "Neimark–Sacker", "Hopf"

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Member:
    """One steady motion of a family, or a place next to it where its equations are evaluated."""

    family: Family
    place: Array  # (n + 1,), unknowns in units of their sizes, then the value in units of the span
    point: Array  # (n,), on the section
    duration: float  # time after which it repeats (s); 0 for an equilibrium
    derivative: Array  # (n, n), of the flow over the duration; at an equilibrium, of the defect
    defect: Array  # (n,), image less point; at an equilibrium, the rate of change times a sixteenth of 2π/ω_n
    jacobian: Array  # (n, n), derivative of the defect in the unknowns, each in units of its size

    @property
    def value(self) -> float:
        """Value of the parameter."""
        return float(self.place[-1] * self.family.span)

    @property
    def residual(self) -> float:
        """Size of the defect in units of the scene."""
        return float(np.linalg.norm(self.defect / units_of(self.family.at(self.value))))

    @cached_property
    def slope(self) -> Array:
        """Derivative of the defect in the parameter, in units of the span: a difference, inwards.

        A StructureError is raised if the motion diverges at the neighbouring value.
        """
        family, step = self.family, np.copysign(1e-4, self.family.middle - self.value)
        nudged = family.equations(family.at(self.value + step * family.span))(self.place[None, :-1] * family.sizes)
        slope = np.asarray((nudged.residuals[0] - self.defect) / step)
        if not np.isfinite(slope).all():
            raise StructureError(f"a trajectory went out of range from {tuple(self.point.tolist())}.")
        return slope

    def tangent(self, ahead: Array) -> Array:
        """Return the unit tangent of the family, on the side of `ahead`."""
        tangent: Array = np.linalg.svd(np.column_stack([self.jacobian, self.slope]))[2][-1]
        return tangent if tangent @ ahead >= 0 else -tangent

    @cached_property
    def rates(self) -> NDArray[np.complex128]:
        """Exponents at an equilibrium; multipliers of an orbit, without that of a shift along a limit cycle."""
        rates = np.linalg.eigvals(self.derivative).astype(complex)
        return np.delete(rates, np.argmin(np.abs(rates - 1))) if self.family.kind == "limit cycle" else rates

    @property
    def stable(self) -> bool:
        """Whether deviations decay."""
        rates = self.rates
        return bool((rates.real < 0).all() if self.family.kind == "equilibrium" else (np.abs(rates) < 1).all())

    @cached_property
    def tests(self) -> Mapping[str, float]:
        """Functions that change their sign at the bifurcation they are named after."""
        pairs = list(itertools.combinations(self.rates, 2))
        tests = {FOLD: float(np.linalg.det(self.jacobian / self.family.sizes))}
        if self.family.kind == "equilibrium":
            return tests | {HOPF: float(np.prod([first + second for first, second in pairs]).real)}
        tests[DOUBLING] = float(np.prod(self.rates + 1).real)
        if pairs:
            tests[TORUS] = float(np.prod([first * second - 1 for first, second in pairs]).real)
        return tests


@dataclasses.dataclass(frozen=True, eq=False)
class Family(ABC):
    """Steady motions of one kind, as the solutions of defect(unknowns, value) = 0. Abstract."""

    kind: ClassVar[str]

    osc: Oscillator
    line: ParameterLine
    period: int  # in forcing periods, for periodic motions
    sizes: Array  # (n,), units of the unknowns
    span: float  # unit of the parameter
    middle: float  # a value between those at which the family is evaluated
    stepper: Stepper

    def at(self, value: float) -> Oscillator:
        """Return the scene at a value of the parameter."""
        return self.line.at(self.osc, value)

    @abstractmethod
    def equations(self, osc: Oscillator) -> Callable[[Array], Evaluation]:
        """Return the equations of the defect at one value of the parameter, and the derivative that belongs to it."""

    @abstractmethod
    def parted(self, osc: Oscillator, unknowns: Array) -> tuple[Array, float]:
        """Return the point and the duration that unknowns stand for."""

    def member(self, place: Array) -> Member:
        """Evaluate the defect and its derivatives at a place, which need not be on the family."""
        unknowns, osc = place[:-1] * self.sizes, self.at(float(place[-1] * self.span))
        (defect,), (jacobian,), (derivative,) = self.equations(osc)(unknowns[None])
        return Member(self, place, *self.parted(osc, unknowns), derivative, defect, jacobian * self.sizes)

    def corrected(self, guess: Array, slope: Array, normal: Array) -> Member:
        """Return the member on the plane through a guess with a normal, by Newton's method until the residual stays.

        The slope (n,), the derivative of the defect in the parameter in units of the span, need not be exact. A
        StructureError is raised if the iteration does not converge to a member.
        """

        def evaluate(places: Array) -> Evaluation:
            member = self.member(places[0])
            residual = np.append(member.defect, normal @ (places[0] - guess))
            jacobian = np.vstack([np.column_stack([member.jacobian, slope]), normal])
            return Evaluation(residual[None], jacobian[None], np.array([member]))

        _, (residual,), members = newton(evaluate, guess[None], iterations=12)
        if not residual <= 1e-9 * float(np.linalg.norm(self.sizes)):
            value = float(guess[-1] * self.span)
            raise StructureError(f"Newton's method found no {self.kind} motion near {self.line.path} = {value:g}.")
        found: Member = members[0]
        return found

    def closes_early(self, member: Member) -> bool:
        """Whether an orbit repeats after a part of its period, so that it belongs to another family."""
        return False


class PeriodicFamily(Family):
    """Periodic orbits of a scene with periodic excitation; the unknowns are the point."""

    kind: ClassVar[str] = "periodic"

    def equations(self, osc: Oscillator) -> Callable[[Array], Evaluation]:
        """Return those of a fixed point of the section map's power."""
        return section_equations(osc, self.period, self.stepper)

    def parted(self, osc: Oscillator, unknowns: Array) -> tuple[Array, float]:
        """Return the point and the period."""
        return unknowns, self.period * osc.section_interval

    def closes_early(self, member: Member) -> bool:
        """Whether an orbit repeats after a part of its period, so that it belongs to another family."""
        osc = self.at(member.value)
        for period in (period for period in range(1, self.period) if self.period % period == 0):
            moved = section_equations(osc, period, self.stepper)(member.point[None]).residuals[0]
            if np.linalg.norm(moved / self.sizes) < 1e-5:
                return True
        return False


class EquilibriumFamily(Family):
    """Equilibria of a scene without periodic excitation; the unknowns are the point."""

    kind: ClassVar[str] = "equilibrium"

    def equations(self, osc: Oscillator) -> Callable[[Array], Evaluation]:
        """Return those of a zero of the vector field."""
        return equilibrium_equations(osc)

    def parted(self, osc: Oscillator, unknowns: Array) -> tuple[Array, float]:
        """Return the point and 0."""
        return unknowns, 0.0


class CycleFamily(Family):
    """Limit cycles: the point is a turning point, with v = 0, and the duration takes the place of v as an unknown."""

    kind: ClassVar[str] = "limit cycle"

    def equations(self, osc: Oscillator) -> Callable[[Array], Evaluation]:
        """Return those of a cycle."""
        return cycle_equations(osc, self.stepper)

    def parted(self, osc: Oscillator, unknowns: Array) -> tuple[Array, float]:
        """Return the turning point and the duration."""
        return unknowns * (np.arange(len(unknowns)) != 1), float(unknowns[1])

    def member(self, place: Array) -> Member:
        """Evaluate the defect and its derivatives; a StructureError is raised at an equilibrium."""
        member = super().member(place)
        if np.abs(member.jacobian[:, 1] / self.sizes).max() < 1e-2:  # motion within the duration
            raise StructureError("Newton's method for a limit cycle converged to an equilibrium.")
        return member


FAMILIES: Mapping[str, type[Family]] = MappingProxyType(
    {family.kind: family for family in (PeriodicFamily, EquilibriumFamily, CycleFamily)}
)
"""The family of each kind of attractor that repeats."""

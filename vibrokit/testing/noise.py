"""Checks of noise models."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, ClassVar

import mpmath
import sympy

from vibrokit.errors import VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.parts.excitation import Harmonic
from vibrokit.parts.formula_expression import exact
from vibrokit.parts.noise import NoiseModel
from vibrokit.registry import Group
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.formulas import derived_formula
from vibrokit.symbolic.printer import printable
from vibrokit.testing.compiled import Compiled
from vibrokit.testing.motion import Motion, follow, numeric
from vibrokit.testing.part_checks import PartChecks
from vibrokit.testing.precise import Reference, derivative
from vibrokit.testing.report import Check, ConformanceError


class NoiseModelChecks(PartChecks[NoiseModel]):
    """The checks of one noise model."""

    kind: ClassVar[type[NoiseModel]] = NoiseModel
    group = Group.NOISE_MODELS
    method = "amplitude"
    arguments = (sympy.Symbol("x", real=True), sympy.Symbol("v", real=True))
    place = "noise"

    def physics(self) -> tuple[Check, ...]:
        return (
            Check("intensity", self.intensity),
            Check("extra states", self.extra_states),
            Check("finite amplitude", self.finite),
            Check("diffusion", self.diffusion),
            Check("derivatives", self.derivatives),
            Check("compiled", self.compiled),
            Check("motion", self.motion),
        )

    def scene(self, part: NoiseModel) -> Oscillator:
        return Oscillator(natural_frequency=1.0, damping_ratio=0.05, noise=part, excitations=(Harmonic(0.2, 0.9),))

    def intensity(self) -> str:
        """The model has an intensity, which may be 0 but not negative, and is no part of the amplitude."""
        part = self.samples[0]
        if "intensity" not in part.parameters:
            raise ConformanceError(f"{part!r} has no parameter 'intensity'; keep the one of NoiseModel.")
        try:
            part.replace(intensity=0.0)
        except VibrokitError as error:
            raise ConformanceError(f"{self.cls.__name__} refuses the intensity 0: {error}") from error
        if self.symbols(part)["intensity"] in self.expression(part).free_symbols:
            raise ConformanceError(
                f"The amplitude of {part!r} depends on the intensity D, which multiplies the white noise "
                "besides, as √D; leave D out of the amplitude."
            )
        try:
            part.replace(intensity=-1.0)
        except VibrokitError:
            return ""
        raise ConformanceError(f"{self.cls.__name__} accepts a negative intensity; keep the parameter of NoiseModel.")

    def extra_states(self) -> str:
        """Each extra state has a name and a rate, and the force depends on no other states."""
        names, taken = self.samples[0].extra_states, ("x", "v", "t", "S")
        if not (isinstance(names, tuple) and all(isinstance(name, str) and name.isidentifier() for name in names)):
            raise ConformanceError(f"{self.cls.__name__}.extra_states must be a tuple of names, got {names!r}.")
        if len(set(names)) < len(names) or set(names) & set(taken):
            raise ConformanceError(
                f"{self.cls.__name__}.extra_states must be distinct names, not {', '.join(taken)}, got {names!r}."
            )
        for part in self.samples:
            states = tuple(sympy.Symbol(name, real=True) for name in names)
            given: dict[str, Any] = {**part.parameters, **self.symbols(part)}
            rates = part.twin(given).drift(*self.arguments, *states)
            if not isinstance(rates, tuple) or len(rates) != len(names):
                raise ConformanceError(
                    f"The drift of {part!r} must be a tuple of {len(names)} rates, one per extra state, got {rates}."
                )
            derived_formula(part, "force", self.symbols(part), states)
        return ", ".join(names) or "none"

    def diffusion(self) -> str:
        """The diffusion matrix has the square of the amplitude, real, for the driven state, and is 0 elsewhere."""
        for part in self.samples:
            driven = len(part.extra_states) + 1
            squared = self.reference(part, self.expression(part) ** 2)
            values = self.values(part)
            matrix = sympy.lambdify(
                [*self.arguments, *values], self.scene(part).model.diffusion, modules="mpmath", dummify=True
            )
            for point in self.points():
                found = matrix(*map(mpmath.mpf, (*point, *values.values())))
                expected = mpmath.zeros(driven + 1)
                expected[driven, driven] = square = squared.exact(*point)
                if square < 0 or mpmath.mnorm(found - expected) > 1e-12 * square:
                    raise ConformanceError(
                        f"The diffusion matrix of {part!r} is {found.tolist()} at {point}, and the square of its "
                        f"amplitude {mpmath.nstr(square, 6)}; give a real amplitude, which drives the "
                        "velocity, or the last of the extra states."
                    )
        return ""

    def motion(self) -> str:
        """Without noise, the extra states and the mass move as SciPy says."""
        if not self.samples[0].extra_states:
            return "no extra states"
        return follow(map(self._motion, self.samples))

    def _motion(self, part: NoiseModel) -> Motion:
        states, values = self._states(part), self.values(part)
        drift = [numeric(rate, states, values) for rate in self._drift(part)]

        def rates(t: float, state: Any) -> tuple[float, ...]:
            moving = [rate(*map(float, state)) for rate in drift]
            return (moving[0], moving[1] + 0.2 * math.cos(0.9 * t), *moving[2:])

        return Motion(part, self.scene(part), (0.3, 0.4, *(0.5 for _ in part.extra_states)), 1.0, rates)

    def _states(self, part: NoiseModel) -> tuple[sympy.Symbol, ...]:
        return (*self.arguments, *(sympy.Symbol(name, real=True) for name in part.extra_states))

    def _drift(self, part: NoiseModel) -> tuple[sympy.Expr, ...]:
        """Rates of the states without noise and forcing, written from the scene and the formulas of the part."""
        x, v, *extra = self._states(part)
        given: dict[str, Any] = {d.name: exact(part.parameters[d.name]) for d in part.declared()} | self.symbols(part)
        twin = part.twin(given)
        force = sympy.sympify(twin.force(*extra)) if extra else sympy.Integer(0)
        return (v, -x - v / 10 + force, *map(sympy.sympify, twin.drift(x, v, *extra)))

    def compiled_distances(self, part: NoiseModel) -> Iterator[float]:
        yield from self._noisy_distances(part)
        yield from self._hamiltonian_distances(part)

    def _noisy_distances(self, part: NoiseModel) -> Iterator[float]:
        """The noisy flow: √D times the amplitude, its derivative in the driven state, and every rate."""
        code = Compiled(self.scene(part), Flow.NOISY)
        size = sympy.sqrt(self.symbols(part)["intensity"]) * self.expression(part)
        pieces = [("amplitude", size)]
        if code.has("slope"):
            pieces.append(("slope", derivative(size, self.arguments, (0, 1))))
        elif not part.extra_states and self.arguments[1] in size.free_symbols:
            raise ConformanceError(f"The amplitude of {part!r} depends on v, but compiled code has no slope for it.")
        for name, formula in pieces:
            reference = self.reference(part, formula)
            for point in self.points():
                yield reference.check(f"the {name} of {part!r}", point, code.call(name, *point))
        yield from self._rate_distances(part, code, self._states(part), self._drift(part))

    def _hamiltonian_distances(self, part: NoiseModel) -> Iterator[float]:
        """Every rate of H = p·b + ½ (amplitude p)² and of its variations, by SymPy from the formulas of the part."""
        code = Compiled(dataclasses.replace(self.scene(part), excitations=()), Flow.HAMILTONIAN_VARIATIONAL)
        drift, states = self._drift(part), self._states(part)
        momenta = tuple(sympy.Symbol(f"p_{number}", real=True) for number, _ in enumerate(states, 1))
        action = (self.expression(part) * momenta[-1]) ** 2 / 2
        energy = sum((p * b for p, b in zip(momenta, drift, strict=True)), action)
        flow = sympy.Matrix([*(energy.diff(p) for p in momenta), *(-energy.diff(q) for q in states)])
        size = 2 * len(states)
        carried = sympy.Matrix(size, size, sympy.symbols(f"m:{size**2}", real=True))
        variations = flow.jacobian([*states, *momenta]) * carried
        variables = (*states, *momenta, sympy.Symbol("S", real=True), *carried)
        yield from self._rate_distances(part, code, variables, (*flow, action, *variations))

    def _rate_distances(
        self, part: NoiseModel, code: Compiled, variables: tuple[sympy.Symbol, ...], rates: tuple[sympy.Expr, ...]
    ) -> Iterator[float]:
        """Rates at random states, without forcing."""
        references = [Reference(printable(rate), variables, self.values(part)) for rate in rates]
        for _ in range(3):
            z = self.rng.uniform(-1, 1, code.size)
            for name, reference, found in zip(variables, references, code.derivative(z), strict=True):
                yield reference.check(f"the rate of {name} with {part!r}", z, found)

"""Checks of springs, friction, excitations and noise models."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, ClassVar

import mpmath
import numpy as np
import sympy

from vibrokit.errors import VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.parts.excitation import Excitation, Harmonic
from vibrokit.parts.friction import Friction
from vibrokit.parts.noise import NoiseModel, WhiteNoise
from vibrokit.parts.spring import CubicSpring, Spring
from vibrokit.registry import Group
from vibrokit.symbolic.flow import derive_flow
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.formulas import derived_formula
from vibrokit.symbolic.model import Model
from vibrokit.symbolic.printer import printable
from vibrokit.testing.compiled import ENTRIES, Compiled, hamiltonian_start
from vibrokit.testing.part_checks import PartChecks
from vibrokit.testing.precise import Reference, derivative
from vibrokit.testing.report import Check, ConformanceError

_STATE = (sympy.Symbol("x", real=True), sympy.Symbol("v", real=True))


class StateForceChecks(PartChecks[Spring | Friction]):
    """The checks of a force that depends on the state: of a spring, or of friction."""

    arguments = _STATE

    def physics(self) -> tuple[Check, ...]:
        return (
            Check("finite force", self.finite),
            Check("derivatives", self.derivatives),
            Check("compiled", self.compiled),
        )

    def scene(self, part: Spring | Friction) -> Oscillator:
        scene = Oscillator(natural_frequency=1.0, damping_ratio=0.05, excitations=(Harmonic(0.2, 0.9),))
        parts: dict[str, Any] = {self.place: part}
        return dataclasses.replace(scene, **parts)

    def compiled_distances(self, part: Spring | Friction) -> Iterator[float]:
        scene = Oscillator(
            natural_frequency=1.0,
            damping_ratio=0.0,
            spring=CubicSpring(linear=0.0, cubic=0.0),
            noise=WhiteNoise(intensity=1.0),
        )
        parts: dict[str, Any] = {self.place: part}
        scene = dataclasses.replace(scene, **parts)
        code = Compiled(scene, Flow.HAMILTONIAN_VARIATIONAL)
        formula = self.expression(part)
        for orders, (index, momentum, factor) in ENTRIES.items():
            reference = self.reference(part, derivative(formula, self.arguments, orders))
            for point in self.points():
                for rates in (code.derivative, code.rhs):  # the force on the mass is minus that of the part
                    found = rates(hamiltonian_start(point, momentum))[index]
                    yield reference.check(f"the derivative of orders {orders} of {part!r}", point, found, -factor)


class SpringChecks(StateForceChecks):
    """The checks of one spring."""

    kind: ClassVar[type[Spring]] = Spring
    group = Group.SPRINGS
    place = "spring"


class FrictionChecks(StateForceChecks):
    """The checks of one friction."""

    kind: ClassVar[type[Friction]] = Friction
    group = Group.FRICTIONS
    place = "friction"


class ExcitationChecks(PartChecks[Excitation]):
    """The checks of one excitation."""

    kind: ClassVar[type[Excitation]] = Excitation
    group = Group.EXCITATIONS
    arguments = (sympy.Symbol("t", real=True),)
    place = "excitations.0"
    reach, count = 50.0, 20

    def physics(self) -> tuple[Check, ...]:
        return (
            Check("finite force", self.finite),
            Check("period", self.period),
            Check("compiled", self.compiled),
        )

    def scene(self, part: Excitation) -> Oscillator:
        return Oscillator(natural_frequency=1.0, damping_ratio=0.05, excitations=(part,))

    def period(self) -> str:
        """The force repeats after a finite `period`; a `period` of None means a constant force."""
        periods = []
        for part in self.samples:
            period = self._declared_period(part)
            periods.append("constant" if period is None else f"{period:.6g} s")
            if period == math.inf:
                continue
            force = self.reference(part).exact
            shift = math.pi if period is None else period
            times = [mpmath.mpf(k) * shift / 37 for k in range(-37, 370, 11)]  # ten periods
            size = max(abs(force(t)) for t in times)
            for t in times:
                change = abs(force(t + shift) - force(t))
                if change > 1e-12 * size:
                    raise ConformanceError(
                        f"{part!r} has the period {period}, but its force changes by {mpmath.nstr(change, 6)} from t = "
                        f"{mpmath.nstr(t, 6)} to {mpmath.nstr(t + shift, 6)}; return a period of the force, or None if "
                        "it is constant."
                    )
        return ", ".join(dict.fromkeys(periods))

    @staticmethod
    def _declared_period(part: Excitation) -> float | None:
        try:
            period = part.period
        except Exception as error:
            raise ConformanceError(f"{part!r}.period raises {type(error).__name__}: {error}.") from error
        if period is not None and not (isinstance(period, (int, float)) and period > 0):
            raise ConformanceError(
                f"{part!r}.period must be a positive number of seconds, None for a constant force, or math.inf for one "
                f"that never repeats, got {period!r}."
            )
        return period

    def compiled_distances(self, part: Excitation) -> Iterator[float]:
        scene = Oscillator(
            natural_frequency=1.0,
            damping_ratio=0.0,
            spring=CubicSpring(linear=0.0, cubic=0.0),
            excitations=(part,),
        )
        code, reference, start = Compiled(scene, Flow.STATE), self.reference(part), (0.0, 0.0)
        for (time,) in self.points():
            forcing = code.call("forcing", time) if code.has("forcing") else 0.0
            for found in (code.derivative(start, forcing)[1], code.rhs(start, time=time)[1]):
                yield reference.check(f"the force of {part!r}", (time,), found)


class NoiseModelChecks(PartChecks[NoiseModel]):
    """The checks of one noise model."""

    kind: ClassVar[type[NoiseModel]] = NoiseModel
    group = Group.NOISE_MODELS
    method = "amplitude"
    arguments = _STATE
    place = "noise"

    def physics(self) -> tuple[Check, ...]:
        return (
            Check("intensity", self.intensity),
            Check("extra states", self.extra_states),
            Check("finite amplitude", self.finite),
            Check("diffusion", self.diffusion),
            Check("derivatives", self.derivatives),
            Check("compiled", self.compiled),
        )

    def scene(self, part: NoiseModel) -> Oscillator:
        return Oscillator(natural_frequency=1.0, damping_ratio=0.05, noise=part, excitations=(Harmonic(0.2, 0.9),))

    def intensity(self) -> str:
        """The model has an intensity, which may be 0 but not negative."""
        part = self.samples[0]
        if "intensity" not in part.parameters:
            raise ConformanceError(f"{part!r} has no parameter 'intensity'; keep the one of NoiseModel.")
        try:
            part.replace(intensity=0.0)
        except VibrokitError as error:
            raise ConformanceError(f"{self.cls.__name__} refuses the intensity 0: {error}") from error
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
        """The diffusion matrix is real and has no negative eigenvalue."""
        for part in self.samples:
            self.expression(part)
            model = self.scene(part).model
            values = self.values(part)
            entries = sympy.lambdify([*self.arguments, *values], model.diffusion, modules="mpmath", dummify=True)
            for point in self.points():
                matrix = np.array(entries(*map(mpmath.mpf, (*point, *values.values()))).tolist(), dtype=complex)
                lowest = np.linalg.eigvalsh(matrix).min()
                if matrix.imag.any() or not lowest >= -1e-12 * abs(matrix).max():
                    raise ConformanceError(
                        f"The diffusion matrix of {part!r} must be real without negative eigenvalues, got "
                        f"{matrix.tolist()} at {point}; give a real amplitude."
                    )
        return ""

    def compiled_distances(self, part: NoiseModel) -> Iterator[float]:
        yield from self._noisy_distances(part)
        yield from self._hamiltonian_distances(part)

    def _noisy_distances(self, part: NoiseModel) -> Iterator[float]:
        """The noisy flow: √D times the amplitude, and its derivative in the driven state."""
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

    def _hamiltonian_distances(self, part: NoiseModel) -> Iterator[float]:
        """Every rate of the Hamiltonian flow and its variations, at random states."""
        scene = Oscillator(natural_frequency=1.0, damping_ratio=0.05, noise=part)
        flow = Flow.HAMILTONIAN_VARIATIONAL
        code, model = Compiled(scene, flow), Model(scene)
        equations = derive_flow(model, flow)
        values = {symbol: scene.parameters[path] for path, symbol in model.symbols.items()}
        references = [Reference(printable(rate), equations.variables, values) for rate in equations.rates]
        for _ in range(3):
            z = self.rng.uniform(-1, 1, code.size)
            for rates in (code.derivative(z), code.rhs(z)):
                for name, reference, found in zip(equations.variables, references, rates, strict=True):
                    yield reference.check(f"the rate of {name} with {part!r}", z, found)

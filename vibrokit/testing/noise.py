"""Checks of noise models."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import mpmath
import numpy as np
import sympy

from vibrokit.errors import VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.parts.excitation import Harmonic
from vibrokit.parts.noise import NoiseModel
from vibrokit.registry import Group
from vibrokit.symbolic.flow import derive_flow
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.formulas import derived_formula
from vibrokit.symbolic.model import Model
from vibrokit.symbolic.printer import printable
from vibrokit.testing.compiled import Compiled
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

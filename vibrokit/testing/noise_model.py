"""Checks of noise models."""

from __future__ import annotations

from typing import Any, ClassVar

import mpmath
import numpy as np
import sympy

from vibrokit.errors import VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.parts.excitation.harmonic import Harmonic
from vibrokit.parts.noise.noise_model import NoiseModel
from vibrokit.registry import Group
from vibrokit.symbolic.flow import derive_flow
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.formulas import ask
from vibrokit.symbolic.model import Model
from vibrokit.symbolic.printer import printable
from vibrokit.testing.compiled import Compiled
from vibrokit.testing.derivatives import ORDERS, check_compiled, check_derivatives, derivative
from vibrokit.testing.part_checks import PartChecks
from vibrokit.testing.precise import function, rounding
from vibrokit.testing.report import Check, ConformanceError

_REACH = 2.0
_TAKEN = ("x", "v", "t", "S")


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

    def part_in(self, scene: Oscillator) -> NoiseModel:
        assert scene.noise is not None
        return scene.noise

    def points(self) -> list[tuple[float, ...]]:
        """Random displacements and velocities."""
        return [(float(x), float(v)) for x, v in self.rng.uniform(-_REACH, _REACH, (12, 2))]

    def intensity(self) -> str:
        """An intensity is there; 0 is allowed, a negative one is refused."""
        part = self.samples[0]
        if "intensity" not in part.parameters:
            raise ConformanceError(f"{part!r} has no parameter 'intensity'; keep the one of NoiseModel.")
        try:
            part.replace(intensity=0.0)
        except VibrokitError as error:
            raise ConformanceError(f"{self.cls.__name__} refuses the intensity 0, no noise: {error}") from error
        try:
            part.replace(intensity=-1.0)
        except VibrokitError:
            return ""
        raise ConformanceError(f"{self.cls.__name__} takes a negative intensity; keep the parameter of NoiseModel.")

    def extra_states(self) -> str:
        """Extra states have names, and one rate each; a force comes of them alone."""
        part = self.samples[0]
        names = part.extra_states
        if not (isinstance(names, tuple) and all(isinstance(name, str) and name.isidentifier() for name in names)):
            raise ConformanceError(f"{self.cls.__name__}.extra_states is {names!r}; give a tuple of names.")
        if len(set(names)) < len(names) or set(names) & set(_TAKEN):
            raise ConformanceError(
                f"{self.cls.__name__}.extra_states is {names!r}; give each a name of its own, none of "
                f"{', '.join(_TAKEN)}."
            )
        for part in self.samples:
            states = tuple(sympy.Symbol(name, real=True) for name in names)
            given: dict[str, Any] = {**part.parameters, **self.symbols(part)}
            rates = part.twin(given).drift(*self.arguments, *states)
            if not isinstance(rates, tuple) or len(rates) != len(names):
                raise ConformanceError(
                    f"{part!r} has {len(names)} extra states but its drift has {np.size(rates)} rates: {rates}; give "
                    "a tuple with one for each."
                )
            ask(part, "force", self.symbols(part), states)
        return ", ".join(names) or "none"

    def finite(self) -> str:
        """The amplitude is finite and real wherever the mass may be, at rest in the middle too."""
        for _, amplitude in self.each():
            for point in [*self.points(), (0.0, 0.0)]:
                amplitude(*point)
        return ""

    def diffusion(self) -> str:
        """The diffusion matrix is real and has no negative eigenvalue."""
        for part in self.samples:
            self.expression(part)
            model = self.scene(part).model
            values = self.values(part)
            entries = sympy.lambdify([*self.arguments, *values], model.diffusion, modules="mpmath")
            for point in self.points():
                matrix = np.array(entries(*map(mpmath.mpf, (*point, *values.values()))).tolist(), dtype=complex)
                lowest = np.linalg.eigvalsh(matrix).min()
                if matrix.imag.any() or not lowest >= -1e-12 * abs(matrix).max():
                    raise ConformanceError(
                        f"The diffusion matrix of {part!r} at {point} is {matrix.tolist()}, which is not that of a "
                        "noise: real, with no negative eigenvalue; let the amplitude be real."
                    )
        return ""

    def derivatives(self) -> str:
        """Derivatives agree with differences of the amplitude."""
        worst = 0.0
        for part, amplitude in self.each():
            formula = self.expression(part)
            derived = [(orders, self.precise(part, derivative(formula, self.arguments, orders))) for orders in ORDERS]
            worst = max(worst, check_derivatives(part, amplitude, derived, self.points()))
        return f"within {worst:.1g} of differences at 60 digits"

    def compiled(self) -> str:
        """Amplitude, its slope and the Hamiltonian flow as compiled agree with the formulas."""
        return f"within {max(max(self._noisy(part), self._hamiltonian(part)) for part in self.samples):.1g}"

    def _noisy(self, part: NoiseModel) -> float:
        """The noise as the noisy flow adds it: √D times the amplitude, and the derivative in what it drives."""
        code = Compiled(self.scene(part), Flow.NOISY)
        size = sympy.sqrt(self.symbols(part)["intensity"]) * self.expression(part)
        pieces = [("amplitude", size)]
        if code.offers("slope"):
            pieces.append(("slope", derivative(size, self.arguments, (0, 1))))
        elif not part.extra_states and self.arguments[1] in size.free_symbols:
            raise ConformanceError(f"The amplitude of {part!r} depends on v, but compiled code does not know how.")
        worst = 0.0
        for name, formula in pieces:
            exact, bound = self.precise(part, formula), self.precise(part, rounding(formula))
            for point in self.points():
                found = code.call(name, *point)
                worst = max(worst, check_compiled(part, f"the {name}", point, found, exact(*point), bound(*point)))
        return worst

    def _hamiltonian(self, part: NoiseModel) -> float:
        """Every rate of the Hamiltonian flow and its variations, at random places."""
        scene = Oscillator(natural_frequency=1.0, damping_ratio=0.05, noise=part)
        flow = Flow.HAMILTONIAN_VARIATIONAL
        code, model = Compiled(scene, flow), Model(scene)
        equations = derive_flow(model, flow)
        values = {symbol: scene.parameters[path] for path, symbol in model.symbols.items()}
        rates = [printable(rate) for rate in equations.rates]
        exact = [function(rate, equations.variables, values) for rate in rates]
        bounds = [function(rounding(rate), equations.variables, values) for rate in rates]
        worst = 0.0
        for _ in range(3):
            z = self.rng.uniform(-1, 1, code.size)
            for found in (code.derivative(z), code.rhs(z)):
                for index, name in enumerate(equations.variables):
                    right, bound = exact[index](*z), bounds[index](*z)
                    what = f"the rate of {name}"
                    worst = max(worst, check_compiled(part, what, "a random state", float(found[index]), right, bound))
        return worst

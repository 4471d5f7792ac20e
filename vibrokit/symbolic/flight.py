"""Free flight: the Taylor series of linear motion between stops, to rounding error."""

from __future__ import annotations

import contextlib

import sympy

from vibrokit.errors import StepperError
from vibrokit.symbolic.equations import Equations
from vibrokit.symbolic.flow import ACTION, FlowEquations
from vibrokit.symbolic.forcing import FORCING
from vibrokit.symbolic.printer import SourcePrinter, unpack

ORDER = 22
_MOST_NESTED = 16  # parentheses, of which Python reads 200


class FlightWriter:
    """Writes `flight_rate` and `taylor` for a flow without contact.

    The Taylor series solves a linear system under sinusoidal forces: at order 22, a step of 1.5 divided by the largest
    rate is exact to rounding, at any damping and at resonance. StepperError is raised where the motion between stops is
    not linear, or a force is not a sum of sinusoids and a mean.
    """

    def __init__(self, model: Equations, equations: FlowEquations) -> None:
        if model.in_time.modulated:
            raise StepperError(
                "FreeFlight needs linear motion of constant coefficients between the stops, but a force varies in time "
                f"with the state, as {model.in_time.varying}; use Order8 or RK4."
            )
        self.model = model
        self.variables, self.covariances = equations.variables, equations.covariances
        no_contact = dict.fromkeys(equations.contacts, sympy.Integer(0))
        self.rates = [sympy.expand(rate.xreplace(no_contact)) for rate in equations.rates]
        self.waves = sinusoids(model)
        self.polynomials = [self._polynomial(*pair) for pair in zip(self.variables, self.rates, strict=True)]

    def _polynomial(self, variable: sympy.Symbol, rate: sympy.Expr) -> sympy.Poly:
        allowed = 2 if variable == ACTION else 1
        with contextlib.suppress(sympy.PolynomialError):
            polynomial = sympy.Poly(rate, *self.variables, FORCING)
            used = set().union(*(coefficient.free_symbols for coefficient in polynomial.coeffs()))
            if polynomial.total_degree() <= allowed and used.isdisjoint((*self.variables, FORCING)):
                return polynomial
        raise StepperError(
            f"FreeFlight needs linear motion between the stops, got {variable}' = {rate}; use Order8 or RK4."
        )

    def text(self, places: dict[sympy.Symbol, int]) -> str:
        """Both functions; `places` has the index of each parameter in ``theta``."""
        return f"{self._rate(places)}\n\n{self._taylor(places)}"

    def _rate(self, places: dict[sympy.Symbol, int]) -> str:
        x, v, *extra = self.model.state
        stiffness, damping = (sympy.diff(self.rates[1], variable) for variable in (x, v))
        bounds = [2 * sympy.sqrt(sympy.Abs(stiffness)) + sympy.Abs(damping)]
        bounds += [sympy.Abs(frequency) for frequency, _, _ in self.waves]
        for rate in self.rates[2 : 2 + len(extra)]:
            bounds.append(sum(sympy.Abs(sympy.diff(rate, variable)) for variable in self.model.state))
        # A covariance decays at the sum of two rates of the motion.
        pairs = [pair for pair in zip(self.variables, self.rates, strict=True) if pair[0] in self.covariances]
        bounds += [sympy.Abs(own) for own in dict.fromkeys(sympy.diff(rate, v) for v, rate in pairs) if own != 0]
        text, *others = map(SourcePrinter().doprint, dict.fromkeys(bounds))
        lines = unpack(bounds, places)
        for place, other in enumerate(others, 1):
            text = f"max({text}, {other})"
            if place % _MOST_NESTED == 0:
                lines.append(f"    fastest = {text}")
                text = "fastest"
        lines += [f"    return {text}", ""]
        return "\n".join(["def flight_rate(theta):", *lines])

    def _taylor(self, places: dict[sympy.Symbol, int]) -> str:
        printer = SourcePrinter()
        coefficients = [c for polynomial in self.polynomials for c in polynomial.coeffs()]
        waves = [part for wave in self.waves for part in wave]
        lines = unpack([*coefficients, *waves], places)
        for index, (frequency, even, odd) in enumerate(self.waves):
            lines += [f"    rate{index} = {printer.doprint(frequency)}", f"    even{index} = {printer.doprint(even)}"]
            lines += [f"    odd{index} = {printer.doprint(odd)}"]
        lines += ["    for _e in range(EQUATIONS):", "        series[_e*TERMS] = z[_e]", "    for _k in range(ORDER):"]
        lines += ["        once = 1.0 if _k == 0 else 0.0", "        share = 1.0/(_k + 1.0)"]
        if self.waves:
            lines.append("        f = " + " + ".join(f"even{index}" for index in range(len(self.waves))))
        for index in range(len(self.waves)):
            step = f"odd{index}*rate{index}*share, -even{index}*rate{index}*share"
            lines.append(f"        even{index}, odd{index} = {step}")
        for row, polynomial in enumerate(self.polynomials):
            lines += self._row(row, polynomial, printer)
        return "\n".join(["def taylor(t, z, theta, series):", *lines, ""])

    def _row(self, row: int, polynomial: sympy.Poly, printer: SourcePrinter) -> list[str]:
        lines, terms = [], []
        for powers, coefficient in polynomial.terms():
            factors = [index for index, power in enumerate(powers) for _ in range(power)]
            text = printer.doprint(coefficient)
            if not factors:
                terms.append(f"({text})*once")
            elif len(factors) == 1:
                series = "f" if factors[0] == len(self.variables) else f"series[{factors[0]}*TERMS + _k]"
                terms.append(f"({text})*{series}")
            else:
                first, second = factors
                lines += ["        product = 0.0", "        for _j in range(_k + 1):"]
                lines += [f"            product += series[{first}*TERMS + _j]*series[{second}*TERMS + _k - _j]"]
                terms.append(f"({text})*product")
        return [*lines, f"        series[{row}*TERMS + _k + 1] = share*({' + '.join(terms) or '0.0'})"]


def sinusoids(model: Equations) -> list[tuple[sympy.Expr, sympy.Expr, sympy.Expr]]:
    """Split the forcing into sinusoids: (ω, even, odd) of each, the value and its derivative divided by ω.

    A mean is one of frequency 0.
    """
    time = model.time
    forcing = model.forcing
    if any(power.has(time) for power in forcing.atoms(sympy.Pow)):
        forcing = sympy.expand(sympy.fu(sympy.expand(forcing)))
    waves = []
    for term in sympy.Add.make_args(sympy.expand(forcing)):
        if term == 0:
            continue
        factor, wave = term.as_independent(time)
        if wave == 1:  # the mean
            waves.append((sympy.Integer(0), term, sympy.Integer(0)))
            continue
        if not isinstance(wave, sympy.cos | sympy.sin) or sympy.diff(wave.args[0], time, 2) != 0:
            raise StepperError(
                f"FreeFlight needs excitations that are sums of sinusoids, got {term}; use Order8 or RK4."
            )
        angle = wave.args[0]
        odd = -sympy.sin(angle) if isinstance(wave, sympy.cos) else sympy.cos(angle)
        waves.append((sympy.diff(angle, time), factor * wave, factor * odd))
    return waves

"""Scenes drawn from the whole grammar of parts: a structure by a seed, and its numbers one by one.

Scenes of one seed share their compiled code, whatever the numbers are, so that a test of many scenes need not compile
each. All numbers are of order 1 in units of a length and a time. A negative length gives the mirror image of a scene.
"""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Callable
from typing import Any

import vibrokit as vk

Number = Callable[[float, float], float]  # draws a number from an interval

# Locals of generated code, builtins, modules, Greek letters, and names that SymPy keeps for itself.
NAMES = """
h k1_x z lane t f f0 S p_1 m_00 W00 C0 d0_1 on0 theta out steps forces room rates derivative amplitude touching side np
njit range E I N O Q beta gamma zeta lamda omega_n u u_ u_y b k p q a mass Gamma oo Symbol law stop self x_ v_ D
""".split()  # noqa: SIM905
SYMBOLS = (*NAMES, "lambda", "ω", "x", "v", "depth", "a b", "½", 'a"""b')
_FREE = [name for name in NAMES if name not in ("amplitude", "self")]  # taken where a part is made
EXPONENTS = (0.5, 1.0, 1.1, 1.25, 1.5, 2.0, 2.5, 3.0)

SPRINGS = (
    "{a}*x/{l}",
    "{a}*(x/{l})**3",
    "{a}*abs(x/{l})**{n}*sign(x/{l})",
    "{a}*(1 + (x/{l})**2)**({n}/2)*x/{l}",
    "{a}*sin(x/{l})",
    "{a}*tanh(x/{l})",
    "{a}*atan(x/{l})",
    "{a}*max(min(x/{l}, 1), -1)",
    "{a}*max(x/{l} - {c}, 0)",
    "{a}*x/{l}*exp(-(x/{l})**2)",
    "{a}*log(1 + (x/{l})**2)",
    "{a}*v/{w}*((x/{l})**2 - 1)",
    "{a}*v/{w}*abs(v/{w})",
    "{a}*v/{w}*cos(x/{l})",
    "{a}*abs(v/{w})**{n}*v/{w}",
)
# By themselves: springs that repeat along x, springs with a pole or a border, and springs that turn back to 0.
WHOLE_SPRINGS = (
    "{a}*sin(x/{l})",
    "{a}*sin(x/{l}) + {b}*cos(2*x/{l} + {c})*v/{w}",
    "{a}*sin(x/{l})*abs(sin(x/{l}))",
    "{b}*x/{l} - {b}*{c}/(3 - x/{l})**2",
    "{a}*x/{l}/(1 - (x/(3*{l}))**2)",
    "{a}*log(1 + x/(3*{l}))",
    "{a}*x/{l}/sqrt(9 - (x/{l})**2)",
    "{a}*sin(x/{l})/(x/{l} + 4)",
    "{a}*x/{l}*({l}**2/({l}**2 + x**2))**({n}/2)",
)
LAWS = (
    "{a}*depth/{l}",
    "{a}*(depth/{l})**{n}",
    "{a}*(depth/{l})**{n}*(1 + {c}*rate/{w})",
    "{a}*depth/{l} + {b}*(depth/{l})**0.25*rate/{w}",
    "{a}*(depth/{l})**(1/{m}) + {b}*rate/{w}*min(depth/{l}, 1)**2",
    "{a}*max(depth/{l} - {c}, 0)",
    "{a}*min(depth/{l}, {c})",
    "{a}*(exp(depth/{l}) - 1)",
    "{a}*tanh(depth/{l})",
    "{a}*depth/{l} + {b}*rate/{w}",
    "{a}*depth/{l} + max(-{a}*depth/{l}, min({a}*depth/{l}, {b}*rate/{w}))",
    "{a}*(depth/{l})**{n}*(8 + 5*{c}*rate/{w})/(8 - {c}*tanh(rate/{w}))",
    "{a}*depth/{l}/(1 + {c}*abs(rate/{w}))",
    "{a}*log(1 + depth/{l})",
    "{a}*sqrt(depth/{l} + (depth/{l})**{n})",
)
NOISES = ("1 + {c}*(x/{l})**2", "{c} + abs(v/{w})", "sqrt(1 + {c}*(x/{l})**2)")

CLASSES = {
    "law": """
class {name}(vk.ContactLaw):
    {p}: float = vk.parameter({sp!r}, "", above=0)
    {q}: float = vk.parameter({sq!r}, "")
    {r}: float = vk.parameter({sr!r}, "")
    def force(self, depth, rate):
        return self.{p} * depth**self.{q} * (1 + self.{r} * rate)
""",
    "spring": """
class {name}(vk.Spring):
    {p}: float = vk.parameter({sp!r}, "", above=0)
    {q}: float = vk.parameter({sq!r}, "")
    def force(self, x, v, power=3):
        return self.{p} * x + self.{q} * x**power
""",
    "excitation": """
class {name}(vk.Excitation):
    {p}: float = vk.parameter({sp!r}, "")
    {q}: float = vk.parameter({sq!r}, "", above=0)
    def force(self, t):
        return self.{p} * cos(self.{q} * t)**3
    @property
    def period(self):
        return 2 * math.pi / self.{q}
""",
    "transient": """
class {name}(vk.Excitation):
    {p}: float = vk.parameter({sp!r}, "")
    {q}: float = vk.parameter({sq!r}, "", above=0)
    def force(self, t):
        return self.{p} * exp(-self.{q} * t)
    @property
    def period(self):
        return math.inf
""",
    "noise": """
class {name}(vk.NoiseModel):
    extra_states = ({sp!r}, {sq!r})
    {p}: float = vk.parameter({sr!r}, "", above=0)
    def amplitude(self, x, v):
        return self.{p}
    def force(self, one, two):
        return one - two
    def drift(self, x, v, one, two):
        return (self.{p} * (two - one), -2 * self.{p} * two)
""",
}


@dataclasses.dataclass(frozen=True)
class Drawn:
    """A scene, and the length and the time (s) in which its numbers are of order 1."""

    scene: vk.Oscillator
    length: float
    time: float

    @property
    def units(self) -> tuple[float, ...]:
        """Units of a state."""
        extra = len(self.scene.noise.extra_states) if self.scene.noise else 0
        return (self.length, self.length / self.time) + (self.length / self.time**2,) * extra


def draw_scene(seed: int, number: Number, length: float, time: float) -> Drawn:
    """Draw a scene of the structure of a seed, whose numbers are of order 1 in the units given."""
    return _Drawing(random.Random(seed), number, length, time).scene()


@dataclasses.dataclass(frozen=True)
class _Drawing:
    choose: random.Random
    number: Number
    length: float
    time: float

    def scene(self) -> Drawn:
        parts: dict[str, Any] = {
            "natural_frequency": self.number(0.3, 2) / self.time,
            "damping_ratio": self.number(0, 0.3),
            "spring": self.spring(),
            "barriers": self.barriers(),
            "excitations": self.excitations(),
            "noise": self.noise(),
        }
        return Drawn(vk.Oscillator(**parts), self.length, self.time)

    def spring(self) -> Any:
        rate = 1 / self.time**2
        match self.choose.randrange(7):
            case 0:
                return None
            case 1:
                return vk.LinearSpring(self.number(-0.5, 2) * rate)
            case 2:
                return vk.CubicSpring(self.number(-1, 2) * rate, self.number(-0.3, 2) * rate / self.length**2)
            case 3:
                return self.made("spring", (self.number(0.1, 2) * rate, self.number(0, 2) * rate / self.length**2))
            case 4:
                text, constants = self.formula(self.choose.choice(WHOLE_SPRINGS))
                return vk.CustomSpring(text, **constants)
        terms = [*self.choose.sample(SPRINGS, self.choose.randint(1, 3)), SPRINGS[0]]
        text, constants = self.formula(" + ".join(terms))
        return vk.CustomSpring(text, **constants)

    def barriers(self) -> list[vk.Barrier]:
        sides = self.choose.choice(((), ("left",), ("right",), ("left", "right"), ("left", "right")))
        law, shared = self.law(), self.choose.random() < 0.5
        stops = []
        for side in sides:
            gap = self.number(0, 1) if self.choose.random() < 0.8 else 0.0
            place = gap * self.length * (-1 if side == "left" else 1)
            towards = side if self.length > 0 else {"left": "right", "right": "left"}[side]
            stops.append(vk.Barrier(law if shared else self.law(), place, towards, adhesive=self.choose.random() < 0.2))
        return stops

    def law(self) -> Any:
        return dataclasses.replace(self, length=abs(self.length)).law_of_depth()

    def law_of_depth(self) -> Any:
        stiffness = self.number(1, 300) / self.time**2
        match self.choose.randrange(6):
            case 0:
                return vk.Hertz(stiffness / self.length**0.5)
            case 1:
                return vk.Linear(stiffness)
            case 2:
                power = self.choose.choice(EXPONENTS)
                scaled = stiffness * self.length ** (1 - power)
                return self.made("law", (scaled, power, self.number(0.01, 0.5) * self.time / self.length))
        text, constants = self.formula(self.choose.choice(LAWS), (1, 100))
        return vk.CustomLaw(text, **constants)

    def excitations(self) -> list[Any]:
        def harmonic(ratio: float = 1.0) -> Any:
            return vk.Harmonic(self.number(-1, 1) * acceleration, ratio * frequency, self.number(-4, 4))

        acceleration, frequency = self.length / self.time**2, self.number(0.2, 3) / self.time
        match self.choose.randrange(9):
            case 0:
                return []
            case 1:
                return [vk.Constant(self.number(-1, 1) * acceleration)]
            case 2:
                return [harmonic(), harmonic(self.choose.choice((2.0, 1.5, 0.2)))]
            case 3:
                return [harmonic(), harmonic(2**0.5)]
            case 4:
                return [self.made("excitation", (self.number(-1, 1) * acceleration, frequency))]
            case 5:
                return [harmonic(), harmonic(7 / 3), self.made("excitation", (acceleration, 2 * frequency))]
            case 6:
                return [self.made("transient", (self.number(-1, 1) * acceleration, frequency))]
        return [harmonic(), vk.Constant(self.number(-0.3, 0.3) * acceleration)]

    def noise(self) -> Any:
        intensity = self.number(0, 0.01) * self.length**2 / self.time**3
        match self.choose.randrange(5):
            case 0:
                return None
            case 1:
                return self.made("noise", (intensity, self.number(0.3, 3) / self.time))
            case 2:
                text, constants = self.formula(self.choose.choice(NOISES))
                return vk.StateDependentNoise(intensity, text, **constants)
        return vk.WhiteNoise(intensity)

    def formula(self, text: str, strength: tuple[float, float] = (-0.5, 1)) -> tuple[str, dict[str, float]]:
        """Put names into a formula, and draw their values; some exponents are numbers."""
        scales = {"a": self.length / self.time**2, "b": self.length / self.time**2, "l": self.length}
        scales |= {"w": self.length / self.time, "c": 1.0}
        words = dict(zip("abclmnw", self.choose.sample(_FREE, 7), strict=True))
        constants = {}
        for letter in (letter for letter in words if f"{{{letter}}}" in text):
            if letter in "mn":
                value = self.choose.choice(EXPONENTS)
                if self.choose.random() < 0.3:
                    words[letter] = repr(value)
                    continue
            else:
                low, high = {"a": strength, "b": (0.1, 3)}.get(letter, (0.3, 2))
                value = self.number(low, high) * scales[letter]
            constants[words[letter]] = value
        return text.format(**words), constants

    def made(self, kind: str, values: tuple[float, ...]) -> Any:
        """Make a part of a class without source, whose names are drawn."""
        names = self.choose.sample(_FREE, 4)
        symbols = [self.choose.choice(SYMBOLS) for _ in range(2)]
        other = self.choose.choice([name for name in SYMBOLS if name not in symbols])
        first = self.choose.choice([name for name in SYMBOLS if name != symbols[0]])
        words = dict(zip(("name", "p", "q", "r"), names, strict=True))
        words |= {"sp": symbols[0], "sq": first, "sr": other}
        space: dict[str, Any] = {"vk": vk}
        exec(f"import math\nfrom sympy import cos, exp\n{CLASSES[kind].format(**words)}", space)
        return space[words["name"]](*values)

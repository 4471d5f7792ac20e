"""The part of a scene in an attempt, a step that may be rejected: its slopes as text, and the layout of `lanes`.

All numbers of a block of trajectories are in one array, `lanes`, at offsets that the modules have as constants.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vibrokit.kernels.rows import LANES
from vibrokit.kernels.tableau import STAGES
from vibrokit.symbolic.flow_kind import Flow

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText

_CLOCK = -1  # row of the time, before those of the variables
_LEAST_DEPTH = 64.0 * 2.0**-52  # of the position of a stop
# Slopes are extrapolated from depths d where both errors are small: that of the parabola, (d/D)^(3/4) in the fourth
# root of the depth D of the step, and the rounding of x, ε/d. So d/D = (ε/D)^(5/8).
_FARTHER = (
    "_share = sqrt(sqrt((_least + 1e-300)/(_reach*abs(_along) + _least + 1e-300)))",
    "_least = _least/(_share*sqrt(_share))",
)
_IMPORTS = "from vibrokit.kernels.waves import cos, sin\n"


class AttemptWriter:
    """Writes the slopes of a scene for the driver, and where the numbers of its lanes are.

    The driver takes a step from STATE to TRIAL in each lane, along its course, and finds its ERROR: see the template
    `attempts`. It calls the scene only for the slopes of a stage.
    """

    def __init__(self, text: SceneText) -> None:
        self._text = text
        self._count = len(text.variables)
        self._stops = text.barriers
        # Rows of a state, enough for every flow of a scene with as many states: they share their drivers.
        self._rows = 2 + 2 * text.states + 4 * text.states**2
        # States before and after an attempt and at a stage; the sizes of the numbers, and estimates of their errors.
        states = ["STATE", "TRIAL", "POINT", "SIZES", "FIFTHS", "THIRDS"]
        # Of an attempt: its length, its error by the tolerance, and by what to lengthen the next; the course, and the
        # stop that is touched; rounding of x at a stop; the tolerance that it allows, and how uncertain derivatives are
        # because of it. MOST has the largest estimates, and whether a number is not finite.
        scalars = ["LENGTH", "ERROR", "FACTOR", "SIGMA", "COURSE", "ROOT", "WALL", "SIDE"]
        scalars += ["GRAIN", "DEPTH", "NEAR", "ALLOWED", "HAZE"]
        blocks = [*((name, self._rows) for name in states), ("SLOPES", STAGES * self._rows)]
        self._places, self._numbers = {}, 0
        for name, height in (*blocks, *((name, 1) for name in scalars), ("MOST", 3)):
            time = -_CLOCK if height >= self._rows else 0  # rows before that of the first variable
            self._places[name] = self._numbers + time * LANES
            self._numbers += height * LANES
        self._places["PUSHES"] = -LANES  # of the first stop; the others stand before it

    def offsets(self) -> str:
        """Where the numbers of a block are."""
        offsets = [f"{name} = {place}" for name, place in self._places.items()]
        sizes = [f"LANES = {LANES}", f"NUMBERS = {self._numbers}", f"ROW, CLOCK = {self._rows}, {_CLOCK}"]
        return "\n".join([*sizes, *offsets, ""])

    def facts(self) -> str:
        """Constant FACTS: what attempts need to know of the flow."""
        text = self._text
        blocks = _error_blocks(text.states, text.states * text.flow.has_momenta, self._count)
        firsts = [0, *(1 + blocks.index(block) for block in blocks)]
        hazy = 1 + self._count
        if text.curved:
            hazy = 2 + 2 * text.states if text.flow is Flow.HAMILTONIAN_VARIATIONAL else 1 + text.states
        return f"FACTS = {(text.curved, hazy, *firsts)!r}\n"

    def slopes(self) -> list[str]:
        """Pieces of the scene: the function `slopes_lanes(node, lanes, slopes, theta)`, at POINT along each course."""
        names = enumerate(("_now", *self._text.variables), start=_CLOCK)
        lines = ["def slopes_lanes(node, lanes, slopes, theta):"]
        lines += ["    keep_apart(), use_widest_registers(), promise_no_overlap()"]
        lines += [f"    {name} = theta[{place}]" for name, place in self._text.parameters.items()]
        lines += [f"    for lane in range({LANES}):"]
        lines += [f"        {name} = {self._at('POINT', row)}" for row, name in names]
        lines += self._on_course() if self._stops else []
        lines += [f"        {', '.join(self._text.functions)} = forcing(_now, theta)"] * self._text.forced
        pushing = [f"{self._at('PUSHES', -stop)} > 0.5" for stop in range(self._stops)]
        values = [*self._text.variables, *self._text.functions, *pushing, *self._text.parameters]
        slopes = [f"_slope{row}" for row in range(self._count)]
        lines += [f"        {', '.join(slopes)} = rates({', '.join(values)})"]
        if self._text.gauges:
            states = [self._at("STATE", row) for row in range(self._text.states)]
            points = [*states, *self._text.variables[: self._text.states], *self._text.parameters]
            lines += [f"        _slope0 += crossed({', '.join(points)})"]
        weight = "_weight*" if self._stops else ""
        rates = ["_weight" if self._stops else "1.0", *(f"{weight}{slope}" for slope in slopes)]
        lines += [f"        slopes[{row * LANES} + lane] = {rate}" for row, rate in enumerate(rates, start=_CLOCK)]
        return [_IMPORTS, self._text.crossed, "\n".join([*lines, ""])]

    def _at(self, name: str, row: int = 0) -> str:
        """Text of the number of a lane in a row of a block of rows."""
        return f"lanes[{self._places[name] + row * LANES} + lane]"

    def _on_course(self) -> list[str]:
        """Lines that put x on the course of the lane, and find how fast the variables change along it.

        A depth below the rounding of x is replaced by one that x represents.
        """
        lines = [
            f"_sigma = {self._at('SIGMA')} + node*{self._at('LENGTH')}",
            f"_deep, _rooted = {self._at('COURSE')} > 1.5, {self._at('COURSE')} > 0.5",
            f"_quartic, _reach = {self._at('ROOT')} > 3.0, {self._at('LENGTH')}*{self._at('LENGTH')}",
            "_reach = _reach*_reach if _quartic else _reach",
            "_square = _sigma*_sigma",
            "_power = _square*_square if _quartic else _square",
            f"_wall, _side = {self._at('WALL')}, {self._at('SIDE')}",
            "x = _wall + _side*_power if _deep else x",
            "_rate = _side*v",
            "_along = 1.0 if _deep else _rate",
            f"_least = {_LEAST_DEPTH!r}*abs(_wall) + 1e-16*_reach*abs(_along)",
            *(_FARTHER if self._text.curved else ()),
            "_shallow = _rooted and _side*(x - _wall) < _least",
            "x = _wall + _side*_least if _shallow else x",
            "_weight = 4.0*_square*_sigma if _quartic else 2.0*_sigma",
            "_weight = (_weight if _rooted else 1.0)/(_rate if _deep else 1.0)",
        ]
        if self._text.curved:
            lines += ["_closes = _deep or (_rate > 0.0 and _power*_rate <= 4.0*_least)"]
            lines += [f"{self._at('NEAR')} = 1.0 if _shallow and _closes else 0.0"]
            lines += [f"{self._at('POINT')} = x"]
        return [f"        {line}" for line in lines]


def _error_blocks(states: int, momenta: int, equations: int) -> list[int]:
    """Return the block of each component of a flow with n states, n or no momenta, and their derivatives.

    Each state has its own scale. Momenta share one, the action has its own, and so does each block of derivatives:
    final states by initial states, final states by initial momenta, and so on. Momenta may be 1e-12 where states are
    1, and their error must be small relative to them. The same holds for each entry of a covariance, because the
    entries grow with different powers of a short time. There are n, n + n² or n + n(n + 1)/2 equations without momenta,
    2n + 1 or 2n + 1 + (2n)² with them.
    """
    state = list(range(states))
    if momenta == 0 and equations == states + states**2:
        return state + [states] * states**2
    if momenta == 0:
        return list(range(equations))
    phase = [*state, *[states] * states]
    matrix = [
        states + 2 + 2 * (row >= states) + (column >= states)
        for row in range(2 * states)
        for column in range(2 * states)
    ]
    return [*phase, states + 1, *matrix][:equations]

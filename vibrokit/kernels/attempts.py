"""Writes the attempts of located steppers: a step of order 8 of every lane, each of its own length, and its error.

All numbers of a block of trajectories are in one array, `lanes`, at offsets that the module has as constants. The
compiler then sees by itself that no two rows overlap, and needs no checks to turn the loops into vector code.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vibrokit.kernels.error_blocks import error_blocks
from vibrokit.kernels.tableau import FIFTH, NODES, RESULT, STAGES, THIRD, WEIGHTS

if TYPE_CHECKING:
    from vibrokit.symbolic.source import SceneText

_CLOCK = -1  # row of the time, before those of the variables
_LANES = 8  # those of one register; more were not faster, and fewer trajectories would fill them
_EPSILON = 2.0**-52
_LEAST_DEPTH = 64.0 * _EPSILON  # of the position of a stop
_ASSUMED = "    keep_apart(), use_widest_registers()"
_IMPORTS = """from math import sqrt

import numpy as np
from numba import njit

from vibrokit.kernels.options import INNER_LANES, LINKED_LANES
from vibrokit.kernels.pointers import offset_by
from vibrokit.kernels.registers import keep_apart, promise_no_overlap, use_widest_registers
"""
_WAVES = "from vibrokit.kernels.waves import cos, sin\n"


class AttemptWriter:
    """Writes `attempt_lanes(lanes, theta, pushing, room)` and `misfit_lanes(lanes, tolerance, span, theta)`.

    The first takes a step from STATE to TRIAL in each lane, along its course. The second finds the ERROR of each
    attempt in units of the tolerance, the largest over the components. Each block is measured by its own size; a
    velocity near 0 by a hundredth of x over `span`, the time to integrate over. No step must be more accurate than the
    rounding of x allows: GRAIN is the uncertainty of the acceleration from it. So is that of the second derivative of a
    law, which affects only derivatives of the momenta.

    The slopes of a stage are one function, and all else are loops over the numbers of all variables. Written out for
    each stage and variable, an attempt took a tenth less time, and up to 2.4 times as long to compile.
    """

    def __init__(self, text: SceneText) -> None:
        self._text = text
        self._count = len(text.variables)
        self._stops = text.barriers
        # Rows of a state, enough for every flow of a scene with as many states: they share their drivers.
        self._rows = 2 + 2 * text.states + 4 * text.states**2
        states = ["STATE", "TRIAL", "LENGTHS", "POINT", "SIZES", "FIFTHS", "THIRDS"]
        scalars = ["LENGTH", "ERROR", "FACTOR"]
        scalars += ["SIGMA", "COURSE", "WALL", "SIDE", "GRAIN", "DEPTH", "NEAR"] if self._stops else []
        blocks = [*((name, self._rows) for name in states), ("SLOPES", STAGES * self._rows)]
        self._places, self._numbers = {}, 0
        for name, height in (*blocks, *((name, 1) for name in scalars), ("PUSHES", self._stops)):
            time = -_CLOCK if height >= self._rows else 0  # rows before that of the first variable
            self._places[name] = self._numbers + time * _LANES
            self._numbers += height * _LANES

    def offsets(self) -> str:
        """Where the numbers of a block are."""
        offsets = [f"{name} = {place}" for name, place in self._places.items()]
        sizes = [f"LANES = {_LANES}", f"NUMBERS = {self._numbers}", f"ROW, CLOCK = {self._rows}, {_CLOCK}"]
        return "\n".join([*sizes, *offsets, ""])

    def attempt(self) -> list[str]:
        """Pieces of the scene: the slopes, and the attempt."""
        return [_IMPORTS + _WAVES, *("\n".join(lines) for lines in (self._slopes(), self._attempt()))]

    def misfit(self) -> list[str]:
        """Pieces of the measure: the error of an attempt."""
        return [_IMPORTS, f"LANES = {_LANES}\n", "\n".join(self._misfit())]

    @property
    def _each_number(self) -> str:
        """Text of the loop over the numbers of a state."""
        return f"    for _k in range({(self._count - _CLOCK) * _LANES}):"

    def _at(self, name: str, row: int = 0) -> str:
        """Text of the number of a lane in a row of a block of rows."""
        return f"lanes[{self._places[name] + row * _LANES} + lane]"

    def _each(self, name: str, stage: int = 0) -> str:
        """Text of the number `_k` of a block of rows for all variables."""
        return f"lanes[{self._places[name] + (_CLOCK + stage * self._rows) * _LANES} + _k]"

    def _combined(self, weights: NDArray[np.float64]) -> str:
        """Text of the weighted slopes; empty if all weights are 0."""
        return " + ".join(f"{float(w)!r}*{self._each('SLOPES', stage)}" for stage, w in enumerate(weights) if w)

    def _moved(self, target: str, weights: NDArray[np.float64]) -> list[str]:
        """Lines that put a point of the step in a block of rows."""
        slopes = self._combined(weights)
        text = self._each("STATE") + (f" + {self._each('LENGTHS')}*({slopes})" if slopes else "")
        return [self._each_number, f"        {self._each(target)} = {text}"]

    def _slopes(self) -> list[str]:
        """Function `slopes_lanes(node, lanes, slopes, theta)`: the slopes at POINT along each course."""
        names = enumerate(("_now", *self._text.variables), start=_CLOCK)
        lines = ["@njit(**INNER_LANES)", "def slopes_lanes(node, lanes, slopes, theta):"]
        lines += [_ASSUMED, "    promise_no_overlap()"]
        lines += [f"    {name} = theta[{place}]" for name, place in self._text.parameters.items()]
        lines += ["    for lane in range(LANES):"]
        lines += [f"        {name} = {self._at('POINT', row)}" for row, name in names]
        lines += self._on_course() if self._stops else []
        lines += ["        f = forcing(_now, theta)"] * self._text.forced
        pushing = [f"{self._at('PUSHES', stop)} > 0.5" for stop in range(self._stops)]
        values = [*self._text.variables, *["f"] * self._text.forced, *pushing, *self._text.parameters]
        slopes = [f"_slope{row}" for row in range(self._count)]
        lines += [f"        {', '.join(slopes)} = rates({', '.join(values)})"]
        weight = "_weight*" if self._stops else ""
        rates = ["_weight" if self._stops else "1.0", *(f"{weight}{slope}" for slope in slopes)]
        lines += [f"        slopes[{row * _LANES} + lane] = {rate}" for row, rate in enumerate(rates, start=_CLOCK)]
        return [*lines, ""]

    def _on_course(self) -> list[str]:
        """Lines that put x on the course of the lane, and find how fast the variables change along it.

        A depth below the rounding of x is replaced by one that x represents.
        """
        lines = [
            f"_sigma = {self._at('SIGMA')} + node*{self._at('LENGTH')}",
            f"_deep, _rooted = {self._at('COURSE')} > 1.5, {self._at('COURSE')} > 0.5",
            f"_wall, _side = {self._at('WALL')}, {self._at('SIDE')}",
            "x = _wall + _side*_sigma*_sigma if _deep else x",
            "_rate = _side*v",
            "_along = 1.0 if _deep else _rate",
            f"_least = {_LEAST_DEPTH!r}*abs(_wall) + 1e-16*{self._at('LENGTH')}*{self._at('LENGTH')}*abs(_along)",
            "_shallow = _rooted and _side*(x - _wall) < _least",
            "x = _wall + _side*_least if _shallow else x",
            "_weight = (2.0*_sigma if _rooted else 1.0)/(_rate if _deep else 1.0)",
        ]
        if self._text.curved:
            lines += ["_closes = _deep or (_rate > 0.0 and _sigma*_sigma*_rate <= 4.0*_least)"]
            lines += [f"{self._at('NEAR')} = 1.0 if _shallow and _closes else 0.0"]
            lines += [f"{self._at('POINT')} = x"]
        return [f"        {line}" for line in lines]

    def _attempt(self) -> list[str]:
        lines = ["@njit(**LINKED_LANES)", "def attempt_lanes(lanes, theta, pushing, room):", _ASSUMED]
        lines += [f"    for _e in range({_CLOCK}, {self._count}):", "        for lane in range(LANES):"]
        lines += ["            lanes[LENGTHS + _e*LANES + lane] = lanes[LENGTH + lane]"]
        for stage in range(STAGES):
            node, place = float(NODES[stage]), self._places["SLOPES"] + stage * self._rows * _LANES
            lines += self._moved("POINT", WEIGHTS[stage])
            lines += [f"    slopes_lanes({node!r}, lanes, offset_by(lanes, {place}), theta)"]
            if self._text.curved:
                lines += ["    for lane in range(LANES):", f"        if {self._at('NEAR')} > 0.5:"]
                lines += [f"            extrapolate({node!r}, {place} + lane, lane, lanes, pushing, theta, room)"]
        lines += self._moved("TRIAL", RESULT)
        if self._stops:
            end = f"({self._at('SIGMA')} + {self._at('LENGTH')})"
            lines += ["    for lane in range(LANES):", f"        if {self._at('COURSE')} > 1.5:"]
            lines += [f"            {self._at('TRIAL')} = {self._at('WALL')} + {self._at('SIDE')}*{end}*{end}"]
        return [*lines, ""]

    def _misfit(self) -> list[str]:
        text = self._text
        blocks = error_blocks(text.states, text.states * text.flow.has_momenta, self._count)
        lines = ["@njit(**LINKED_LANES)", "def misfit_lanes(lanes, tolerance, span, theta):", _ASSUMED]
        values = self._each("STATE"), self._each("TRIAL"), f"{self._each('LENGTHS')}*{self._each('SLOPES')}"
        lines += [self._each_number, f"        _one, _two, _three = {', '.join(f'abs({value})' for value in values)}"]
        lines += ["        _one = _one if _one > _two else _two"]
        lines += [f"        {self._each('SIZES')} = _one if _one > _three else _three"]
        for name, weights in (("FIFTHS", FIFTH), ("THIRDS", THIRD)):
            lines += [self._each_number, f"        {self._each(name)} = abs({self._combined(weights)})"]
        lines += ["    for lane in range(LANES):", "        _fifth, _third, _broken = 0.0, 0.0, 0.0"]
        lines += [f"        _reach, _speed = {self._at('SIZES', 0)}, {self._at('SIZES', 1)}"]
        lines += ["        _least = 0.01*_reach/span", "        _speed = _speed if _speed > _least else _least"]
        lines += ["        _allowed, _haze = tolerance, 1.0", *(self._rounding() if self._stops else [])]
        lines += [f"        _lapse = _reach/(abs({self._at('TRIAL', 1)}) + _reach/span)"]
        lines += ["        _lapse = _lapse if _lapse < span else span", *self._compare([_CLOCK], "_lapse")]
        for block in dict.fromkeys(blocks.tolist()):
            rows = [int(row) for row in np.flatnonzero(blocks == block)]
            unit = ("_reach", "_speed")[block] if block < 2 else "_unit"
            lines += _largest("_unit", [self._at("SIZES", row) for row in rows]) if block >= 2 else []
            if text.curved and rows[0] > 2 * text.states:  # derivatives of the momenta
                lines += ["        _unit = _unit*_haze"]
            lines += self._compare(rows, unit)
        return [*lines, *self._error(), ""]

    def _rounding(self) -> list[str]:
        """Lines that loosen the tolerance to what the rounding of x allows."""
        lapse = f"abs({self._at('TRIAL', _CLOCK)} - {self._at('STATE', _CLOCK)})"
        lines = [
            f"_blur = {self._at('GRAIN')}*{lapse}",
            "_allowed = _blur/_speed if _blur > tolerance*_speed else tolerance",
            f"_depth = {self._at('SIDE')}*({self._at('TRIAL')} - {self._at('WALL')})",
            f"_depth = _depth if _depth > {self._at('DEPTH')} else {self._at('DEPTH')}",
            f"_haze = 4.0*{_EPSILON!r}*abs({self._at('STATE')})/_depth",
            "_haze = _haze/_allowed if _haze > _allowed else 1.0",
        ]
        return [f"        {line}" for line in lines]

    def _compare(self, rows: Iterable[int], unit: str) -> list[str]:
        """Lines that raise the two estimates to those of a block of variables, in its unit."""
        lines = [f"        _per = {unit} if {unit} > 0.0 else np.inf"]
        lines += [f"        _broken += {self._at('TRIAL', row)} - {self._at('TRIAL', row)}" for row in rows]
        for name, estimates in (("_fifth", "FIFTHS"), ("_third", "THIRDS")):
            lines += _largest("_most", [self._at(estimates, row) for row in rows])
            lines += [f"        {name} = _most/_per if _most/_per > {name} else {name}"]
        return lines

    def _error(self) -> list[str]:
        """Lines that combine the estimates, and the factor by which to lengthen the next step.

        The fifth-order estimate can vanish by chance. In a step that is short enough the error is 0.02 to 0.1 times the
        square of the third-order one, which is a lower bound.
        """
        length = self._at("LENGTH")
        lines = [
            "_error = abs(" + length + ")*_fifth*_fifth/sqrt(_fifth*_fifth + 0.01*_third*_third)",
            f"_least = {length}*_third",
            "_least = 0.01*_least*_least",
            "_error = (_error if _error > _least else _least)/_allowed if _third > 0.0 else 0.0",
            "_error = _error if _broken == 0.0 else np.inf",
            f"{self._at('ERROR')} = _error",
            "_error = _error if _error > 1e-12 else 1e-12",
            "_factor = 0.9/sqrt(sqrt(sqrt(_error)))",
            "_factor = _factor if _factor < 5.0 else 5.0",
            f"{self._at('FACTOR')} = _factor if _factor > 0.15 else (0.15 if _broken == 0.0 else 0.1)",
        ]
        return [f"        {line}" for line in lines]


def _largest(name: str, values: list[str]) -> list[str]:
    first, *others = values
    lines = [f"        {name} = {first}"]
    return [*lines, *(f"        {name} = {name} if {name} > {value} else {value}" for value in others)]

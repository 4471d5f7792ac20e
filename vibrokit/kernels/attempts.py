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

_FEW_EQUATIONS = 8
_REGISTERS = "from vibrokit.kernels.registers import use_widest_registers"
_WAVES = "from vibrokit.kernels.waves import cos, sin"


class AttemptWriter:
    """Writes `attempt_lanes` and `misfit_lanes`, and the offsets that they use; `templates/scene.py` says what they do.

    With few equations, a stage is one loop over the lanes. With many, that loop would need more registers and a longer
    compilation than it gains: the point of a stage is computed row by row first.
    """

    def __init__(self, text: SceneText) -> None:
        self._text = text
        self._count = len(text.variables)
        self._few = self._count <= _FEW_EQUATIONS
        self._lanes = 16 if self._few else 8
        self._stops = text.barriers
        # At a touch the second derivative of a law is infinite, and only these equations have it.
        self._curved = text.curved
        self._places: dict[str, int] = {}
        size = self._count + 1
        rows = {"STATE": size, "TRIAL": size, "LENGTH": 1, "ERROR": 1, "FACTOR": 1, "FIFTHS": 1, "THIRDS": 1}
        rows |= {"BROKEN": 1, "ALLOWED": 1}
        if self._stops:
            rows |= {"SIGMA": 1, "COURSE": 1, "WALL": 1, "SIDE": 1, "PUSHES": self._stops, "GRAIN": 1, "DEPTH": 1}
            rows |= {"HAZE": 1, "NEAR": 1}
        rows |= {"SLOPES": STAGES * size} | ({} if self._few else {"POINT": size})
        self._numbers = 0
        for name, height in rows.items():
            self._places[name] = self._numbers
            self._numbers += height * self._lanes

    def text(self) -> list[str]:
        """The pieces: offsets, attempt, misfit."""
        offsets = [f"{name} = {place}" for name, place in self._places.items()]
        head = [_REGISTERS, _WAVES, "", f"LANES = {self._lanes}", f"NUMBERS = {self._numbers}", *offsets, ""]
        return ["\n".join(head), "\n".join(self._attempt()), "\n".join(self._misfit())]

    def _at(self, name: str, row: int | str = 0) -> str:
        """Text of the number of a lane in a row of a block of rows; a row may be text, such as ``e``."""
        if isinstance(row, int):
            return f"lanes[{self._places[name] + row * self._lanes} + lane]"
        return f"lanes[{self._places[name]} + {row}*LANES + lane]"

    def _slope(self, stage: int, row: int | str) -> str:
        place = stage * (self._count + 1)
        if isinstance(row, int):
            return self._at("SLOPES", place + row)
        return f"lanes[{self._places['SLOPES'] + place * self._lanes} + {row}*LANES + lane]"

    def _combined(self, weights: NDArray[np.float64], row: int | str) -> str:
        """Text of the weighted slopes of one variable; empty if all weights are 0."""
        return " + ".join(f"{float(w)!r}*{self._slope(stage, row)}" for stage, w in enumerate(weights) if w)

    def _moved(self, weights: NDArray[np.float64], row: int | str) -> str:
        """Text of a variable at a point of the step."""
        slopes, length = self._combined(weights, row), self._at("LENGTH")
        return f"{self._at('STATE', row)}{f' + {length}*({slopes})' if slopes else ''}"

    def _attempt(self) -> list[str]:
        lines = ["@njit(**INLINED)", "def attempt_lanes(lanes, theta, pushing, room):", "    use_widest_registers()"]
        lines += [f"    {name} = theta[{place}]" for name, place in self._text.parameters.items()]
        for stage in range(STAGES):
            lines += self._stage(stage)
        lines += ["    for _e in range(EQUATIONS + 1):", "        for lane in range(LANES):"]
        lines += [f"            {self._at('TRIAL', '_e')} = {self._moved(RESULT, '_e')}"]
        if self._stops:
            end = f"({self._at('SIGMA')} + {self._at('LENGTH')})"
            lines += ["    for lane in range(LANES):", f"        if {self._at('COURSE')} > 1.5:"]
            lines += [f"            {self._at('TRIAL')} = {self._at('WALL')} + {self._at('SIDE')}*{end}*{end}"]
        return [*lines, ""]

    def _stage(self, stage: int) -> list[str]:
        names, clock, weights = (*self._text.variables, "_now"), self._count, WEIGHTS[stage]
        if self._few:
            lines = ["    for lane in range(LANES):"]
            lines += [f"        {name} = {self._moved(weights, row)}" for row, name in enumerate(names)]
        else:
            lines = ["    for _e in range(EQUATIONS + 1):", "        for lane in range(LANES):"]
            lines += [f"            {self._at('POINT', '_e')} = {self._moved(weights, '_e')}"]
            lines += ["    for lane in range(LANES):"]
            lines += [f"        {name} = {self._at('POINT', row)}" for row, name in enumerate(names)]
        lines += self._on_course(float(NODES[stage])) if self._stops else []
        lines += ["        f = forcing(_now, theta)"] * self._text.forced
        pushing = [f"{self._at('PUSHES', stop)} > 0.5" for stop in range(self._stops)]
        values = [*self._text.variables, *["f"] * self._text.forced, *pushing, *self._text.parameters]
        slopes = [f"_slope{row}" for row in range(self._count)]
        lines += [f"        {', '.join(slopes)} = rates({', '.join(values)})"]
        weight = "_weight*" if self._stops else ""
        lines += [f"        {self._slope(stage, row)} = {weight}{slope}" for row, slope in enumerate(slopes)]
        lines += [f"        {self._slope(stage, clock)} = {'_weight' if self._stops else '1.0'}"]
        if self._curved:
            lines += ["    for lane in range(LANES):", f"        if {self._at('NEAR')} > 0.5:"]
            offset = self._places["SLOPES"] + stage * (clock + 1) * self._lanes
            lines += [
                f"            extrapolate({float(NODES[stage])!r}, {offset} + lane, lane, lanes, pushing, theta, room)"
            ]
        return lines

    def _on_course(self, node: float) -> list[str]:
        """Lines that put x on the course of the lane, and find how fast the variables change along it.

        A depth below the rounding of x is replaced by one that x represents.
        """
        lines = [
            f"_sigma = {self._at('SIGMA')} + {node!r}*{self._at('LENGTH')}",
            f"_deep, _rooted = {self._at('COURSE')} > 1.5, {self._at('COURSE')} > 0.5",
            f"_wall, _side = {self._at('WALL')}, {self._at('SIDE')}",
            "x = _wall + _side*_sigma*_sigma if _deep else x",
            "_rate = _side*v",
            "_along = 1.0 if _deep else _rate",
            f"_least = LEAST_DEPTH*abs(_wall) + 1e-16*{self._at('LENGTH')}*{self._at('LENGTH')}*abs(_along)",
            "_shallow = _rooted and _side*(x - _wall) < _least",
            "x = _wall + _side*_least if _shallow else x",
            "_weight = (2.0*_sigma if _rooted else 1.0)/(_rate if _deep else 1.0)",
        ]
        if self._curved:
            lines += ["_closes = _deep or (_rate > 0.0 and _sigma*_sigma*_rate <= 4.0*_least)"]
            lines += [f"{self._at('NEAR')} = 1.0 if _shallow and _closes else 0.0"]
            lines += [f"{self._at('POINT')} = x"]
        return [f"        {line}" for line in lines]

    def _misfit(self) -> list[str]:
        text = self._text
        blocks = error_blocks(text.states, text.states * text.flow.has_momenta, self._count)
        lines = ["@njit(**INLINED)", "def misfit_lanes(lanes, tolerance, span):", "    use_widest_registers()"]
        lines += ["    for lane in range(LANES):", "        _fifth, _third, _broken = 0.0, 0.0, 0.0"]
        sizes = {int(block): [int(row) for row in np.flatnonzero(blocks == block)] for block in dict.fromkeys(blocks)}
        for name, block in (("_reach", 0), ("_speed", 1)):
            lines += self._size_of(name, sizes[block])
        lines += ["        _least = 0.01*_reach/span", "        _speed = _speed if _speed > _least else _least"]
        lines += ["        _allowed = tolerance"]
        if self._stops:
            lines += self._rounding()
        clock = self._count
        lines += [f"        _lapse = _reach/(abs({self._at('TRIAL', 1)}) + _reach/span)"]
        lines += ["        _lapse = _lapse if _lapse < span else span", *self._compare([clock], "_lapse")]
        for block, rows in sizes.items():
            if block == 2 and len(sizes) > 3:
                lines += self._pause()
            if block > 1:
                lines += self._size_of("_size", rows)
            lines += self._compare(rows, ("_reach", "_speed")[block] if block < 2 else "_size")
        return [*lines, *self._error(), ""]

    def _rounding(self) -> list[str]:
        """Lines that loosen the tolerance to what the rounding of x allows."""
        lapse = f"abs({self._at('TRIAL', self._count)} - {self._at('STATE', self._count)})"
        after = f"{self._at('SIDE')}*({self._at('TRIAL')} - {self._at('WALL')})"
        lines = [
            f"_blur = {self._at('GRAIN')}*{lapse}",
            "_allowed = _blur/_speed if _blur > tolerance*_speed else tolerance",
            f"_depth = {after}",
            f"_depth = _depth if _depth > {self._at('DEPTH')} else {self._at('DEPTH')}",
            f"_haze = 4.0*EPSILON*abs({self._at('STATE')})/_depth",
            f"{self._at('HAZE')} = _haze/_allowed if _haze > _allowed else 1.0",
        ]
        return [f"        {line}" for line in lines]

    def _size_of(self, name: str, rows: Iterable[int]) -> list[str]:
        lines = [f"        {name} = 0.0"]
        for row in rows:
            slope = f"{self._at('LENGTH')}*{self._slope(0, row)}"
            for value in (self._at("STATE", row), self._at("TRIAL", row), slope):
                lines += [f"        _one = abs({value})", f"        {name} = _one if _one > {name} else {name}"]
        return lines

    def _compare(self, rows: Iterable[int], unit: str) -> list[str]:
        """Lines that raise the two estimates to those of a block of variables, in its unit."""
        lines = [f"        _unit = {unit} if {unit} > 0.0 else np.inf", "        _a, _b = 0.0, 0.0"]
        for row in rows:
            lines += [f"        _broken += {self._at('TRIAL', row)} - {self._at('TRIAL', row)}"]
            for name, weights in (("_a", FIFTH), ("_b", THIRD)):
                lines += [f"        _one = abs({self._combined(weights, row)})"]
                lines += [f"        {name} = _one if _one > {name} else {name}"]
        if self._curved and 2 * self._text.states < min(rows) < self._count:  # derivatives of the momenta
            lines += [f"        _unit = _unit*{self._at('HAZE')}"]
        for name, most in (("_fifth", "_a"), ("_third", "_b")):
            lines += [f"        {name} = {most}/_unit if {most}/_unit > {name} else {name}"]
        return lines

    def _pause(self) -> list[str]:
        """Lines between two loops over the lanes, so that none needs too many registers."""
        kept = (("FIFTHS", "_fifth"), ("THIRDS", "_third"), ("BROKEN", "_broken"), ("ALLOWED", "_allowed"))
        lines = [f"        {self._at(row)} = {name}" for row, name in kept]
        lines += ["    for lane in range(LANES):"]
        return lines + [f"        {name} = {self._at(row)}" for row, name in kept]

    def _error(self) -> list[str]:
        """Lines that combine the estimates, and the factor by which to lengthen the next step."""
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

"""What a step of order 8 does to rows of lanes, whatever the scene: the sums over its slopes, and their comparison.

It is written in LLVM's own vectors. As text for Numba, of loops that the compiler turned into vector code, it took much
longer to compile and was not faster.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from vibrokit.kernels.tableau import FIFTH, RESULT, THIRD, WEIGHTS

LANES = 8  # those of one register; more were not faster, and fewer trajectories would fill them
_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_ABSOLUTE = f"llvm.fabs.v{LANES}f64"
_CONTRACT = ("contract", "nsz", "arcp")
_LEAST_UNIT = 1e-290  # of an error: the inverse of a denormal number would be infinite

Weights = NDArray[np.float64]


@intrinsic
def add_stage(
    _context: Any, stage: Any, target: Any, start: Any, length: Any, slopes: Any, stride: Any, rows: Any
) -> Any:
    """Write `start` + `length` × the weighted slopes into `target`: the point of a stage, or the end after the last.

    Each is a pointer to the first of some rows of lanes, but for `length`, which is one row. The slopes of the next
    stage are `stride` numbers further.
    """

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        stage, target, start, length, slopes, stride, rows = arguments
        after = builder.append_basic_block("after_sums")
        choice = builder.switch(stage, after)
        for number, weights in enumerate((*WEIGHTS, RESULT)):
            block = builder.append_basic_block(f"stage_{number}")
            choice.add_case(ir.Constant(stage.type, number), block)
            builder.position_at_end(block)
            lapse = _load(builder, length)
            with _each(builder, rows) as place:
                value = _load(builder, start, place)
                if weights.any():
                    change = builder.fmul(lapse, _weighted(builder, weights, slopes, stride, place), flags=_CONTRACT)
                    value = builder.fadd(value, change, flags=_CONTRACT)
                _store(builder, value, target, place)
            builder.branch(after)
        builder.position_at_end(after)

    return types.void(types.int64, *[target] * 4, types.int64, types.int64), generate


@intrinsic
def add_estimates(
    _context: Any, sizes: Any, fifths: Any, thirds: Any, start: Any, end: Any, length: Any, slopes: Any, stride: Any,
    rows: Any,
) -> Any:  # fmt: skip
    """Write the sizes of some rows, and the absolute values of both estimates of their errors, per length of the step.

    The size of a number is the largest of its absolute values at the start and at the end, and of what the slope at the
    start changes.
    """

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        sizes, fifths, thirds, start, end, length, slopes, stride, rows = arguments
        absolute = cgutils.get_or_insert_function(builder.module, ir.FunctionType(_VECTOR, [_VECTOR]), _ABSOLUTE)
        lapse = _load(builder, length)
        with _each(builder, rows) as place:
            change = builder.fmul(lapse, _load(builder, slopes, place), flags=_CONTRACT)
            largest = builder.call(absolute, [_load(builder, start, place)])
            for value in (_load(builder, end, place), change):
                other = builder.call(absolute, [value])
                largest = _larger(builder, largest, other)
            _store(builder, largest, sizes, place)
            for target, weights in ((fifths, FIFTH), (thirds, THIRD)):
                estimate = _weighted(builder, weights, slopes, stride, place)
                _store(builder, builder.call(absolute, [estimate]), target, place)

    return types.void(*[sizes] * 7, types.int64, types.int64), generate


@intrinsic
def compare_rows(
    _context: Any,
    most: Any,
    sizes: Any,
    haze: Any,
    fifths: Any,
    thirds: Any,
    end: Any,
    blocks: Any,
    hazy: Any,
    rows: Any,
) -> Any:
    """Find the largest estimates of each lane, each in the unit of its block.

    The unit of a block is the size of its first row, whose number `blocks` has for each row. Units of rows from `hazy`
    on are multiplied by the haze. `most` is a pointer to three rows: the largest estimates of order 5 and 3, and a
    number that is 0 where all values at the end of the step are finite.
    """

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        most, sizes, haze, fifths, thirds, end, blocks, hazy, rows = arguments
        fifth, third, broken = found = [cgutils.alloca_once_value(builder, _splat(0.0)) for _ in range(3)]
        blurred = _load(builder, haze)
        with cgutils.for_range(builder, rows) as loop:
            place = _first_of(builder, loop.index)
            unit = _load(builder, sizes, _block_of(builder, blocks, loop.index))
            more = builder.select(builder.icmp_signed("<", loop.index, hazy), _splat(1.0), blurred)
            unit = builder.fmul(unit, more, flags=_CONTRACT)
            inverse = builder.fdiv(_splat(1.0), _larger(builder, unit, _splat(_LEAST_UNIT)))
            per = builder.select(builder.fcmp_ordered(">", unit, _splat(0.0)), inverse, _splat(0.0))
            for largest, estimates in ((fifth, fifths), (third, thirds)):
                own = builder.fmul(_load(builder, estimates, place), per, flags=_CONTRACT)
                builder.store(_larger(builder, own, builder.load(largest)), largest)
            value = _load(builder, end, place)
            builder.store(builder.fadd(builder.load(broken), builder.fsub(value, value)), broken)
        for row, number in enumerate(found):
            _store(builder, builder.load(number), most, ir.Constant(ir.IntType(64), row * LANES))

    return types.void(*[most] * 7, types.int64, types.int64), generate


@intrinsic
def join_rows(_context: Any, sizes: Any, blocks: Any, rows: Any) -> Any:
    """Make the size of the first row of each block the largest of its rows; see `compare_rows`."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        sizes, blocks, rows = arguments
        with cgutils.for_range(builder, rows) as loop:
            first, own = _block_of(builder, blocks, loop.index), _first_of(builder, loop.index)
            with builder.if_then(builder.icmp_signed("!=", first, own)):
                largest = _larger(builder, _load(builder, sizes, first), _load(builder, sizes, own))
                _store(builder, largest, sizes, first)

    return types.void(sizes, sizes, types.int64), generate


@contextmanager
def _each(builder: Any, rows: Any) -> Iterator[Any]:
    """A loop over rows; gives the place of the first number of a row."""
    with cgutils.for_range(builder, rows) as loop:
        yield _first_of(builder, loop.index)


def _first_of(builder: Any, row: Any) -> Any:
    return builder.mul(row, ir.Constant(row.type, LANES))


def _block_of(builder: Any, blocks: Any, row: Any) -> Any:
    """The place of the first number of the block that a row belongs to."""
    return _first_of(builder, builder.fptosi(builder.load(builder.gep(blocks, [row])), row.type))


def _weighted(builder: Any, weights: Weights, slopes: Any, stride: Any, place: Any) -> Any:
    total = None
    for stage in np.flatnonzero(weights):
        first = builder.add(place, builder.mul(stride, ir.Constant(stride.type, int(stage))))
        term = builder.fmul(_splat(float(weights[stage])), _load(builder, slopes, first), flags=_CONTRACT)
        total = term if total is None else builder.fadd(total, term, flags=_CONTRACT)
    return total


def _splat(number: float) -> Any:
    return ir.Constant(_VECTOR, [ir.Constant(ir.DoubleType(), number)] * LANES)


def _larger(builder: Any, one: Any, other: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", one, other), one, other)


def _row(builder: Any, pointer: Any, place: Any) -> Any:
    first = pointer if place is None else builder.gep(pointer, [place])
    return builder.bitcast(first, _VECTOR.as_pointer())


def _load(builder: Any, pointer: Any, place: Any = None) -> Any:
    return builder.load(_row(builder, pointer, place), align=8)


def _store(builder: Any, value: Any, pointer: Any, place: Any = None) -> None:
    builder.store(value, _row(builder, pointer, place), align=8)

"""Tables and numbers as text."""

from __future__ import annotations

import math
from collections.abc import Sequence

_PLAIN = 1e6  # numbers up to a million are written out
_LARGEST = 50 * math.log(10)  # above it, and below its inverse, powers of ten are written, which are read more easily


def text_table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return one line for each row, with columns of equal width; the first row has the headings."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def number_text(value: float, form: str = ".3g") -> str:
    """Return a number in a format; a dash for NaN."""
    return "–" if math.isnan(value) else format(value, form)


def power_text(logarithm: float) -> str:
    """Return a number of any size with about three digits, given its natural logarithm."""
    if math.isnan(logarithm):
        return "unknown"
    if math.isinf(logarithm):
        return "infinite" if logarithm > 0 else "0"
    if abs(logarithm) > _LARGEST:
        return f"10^{logarithm / math.log(10):.5g}"
    number = f"{math.exp(logarithm):.3g}"
    return f"{float(number):.0f}" if 1000 <= float(number) <= _PLAIN else number

"""The scene as a drawing: mass, spring, damper, stops, forces and noise. Not to scale."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle
from matplotlib.text import Text
from numpy.typing import NDArray

from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import axes_or_new

# Places in the drawing.
_WALL, _SIDE, _TOP = -6.6, 1.2, 2.0  # the wall, half the width of the mass, and its upper face
_TONGUE = 0.12  # half the width of what touches the stops
_FACE = 1.5  # distance of a stop from the middle
_SPRING, _DAMPER = 1.5, 0.75  # heights
_FIRST_FORCE, _LAST_FORCE, _BETWEEN_FORCES = 1.9, 0.4, 0.6  # heights of arrows, and the most between two
_LINE = 40  # characters that have room beside the mass


@dataclasses.dataclass(frozen=True, eq=False)
class SceneArtists(Artists):
    """The parts of a scene."""

    mass: Rectangle
    spring: Line2D | None
    damper: tuple[Line2D, ...]
    stops: tuple[Rectangle, ...]
    texts: tuple[Text, ...]


def scene_drawing(
    *,
    spring: str,
    damper: str,
    stops: Sequence[tuple[str, str]] = (),
    forces: Sequence[str] = (),
    noise: str = "",
    ax: Axes | None = None,
) -> SceneArtists:
    """Draw a mass on a spring and a damper, with stops, forces and noise, each with its text.

    Parameters
    ----------
    spring, damper : str
        The text beside each; with "" for the spring there is none.
    stops : sequence of (side, text)
        The side is ``"left"`` or ``"right"``.
    forces : sequence of str
    noise : str, optional
    ax : matplotlib.axes.Axes, optional
    """
    axes = axes_or_new(ax, 8.0, 3.9)
    if ax is None and (figure := axes.get_figure(root=True)) is not None:
        figure.set_layout_engine("none")  # a layout would shrink the drawing, but no words, to make room for words
    ink = str(axes.xaxis.label.get_color())
    mass = _mass(axes, ink)
    zigzag = axes.plot(*_zigzag(), color=ink, lw=1.2)[0] if spring else None
    rods = tuple(line for xs, ys in _dash_pot() for line in axes.plot(xs, ys, color=ink, lw=1.2))
    texts = [_text(axes, (_WALL, -0.2), _wrapped(f"{spring}\n{damper}".strip()), "left", "top")]
    blocks = []
    for side, words in stops:
        blocks.append(_stop(axes, side, ink))
        place, align = (_FACE + 0.6, "left") if side == "right" else (-_FACE - 0.6, "right")
        texts.append(_text(axes, (place, 3.2), _wrapped(words), align, "bottom"))
    arrows = [(force, "solid") for force in forces] + ([(noise, "dotted")] if noise else [])
    between = min(_BETWEEN_FORCES, (_FIRST_FORCE - _LAST_FORCE) / max(1, len(arrows) - 1))
    for index, (words, style) in enumerate(arrows):
        height = _FIRST_FORCE - between * index
        _arrow(axes, (_SIDE, height), (_SIDE + 1.0, height), ink, style)
        texts.append(_text(axes, (_SIDE + 1.15, height), words, "left", "center"))
    axes.set_xlim(_WALL - 0.6, 3.0)
    axes.set_ylim(-0.8, 4.2)
    axes.set_aspect("equal")
    axes.set_axis_off()
    return SceneArtists(axes, mass, zigzag, rods, tuple(blocks), tuple(texts))


def _mass(axes: Axes, ink: str) -> Rectangle:
    """Wall, floor, and the mass on wheels with its tongue; return the mass."""
    outline: dict[str, Any] = {"facecolor": "none", "edgecolor": ink, "linewidth": 1.4}
    axes.add_patch(Rectangle((_WALL - 0.35, 0.0), 0.35, 2.4, facecolor="none", edgecolor=ink, hatch="////", lw=0))
    axes.plot([_WALL, _WALL, 2.6], [2.4, 0.0, 0.0], color=ink, lw=1.2)
    for place in (-0.7, 0.7):
        axes.add_patch(Circle((place, 0.15), 0.15, **outline))
    axes.add_patch(Rectangle((-_TONGUE, _TOP), 2 * _TONGUE, 1.3, **outline))
    _arrow(axes, (0.0, -0.45), (0.9, -0.45), ink, "solid")
    axes.plot([0.0, 0.0], [-0.55, -0.35], color=ink, lw=1.2)
    axes.text(1.05, -0.45, "$x$", ha="left", va="center", fontsize=10)
    mass = Rectangle((-_SIDE, 0.3), 2 * _SIDE, _TOP - 0.3, **outline)
    axes.add_patch(mass)
    return mass


def _text(axes: Axes, place: tuple[float, float], words: str, across: str, up: str) -> Text:
    return axes.text(*place, words, ha=across, va=up, fontsize=9)


def _wrapped(words: str) -> str:
    return "\n".join(textwrap.fill(line, _LINE) for line in words.splitlines())


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], ink: str, style: str) -> None:
    arrow = {"arrowstyle": "-|>", "color": ink, "linestyle": style, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=end, xytext=start, arrowprops=arrow)


def _zigzag() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The spring between the wall and the mass."""
    inner = np.linspace(_WALL + 0.6, -_SIDE - 0.6, 17)
    heights = np.full(inner.size, _SPRING)
    heights[1:-1:2] += 0.25
    heights[2:-1:2] -= 0.25
    return np.concatenate([[_WALL], inner, [-_SIDE]]), np.concatenate([[_SPRING], heights, [_SPRING]])


def _dash_pot() -> list[tuple[list[float], list[float]]]:
    """Rod, cylinder, piston and rod between the wall and the mass."""
    middle = (_WALL - _SIDE) / 2
    cylinder = [middle + 0.6, middle - 0.5, middle - 0.5, middle + 0.6]
    low, high = _DAMPER - 0.28, _DAMPER + 0.28
    return [
        ([_WALL, middle - 0.5], [_DAMPER, _DAMPER]),
        (cylinder, [low, low, high, high]),
        ([middle, middle], [low + 0.06, high - 0.06]),
        ([middle, -_SIDE], [_DAMPER, _DAMPER]),
    ]


def _stop(axes: Axes, side: str, ink: str) -> Rectangle:
    """A stop beside the tongue, with the gap between them."""
    sign = 1.0 if side == "right" else -1.0
    left = _FACE if side == "right" else -_FACE - 0.4
    block = Rectangle((left, 2.5), 0.4, 1.2, facecolor="none", edgecolor=ink, hatch="////", lw=0)
    axes.add_patch(block)
    axes.plot([sign * _FACE, sign * _FACE], [2.5, 3.7], color=ink, lw=1.6)
    gap = {"arrowstyle": "<->", "color": ink, "shrinkA": 0, "shrinkB": 0, "lw": 0.8}
    axes.annotate("", xy=(sign * _FACE, 2.75), xytext=(sign * _TONGUE, 2.75), arrowprops=gap)
    return block

"""The pictures of records, as SVG in the colours of a page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import singledispatch
from typing import Any

from vibrokit.assessment.assessment import Assessment
from vibrokit.errors import VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.parts.part import Part
from vibrokit.plots.inline_svg import inline_svg
from vibrokit.plots.scene_drawing import scene_drawing
from vibrokit.report.blocks import Picture
from vibrokit.report.tables import number, symbol_text
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure
from vibrokit.text_table import unit_text

Drawing = tuple[str, Callable[[], Any]]
"""What a picture shows, and what draws it."""


def pictures_of(record: Record, name: str) -> list[Picture]:
    """Return the pictures of a record, without those that it has no numbers for; `name` begins their identifiers."""
    found = []
    for index, (caption, draw) in enumerate(_drawings(record)):
        try:
            found.append(Picture(inline_svg(draw(), f"{name}-{index}"), caption))
        except VibrokitError:
            continue
    return found


def scene_picture(osc: Oscillator) -> Picture:
    """Return the drawing of a scene with its values."""
    drawn = scene_drawing(
        spring=f"ω_n = {osc.natural_frequency:.6g} s⁻¹" if osc.spring is None else _part_text(osc.spring),
        damper=f"ζ = {osc.damping_ratio:.6g}",
        stops=[(one.side, f"at x = {one.position:.6g} m\n{_part_text(one.law)}") for one in osc.barriers],
        forces=[_part_text(part) for part in osc.excitations],
        noise="" if osc.noise is None else _part_text(osc.noise),
    )
    return Picture(inline_svg(drawn, "scene"), "The scene, not to scale.")


@singledispatch
def _drawings(record: Record) -> Iterator[Drawing]:
    yield "", record.plot


@_drawings.register
def _of_structure(structure: Structure) -> Iterator[Drawing]:
    yield "Steady states in the phase plane; stops are hatched.", structure.plot_orbits
    yield "Basins on the section, with saddles and their manifolds.", structure.plot


@_drawings.register
def _of_result(result: Result) -> Iterator[Drawing]:
    yield "", result.plot
    if any(energy.path is not None for energy in result.energies):
        yield "Momentum and action along the exit paths.", result.plot_history


@_drawings.register
def _of_assessment(one: Assessment) -> Iterator[Drawing]:
    yield "Mean exit times against 1/D by all methods, with lines of slope ΔU.", one.plot


def _part_text(part: Part) -> str:
    """The class of a part and its parameters with units."""
    values = part.parameters
    texts = [f"{symbol_text(d.symbol)} = {number(values[d.name])} {unit_text(d.unit or '')}" for d in part.declared()]
    return f"{type(part).__name__}: {', '.join(text.rstrip() for text in texts)}"

"""The pictures of records, as SVG in the colours of a page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial, singledispatch
from typing import Any

from vibrokit.assessment.assessment import Assessment
from vibrokit.errors import VibrokitError
from vibrokit.oscillator import Oscillator
from vibrokit.parts.part import Part
from vibrokit.plots.artists import inline_svg
from vibrokit.plots.scene_drawing import scene_drawing
from vibrokit.report.blocks import Picture
from vibrokit.report.tables import number, written
from vibrokit.results.mfet import MFETResult
from vibrokit.results.record import Record
from vibrokit.results.result import Result
from vibrokit.results.sgcm import SGCMResult
from vibrokit.results.structure import Structure
from vibrokit.text_units import familiar, symbol_text, unit_text

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
        spring=_spring_text(osc),
        damper=_damper_text(osc),
        stops=[(one.side, f"at {_value_text('x', one.position, 'm')}\n{_part_text(one.law)}") for one in osc.barriers],
        forces=[_part_text(part) for part in osc.excitations],
        noise="" if osc.noise is None else _part_text(osc.noise),
    )
    return Picture(inline_svg(drawn, "scene"), "The scene, not to scale.")


def _spring_text(osc: Oscillator) -> str:
    """The spring and its values; "" for a mass without one."""
    if osc.spring is not None:
        return _part_text(osc.spring)
    if not osc.own_frequency:
        return ""
    if osc.stiffness is not None:
        return _value_text("κ", osc.stiffness, "s^-2")
    return _value_text("ω_n", osc.own_frequency, "rad s^-1")


def _damper_text(osc: Oscillator) -> str:
    given = osc.damping is not None
    own = _value_text("c", osc.linear_damping, "s^-1") if given else _value_text("ζ", osc.damping_ratio or 0.0, "")
    return own if osc.friction is None else f"{own}\n{_part_text(osc.friction)}"


@singledispatch
def _drawings(record: Record) -> Iterator[Drawing]:
    yield "", record.plot


@_drawings.register
def _of_structure(structure: Structure) -> Iterator[Drawing]:
    yield "Steady states in the phase plane; stops are hatched.", structure.plot_orbits
    yield "Basins on the section, with saddles and their manifolds.", structure.plot


@_drawings.register
def _of_result(result: Result) -> Iterator[Drawing]:
    if any(energy.path is not None for energy in result.energies):
        yield "Exit paths from section to section, over the basins.", result.plot
        yield "Momentum and action along the exit paths.", result.plot_history
    else:
        yield "", result.plot


@_drawings.register
def _of_exit_times(result: MFETResult) -> Iterator[Drawing]:
    yield "Mean exit times against 1/D.", result.plot


@_drawings.register
def _of_densities(result: SGCMResult) -> Iterator[Drawing]:
    for label, name in enumerate(result.names):
        yield f"Density at {name}, as −D ln ρ at the least noise intensity.", partial(result.plot, source=label)


@_drawings.register
def _of_assessment(one: Assessment) -> Iterator[Drawing]:
    yield "Mean exit times against 1/D by all methods, with lines of slope ΔU.", one.plot


def _part_text(part: Part) -> str:
    """The class of a part and its parameters with units."""
    values = part.parameters
    texts = [_value_text(symbol_text(one.symbol), values[one.name], one.unit or "") for one in part.declared()]
    return f"{type(part).__name__}: {', '.join(texts)}"


def _value_text(symbol: str, value: float, unit: str) -> str:
    if written(value):
        return f"{symbol} = {written(value)}"
    other = familiar(value, unit)
    return f"{symbol} = {number(value)} {unit_text(unit)}".rstrip() + (f" ({other})" if other else "")

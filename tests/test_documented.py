"""Attributes that a dataclass declares are in its docstring, its signature, and in files."""

import dataclasses
import inspect
from collections.abc import Mapping
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from vibrokit.documented import documented
from vibrokit.results.fields import Word
from vibrokit.results.table import Table, fields_of


@documented
@dataclasses.dataclass(frozen=True)
class Bell:
    """A bell."""

    mass: Annotated[float, "its mass; NaN if it was not weighed", "kg m-3"]
    tone: Annotated[str, Word("tone", known=("high", "low"))]
    peals: Annotated[tuple[int, ...], "ln of the counts"]
    shape: Annotated[NDArray[np.float64] | None, "its outline"] = None
    marks: Annotated[Mapping[str, float], "by name"] = dataclasses.field(default_factory=dict)
    bare: int = 3


def test_the_docstring_has_a_section_on_the_attributes():
    assert inspect.getdoc(Bell).splitlines() == [
        "A bell.", "", "Attributes", "----------",
        "mass : float", "    Its mass (kg m⁻³); NaN if it was not weighed.",
        "tone : str", "    Tone.",
        "peals : tuple of int", "    ln of the counts.",
        "shape : array or None", "    Its outline.",
        "marks : mapping", "    By name.",
    ]  # fmt: skip


def test_signatures_show_types_alone():
    parameters = inspect.signature(Bell).parameters
    assert parameters["mass"].annotation is float
    assert parameters["peals"].annotation == tuple[int, ...]


def test_numbers_and_texts_are_in_files_under_these_words():
    assert list(fields_of(Bell)) == ["mass", "tone"]
    variables = Table("bell", fields_of(Bell)).variables([Bell(2.0, "low", ())])
    assert variables["bell_mass"][2] == {"long_name": "its mass; NaN if it was not weighed", "units": "kg m-3"}

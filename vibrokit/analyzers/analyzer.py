"""Analyzer: a way to find activation energies."""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from typing import Any

from vibrokit.kernels.ensemble import Progress
from vibrokit.oscillator import Oscillator
from vibrokit.results.result import Result
from vibrokit.results.structure import Structure


@dataclasses.dataclass(frozen=True)
class Analyzer(ABC):
    """One method behind a common face: configuration in the fields, no hidden state. Abstract.

    For developers
    --------------
    Write `run`, return a `Result`, and register the class under the entry-point group ``vibrokit.analyzers``: then
    ``vibrokit run SCENE --analyzer NAME`` knows it.
    """

    @abstractmethod
    def run(self, osc: Oscillator, structure: Structure, *, progress: Progress | None = None) -> Result:
        """Analyze a scene whose structure is known.

        Parameters
        ----------
        osc : Oscillator
        structure : Structure
        progress : callable, optional
            Called with (work done, work in all).
        """


def plain_settings(analyzer: Any) -> dict[str, Any]:
    """Return the configuration of an analyzer as plain data."""
    return {
        field.name: value
        if isinstance(value := getattr(analyzer, field.name), int | float | str | None)
        else repr(value)
        for field in dataclasses.fields(analyzer)
    }

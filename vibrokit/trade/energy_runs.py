"""Runs of single settings of the stages of least action, against the clock."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from vibrokit.analyzers.action_graph import ActionGraph
from vibrokit.analyzers.action_plot import ActionPlot
from vibrokit.analyzers.analyzer import part_of
from vibrokit.analyzers.candidate import Candidate
from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.polishing.branches import Polished, polish_all
from vibrokit.analyzers.screening.screen import Screen
from vibrokit.analyzers.shooting.search import Search
from vibrokit.errors import VibrokitError
from vibrokit.kernels.ensemble import Progress
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.structure import Structure
from vibrokit.trade.energy_table import EnergyRow

_Costs = dict[int, tuple[float, float]]  # by target: least action, and the error that its finder tells
_Found = TypeVar("_Found")


@dataclasses.dataclass(frozen=True, eq=False)
class Run:
    """What one setting came to."""

    setting: str
    costs: _Costs
    candidates: tuple[Candidate, ...]
    seconds: float
    default: bool
    failure: str = ""

    def row(self, target: int, reference: float) -> EnergyRow:
        value, told = self.costs.get(target, (math.nan, math.nan))
        failure = self.failure or ("" if self.costs else "No way out was found.")
        if not failure and math.isnan(value):
            failure = f"No way to attractor {target} was found."
        return EnergyRow(
            setting=self.setting,
            value=value,
            error=abs(value - reference) / reference,
            told=told / value if value else math.nan,
            seconds=self.seconds,
            default=self.default,
            failure=failure,
        )


class Work:
    """One attractor of one scene, which every setting has to leave.

    Parameters
    ----------
    osc : Oscillator
    structure : Structure
    label : int
    count : int
        Settings to come, for the progress.
    progress : callable, optional
    """

    def __init__(self, osc: Oscillator, structure: Structure, label: int, count: int, progress: Progress | None):
        self.osc, self.structure, self.label = osc, structure, label
        self._count, self._done, self._progress = count, 0, progress
        if progress is not None:
            progress(0, count)

    def load(self, searches: Sequence[ActionPlot | ActionGraph]) -> None:
        """Run small searches once, so that no clock counts what is compiled."""
        for search in searches:
            small: dict[str, Any] = {"cells": (32, 32)} if isinstance(search, ActionGraph) else {"points": 64}
            self.search(dataclasses.replace(search, **small), counts=False)

    def search(self, setting: ActionPlot | ActionGraph, *, counts: bool = True) -> Run:
        """Search the ways out."""
        osc, structure, label = self.osc, self.structure, self.label
        progress = self._part() if counts else None
        typed, default = _typed(setting), setting == type(setting)()
        try:
            found, seconds = _timed(lambda: setting.search(osc, structure, label, progress))
        except VibrokitError as error:
            return Run(typed, {}, (), math.nan, default, str(error))
        return Run(typed, _costs(found), tuple(found.candidates), seconds, default)

    def polish(
        self, candidates: Sequence[Candidate], stepper: Stepper, default: Stepper, *, counts: bool = True
    ) -> tuple[Run, Polished | None]:
        """Polish candidates and certify what comes of them."""
        osc, structure, label = self.osc, self.structure, self.label
        progress = self._part() if counts else None
        is_default = stepper == default
        try:
            found, seconds = _timed(
                lambda: polish_all(osc, structure, label, candidates, LeaveBasin(), stepper, progress)
            )
        except VibrokitError as error:
            return Run(repr(stepper), {}, (), math.nan, is_default, str(error)), None
        costs: _Costs = {}
        for branch in found.branches:
            costs.setdefault(branch.target, (branch.value, branch.upper - branch.value))
        failure = "" if costs else next(iter(found.words), "")
        return Run(repr(stepper), costs, (), seconds, is_default, failure), found

    def _part(self) -> Progress | None:
        self._done += 1
        return part_of(self._progress, self._done - 1, self._count)


def _costs(found: Search | Screen) -> _Costs:
    if isinstance(found, Screen):
        return dict(found.targets)
    ways = [branch.candidate for branch in found.cheapest]
    return {way.target: (way.action, found.change * way.action) for way in ways}


def _typed(setting: ActionPlot | ActionGraph) -> str:
    """The setting as it is typed, without what is the default."""
    plain = type(setting)()
    pairs = ((field.name, getattr(setting, field.name)) for field in dataclasses.fields(setting))
    words = [f"{name}={value!r}" for name, value in pairs if value != getattr(plain, name)]
    return f"{type(setting).__name__}({', '.join(words)})"


def _timed(work: Callable[[], _Found]) -> tuple[_Found, float]:
    began = time.perf_counter()
    found = work()
    return found, time.perf_counter() - began

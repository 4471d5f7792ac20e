"""The steps of the reproduction: each makes one record from those before it, and is kept in a file."""

from __future__ import annotations

import dataclasses
from typing import Any

from vibrokit.analyzers.action_plot import ActionPlot
from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.least_action import LeastAction
from vibrokit.analyzers.mean_exit_times import MFET
from vibrokit.analyzers.sgcm_wkb import SGCM
from vibrokit.analyzers.shooting.shooting import Shooting
from vibrokit.reproduction.published import STATES, paper, scenes, target_of

METHODS = ("least-action", "ring", "density", "exit-times")
"""What each state is left by; the names of the steps are these with the state."""

_ESCAPES = 100  # realizations that are kept for Figure 10
# Computing time on two processors, at ω = 0.525: 13 s, and 75 s with the default of 200², which is doubled since the
# state that hits lies in a cell of another basin. Of grids from 60² to 200² that is so for every other one.
_FEW_CELLS = (128, 128)


@dataclasses.dataclass(frozen=True)
class Step:
    """One piece of work: the structure of a scene, or an analyzer on it."""

    scene: str
    name: str  # unique in its scene
    analyzer: Analyzer | None = None  # None for the structure
    cells: tuple[int, int] | None = None  # of the basins of a structure

    @property
    def file(self) -> str:
        """Name of the file that keeps its record."""
        return f"{self.scene}-{self.name}.nc"


def steps(*, quick: bool) -> tuple[Step, ...]:
    """Return all steps, a structure before what needs it. Quick ones search less, and have fewer nodes and exits."""
    found = list[Step]()
    for scene in scenes():
        found.append(Step(scene, "structure", cells=_FEW_CELLS if quick else None))
        for state in STATES:
            methods = zip(METHODS, _methods(scene, state, quick=quick), strict=True)
            found += [Step(scene, f"{name}-{state}", analyzer) for name, analyzer in methods]
    return tuple(found)


def _methods(scene: str, state: str, *, quick: bool) -> tuple[Analyzer, ...]:
    """What answers how a state is left, in the order of `METHODS`."""
    given = paper()
    left: dict[str, Any] = {"source": STATES[state], "exit": LeaveBasin(to=target_of(state))}
    density, error = given["density"]["intensity"], 0.3 if quick else 0.1
    simulated = tuple(given["intensities"][scene][state])
    return (
        LeastAction(**left, accuracy=error, shooting=None if quick else Shooting()),
        ActionPlot(**left, radius=given["ring"]["radius"], points=10_000 if quick else given["ring"]["points"]),
        SGCM(**left, intensities=(density,), accuracy=0.5 if quick else 0.1),
        MFET(**left, intensities=simulated, target_error=error, escapes=_ESCAPES),
    )

"""The steps of the reproduction: each makes one record from those before it, and is kept in a file."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from vibrokit.analyzers.action_plot import ActionPlot
from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.least_action import LeastAction
from vibrokit.analyzers.mean_exit_times import MFET
from vibrokit.analyzers.sgcm_wkb import SGCM
from vibrokit.reproduction.published import STATES, paper, scenes

ESCAPES = 100  # realizations that are kept for Figure 10


@dataclasses.dataclass(frozen=True)
class Step:
    """One piece of work: the structure of a scene, or an analyzer on it.

    Attributes
    ----------
    scene : str
    name : str
        Of the piece, unique in its scene.
    analyzer : Analyzer or None
        None for the structure.
    """

    scene: str
    name: str
    analyzer: Analyzer | None = None

    @property
    def file(self) -> str:
        """Name of the file that keeps its record."""
        return f"{self.scene}-{self.name}.nc"


def steps(*, quick: bool) -> tuple[Step, ...]:
    """Return all steps, a structure before what needs it. Quick ones have fewer starts, nodes and exits."""
    given, found = paper(), list[Step]()
    error, points = (0.3, 10_000) if quick else (0.1, given["ring"]["points"])
    nodes: dict[str, Any] = {"nodes": (160, 160)} if quick else {}
    for scene in scenes():
        density = SGCM(intensities=(given["density"]["intensity"],), **nodes)
        ring = ActionPlot(radius=given["ring"]["radius"], points=points)
        work: Mapping[str, Analyzer | None] = {
            "structure": None,
            "least-action": LeastAction(shooting=None) if quick else LeastAction(),
            "ring": ring,
            "density": density,
        }
        found += [Step(scene, name, analyzer) for name, analyzer in work.items()]
        for state, source in STATES.items():
            chosen = LeaveBasin() if state == "N" else LeaveBasin(to=STATES["N"])
            intensities = tuple(given["intensities"][scene][state])
            times = MFET(source=source, exit=chosen, intensities=intensities, target_error=error)
            found.append(Step(scene, f"exit-times-{state}", times))
    wanted = given["escapes"]
    exits = MFET(
        source=STATES[wanted["state"]], exit=LeaveBasin(to=STATES["N"]), intensities=(wanted["intensity"],),
        target_error=0.5 if quick else error, escapes=ESCAPES,
    )  # fmt: skip
    return (*found, Step(wanted["scene"], "escapes", exits))

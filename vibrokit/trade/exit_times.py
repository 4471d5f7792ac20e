"""Work and precision of simulated exit times on one scene: the error of an exit rate against time."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from vibrokit.analyzers.exits import LeaveBasin
from vibrokit.analyzers.mean_exit_times import MFET
from vibrokit.errors import SceneError, StructureError
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, stage, working
from vibrokit.results.labels import exit_between
from vibrokit.results.structure import Structure
from vibrokit.structure.find import find_structure
from vibrokit.trade.densities import RateTrade, measured

ERRORS = (0.2, 0.1, 0.05)
"""Relative errors that are asked for."""
_FINEST = 0.5  # error of the reference, in the least of those


def measure_exit_times(
    osc: Oscillator,
    structure: Structure | None = None,
    *,
    source: int | str | None = None,
    errors: Sequence[float] = ERRORS,
    progress: Progress = None,
) -> RateTrade:
    """Measure error and time of `MFET`, directly and by splitting, for the likeliest exit of an attractor.

    The attractor is `source`, by default the first one, and the noise intensity that of the scene. Direct simulation is
    left out where the method itself does not choose it. SceneError is raised if the scene has no noise, StructureError
    if there is nothing to leave or no exit was seen.
    """
    if osc.noise is None:
        raise SceneError("the scene has no noise, so nothing leaves an attractor; exit times were not measured.")
    with working(progress):
        found = structure or find_structure(osc, manifolds=False)
        LeaveBasin().check(osc, found)
        label = 0 if source is None else found.attractor(source).label
        plain = MFET(source=label, intensities=(osc.noise.intensity,), escapes=0)
        first = dataclasses.replace(plain, target_error=max(errors)).run(osc, found)
        if not first.rates:
            raise StructureError(" ".join(["no exit was seen.", *(str(finding) for finding in first.findings)]))
        best = max(first.rates, key=lambda rate: rate.log_value)
        ways = (True,) if best.method == "splitting" else (False, True)
        settings = [
            dataclasses.replace(plain, splitting=way, target_error=error)
            for way in ways
            for error in sorted(errors)[::-1]
        ]
        finest = dataclasses.replace(
            plain, splitting=ways[0], target_error=_FINEST * min(errors), replicas=plain.replicas * 8, seed=1
        )
        with stage("exit times", subject=found.names[label], unit="settings", total=len(settings) + 1):
            rows = [
                measured(
                    osc, found, one, best.target,
                    f"MFET(target_error={one.target_error:g}, splitting={one.splitting})",
                    one.target_error == plain.target_error and one.splitting is ways[0],
                )
                for one in (*settings, finest)
            ]  # fmt: skip
    compared = tuple(dataclasses.replace(row, error=abs(row.log_rate - rows[-1].log_rate)) for row in rows)
    where = exit_between(found.names, label, best.target)
    return RateTrade(where, osc.noise.intensity, dataclasses.replace(rows[-1], error=math.nan), compared[:-1])

"""Scenes of other people with known right values, by default settings: the share of the values that is met.

    python -m tests.benchmarks.public_cases [WORDS …] [--limit 300] [--csv FILE] [--list]

`public_cases.toml` has the scenes, their sources, the right values and the tolerances. Each case whose name has all
the words runs in a process of its own. A row is one value: whether it is met within the tolerance beside it, the
question, what was found, and what is right. A CSV file gets the rows of each case when it ends, and a run that was cut
goes on with the cases that the file lacks.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import time
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import vibrokit as vk
from tests.benchmarks import table_file
from tests.benchmarks.apart import apart
from vibrokit.errors import VibrokitError
from vibrokit.scene_file import scene_from_data

TABLE = Path(__file__).with_suffix(".toml")
COLUMNS = ("case", "question", "found", "right", "tolerance", "used", "met", "remark", "source", "seconds")
_SAME = "the same"
_ESCAPE = "escape"
"""Instead of a place, as the end of an exit: out of the region."""


@dataclasses.dataclass
class Case:
    """One scene with what is asked about it. The structure is found once, when a question needs it."""

    name: str
    osc: vk.Oscillator
    checks: list[dict[str, Any]]
    region: Any = None
    limit: float = 300.0
    stopped: bool = False  # whether the limit ended a search
    _structure: vk.Structure | None = None

    @property
    def structure(self) -> vk.Structure:
        if self._structure is None:
            self._structure = vk.find_structure(self.osc, region=self.region, time_limit=self.limit)
            self.stopped |= not self._structure.complete
        return self._structure

    @property
    def cut(self) -> str:
        """What an answer lacks: shares and counts are of the starts that had settled."""
        return "the search was stopped by its limit" if self.stopped else ""

    def attractor(self, near: Any) -> Any:
        """The attractor with the point nearest to a place, in units of the spread of all points."""
        return _nearest(self.structure.attractors, near)


def _nearest(found: Any, near: Any) -> Any:
    points = np.concatenate([each.points[:, :2] for each in found])
    spread = np.maximum(np.ptp(np.vstack([points, near]), axis=0), 1e-300)
    return min(found, key=lambda each: np.linalg.norm((each.points[:, :2] - near) / spread, axis=1).min())


def attractors(case: Case) -> int:
    """Number of attractors."""
    return len(case.structure.attractors)


def section_point(case: Case, near: Any) -> list[float]:
    """Point of an attractor on the section, (x, v)."""
    points = case.attractor(near).points[:, :2]
    return points[np.linalg.norm(points - near, axis=1).argmin()].tolist()


def saddle_point(case: Case, near: Any) -> list[float]:
    """Point of a saddle on the section, (x, v)."""
    points = _nearest(case.structure.saddles, near).points[:, :2]
    return points[np.linalg.norm(points - near, axis=1).argmin()].tolist()


def kind(case: Case, near: Any) -> str:
    """Kind of an attractor."""
    return case.attractor(near).kind


def period(case: Case, near: Any) -> int:
    """Period of an attractor, in forcing periods."""
    return case.attractor(near).period


def duration(case: Case, near: Any) -> float:
    """Time after which an attractor repeats (s)."""
    return case.attractor(near).duration


def amplitude(case: Case, near: Any) -> float:
    """Half of the distance between the ends of a motion along x."""
    return float(np.ptp(case.attractor(near).extent[0])) / 2


def amplitudes(case: Case) -> list[float]:
    """Amplitudes of all attractors, in ascending order."""
    return sorted(float(np.ptp(each.extent[0])) / 2 for each in case.structure.attractors)


def reached_period(case: Case, start: Any, periods: int) -> int:
    """Period of the attractor that a start leads to, in forcing periods; 0 if it never repeats."""
    return case.attractor(case.osc.section_map([start], periods)[0]).period


def fraction(case: Case, near: Any) -> float:
    """Share of the region that leads to an attractor."""
    return case.attractor(near).basin_fraction


def energy(case: Case, near: Any, to: Any = None, touching: str | None = None) -> float:
    """Activation energy of an attractor: of its cheapest exit, or of the exit to a given place."""
    source = case.attractor(near)
    chosen = vk.LeaveBasin() if touching is None else vk.FirstContact(side=touching)
    result = vk.LeastAction(source=source.label, exit=chosen).run(case.osc, case.structure, time_limit=case.limit)
    found = [each for each in result.energies if each.source == source.label]
    if to is not None:
        wanted = -1 if to == _ESCAPE else case.attractor(to).label
        found = [each for each in found if each.target == wanted]
    return min(each.value for each in found)


def mean_time(case: Case, near: Any, intensity: float, touching: str | None = None) -> float:
    """Mean time until an attractor is left, at one noise intensity (s), by simulation."""
    source = case.attractor(near)
    chosen = vk.LeaveBasin() if touching is None else vk.FirstContact(side=touching)
    method = vk.MFET(source=source.label, intensities=(intensity,), exit=chosen)
    result = method.run(case.osc, case.structure, time_limit=case.limit)
    rate = sum(each.value for each in result.rates if each.source == source.label)
    return 1 / rate if rate else math.inf


def bifurcations(case: Case, parameter: str, values: list[float], kind: str) -> list[float]:
    """All bifurcations of one kind along a parameter, in ascending order."""
    found = vk.continuation(
        case.osc, parameter, values, region=case.region, cells=(20, 20), starts=(12, 12), time_limit=case.limit
    )
    case.stopped |= not found.complete
    return sorted(each.value for each in found.bifurcations if each.kind == kind)


def bifurcation(case: Case, parameter: str, values: list[float], kind: str, about: float) -> float:
    """The bifurcation of one kind that is nearest to a value of a parameter; others may be beside it."""
    return min(bifurcations(case, parameter, values, kind), key=lambda value: abs(value - about))


def end(case: Case, start: Any, duration: float) -> float:
    """Displacement at the end of a trajectory."""
    return float(case.osc.trajectory(start, duration=duration, samples=16).x[-1])


def deepest(case: Case, start: Any, duration: float) -> float:
    """Largest displacement along a trajectory."""
    return float(case.osc.trajectory(start, duration=duration, samples=4096).x.max())


def rebound(case: Case, speed: float, duration: float) -> float:
    """Speed after one impact on a right stop at 0 over the speed before it."""
    return float(-case.osc.trajectory((0.0, speed), duration=duration, samples=16).v[-1]) / speed


def height_ratio(case: Case, height: float, duration: float) -> float:
    """Height of a ball after a bounce over the height before it; the mean of the first bounces."""
    x = case.osc.trajectory((height, 0.0), duration=duration, samples=20_000).x
    tops = x[1:-1][(x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:])]
    return float((tops[:-1] / np.append(height, tops)[: len(tops) - 1]).mean())


def impact_speed(case: Case, near: Any, side: str) -> float:
    """Largest speed at which an orbit reaches a stop."""
    stop = next(barrier for barrier in case.osc.barriers if barrier.side == side)
    sign = 1 if side == "right" else -1
    orbit = case.attractor(near).points[0]
    path = case.osc.trajectory(orbit, periods=1, samples=100_000)
    depth = sign * (path.x - stop.position)
    arriving = np.flatnonzero((depth[:-1] < 0) & (depth[1:] >= 0))
    return float((sign * path.v[arriving]).max())


QUESTIONS: dict[str, Callable[..., Any]] = {
    question.__name__: question
    for question in (
        attractors, section_point, saddle_point, kind, period, duration, amplitude, amplitudes, reached_period,
        fraction, energy, mean_time, bifurcations, bifurcation, end, deepest, rebound, height_ratio, impact_speed,
    )
}  # fmt: skip


def read_cases() -> dict[str, dict[str, Any]]:
    """The table by name. A case that is `like` another one has its scene, with some parameters replaced."""
    with TABLE.open("rb") as file:
        rows = {row["name"]: row for row in tomllib.load(file)["cases"]}
    return {name: rows[row["like"]] | row if "like" in row else row for name, row in rows.items()}


def sources(table: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """The source of each case; "the same" stands for the names in that of the case before."""
    found, names = dict[str, str](), ""
    for name, row in table.items():
        own, _, how = row["source"].partition(";")
        names = names if own == _SAME else own
        found[name] = "; ".join(part for part in (names, how.strip()) if part)
    return found


def made(row: Mapping[str, Any], limit: float) -> Case:
    """The case of a row of the table."""
    osc = vk.load_scene(row["scene"]) if isinstance(row["scene"], str) else scene_from_data(row["scene"])
    return Case(row["name"], osc.replace(row.get("replace", {})), row["checks"], row.get("region"), limit)


def met(check: Mapping[str, Any], found: Any) -> bool:
    """Whether an answer is the right one, within the tolerance beside it."""
    right = check["value"]
    if isinstance(right, str):
        return found == right
    if np.shape(found) != np.shape(right):
        return False
    allowed = check.get("absolute", 0.0) + check.get("relative", 0.0) * np.abs(right)
    return bool(np.all(np.abs(np.subtract(found, right)) <= allowed))


def used(check: Mapping[str, Any], found: Any) -> float:
    """The part of the tolerance that an answer takes: its difference from the right value, over what is allowed."""
    right = check["value"]
    if isinstance(right, str) or np.shape(found) != np.shape(right):
        return 0.0 if found == right else math.inf
    allowed = check.get("absolute", 0.0) + check.get("relative", 0.0) * np.abs(right)
    difference = np.abs(np.subtract(found, right))
    return float(np.max(np.where(difference == 0, 0.0, difference / np.where(allowed > 0, allowed, 1e-300))))


def csv_rows(name: str, source: str, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The answers of a case as rows of a CSV file."""
    return [
        {
            "case": name,
            "question": row["check"]["question"],
            "found": _exactly(row["found"]),
            "right": _exactly(row["check"]["value"]),
            "tolerance": " + ".join(f"{row['check'][kind]:g} {kind}" for kind in _TOLERANCES if kind in row["check"]),
            "used": f"{used(row['check'], row['found']):.2g}",
            "met": "yes" if met(row["check"], row["found"]) else "no",
            "remark": row["why"],
            "source": source,
            "seconds": f"{row['seconds']:.2f}",
        }
        for row in rows
    ]


def answers(case: Case) -> list[dict[str, Any]]:
    """An answer to each question of a case, or the reason why there is none."""
    rows = []
    for check in case.checks:
        asked = {key: value for key, value in check.items() if key not in _NOT_ASKED}
        began = time.perf_counter()
        try:
            found, why = QUESTIONS[check["question"]](case, **asked), case.cut
        except (VibrokitError, KeyboardInterrupt, ValueError) as error:
            found, why = math.nan, f"{type(error).__name__}: {error}"
        rows.append({"check": check, "found": found, "why": why, "seconds": time.perf_counter() - began})
    return rows


_TOLERANCES = ("absolute", "relative")
_NOT_ASKED = {"question", "value", "by", *_TOLERANCES}


def answers_apart(name: str, limit: float) -> list[dict[str, Any]]:
    """The answers of a case, from a process of its own."""
    rows, why = apart("public_cases", "--case", name, "--limit", limit, seconds=4 * limit)
    checks = read_cases()[name]["checks"]
    return rows or [{"check": check, "found": math.nan, "why": why, "seconds": math.nan} for check in checks]


def show(name: str, rows: list[dict[str, Any]]) -> None:
    """Print the answers of a case."""
    for row in rows:
        check = row["check"]
        mark = "met " if met(check, row["found"]) else "MISS"
        print(
            f"{mark} {name:34s} {check['question']:14s} {_shown(row['found']):26s} right {_shown(check['value']):26s} "
            f"{row['seconds']:6.1f} s  {row['why'][:100]}",
            flush=True,
        )


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return "(" + ", ".join(_shown(each) for each in value) + ")"
    return f"{value:.7g}" if isinstance(value, int | float) else str(value)


def _exactly(value: Any) -> str:
    """A value to twelve digits; a list with spaces between its numbers."""
    if isinstance(value, list):
        return " ".join(map(_exactly, value))
    return f"{value:.12g}" if isinstance(value, int | float) else str(value)


def main() -> None:
    """Run the cases that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds of one search")
    parser.add_argument("--list", action="store_true")
    table_file.add_option(parser)
    parser.add_argument("--case", help=argparse.SUPPRESS)
    given = parser.parse_args()
    table = read_cases()
    if given.case:
        print(json.dumps(answers(made(table[given.case], given.limit))))
        return
    names = [name for name in table if all(word in name for word in given.words)]
    if given.list:
        print("\n".join(f"{name:36s} {table[name]['source']}" for name in names))
        return
    right = []
    if given.csv is not None:
        if not given.csv.exists():
            table_file.begin(given.csv, COLUMNS)
        known = {row["case"] for row in table_file.read(given.csv)}
        names = [name for name in names if name not in known]
    for name in names:
        rows = answers_apart(name, given.limit)
        show(name, rows)
        if given.csv is not None:
            table_file.append(given.csv, COLUMNS, csv_rows(name, sources(table)[name], rows))
        right.append([met(row["check"], row["found"]) for row in rows])
    print(
        f"\n{sum(map(all, right))} of {len(right)} cases met, {sum(map(sum, right))} of {sum(map(len, right))} values"
    )


if __name__ == "__main__":
    main()

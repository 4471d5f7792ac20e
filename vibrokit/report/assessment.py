"""An assessment as text and as plain data: the answers first, then whether the methods agree, then what is open."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from vibrokit.assessment.answers import Answer
from vibrokit.assessment.assessment import Assessment
from vibrokit.assessment.durations import duration_text
from vibrokit.assessment.plausibility import Measure
from vibrokit.comparison.tables import agreement_text, verdicts_text
from vibrokit.errors import StructureError
from vibrokit.report.blocks import Sentences, Table
from vibrokit.report.data import findings_data, plain, run_data
from vibrokit.report.text import findings_text
from vibrokit.results.energy import bounds_text
from vibrokit.results.labels import goal_name


@dataclasses.dataclass(frozen=True)
class Question:
    """What a user asks beside how long each state lasts at the scene's noise."""

    mean_time: str | None = None  # that each state has to last, such as ``"1 yr"``
    within: str | None = None  # a time within which a state may be left


def assessment_text(title: str, one: Assessment, question: Question = Question()) -> str:
    """Return the answers, the verdicts on the methods, and what is left open."""
    heading = title if one.complete else f"{title} (incomplete)"
    sections = [heading, states_text(one), *_questions(one, question), trust_text(one)]
    parts = {"states": one.structure, **one.results, "assessment": one}
    serious = {name: findings_text(part.serious, one.names) for name, part in parts.items()}
    sections += [f"{name}:\n{text}" for name, text in serious.items() if text]
    return "\n\n".join(section for section in sections if section) + f"\n\n{one.seconds:.1f} s."


def states_text(one: Assessment) -> str:
    """Return how long each state lasts, its activation energy and its share of time: a table of each."""
    if not one.names:
        return "No steady state was found."
    tables = "\n\n".join("\n".join(block.lines) for block in states_blocks(one))
    return f"Under {noise_text(one)}:\n{tables}"


def noise_text(one: Assessment) -> str:
    """Return the spectral density of the noise of the scene, where it has one, and its intensity."""
    density, in_g = (one.plausibility.value(measure) for measure in (Measure.PSD, Measure.PSD_G))
    if math.isnan(density):
        return f"noise of intensity D = {one.intensity:g} m² s⁻³"
    return f"noise with a PSD of {density:.4g} (m/s²)²/Hz = {in_g:.4g} g_n²/Hz (D = {one.intensity:g} m² s⁻³)"


def states_blocks(one: Assessment) -> list[Table | Sentences]:
    """Return the tables of how long each state lasts, of its activation energy and of its share of time."""
    lasting = tuple((name, *one.lasting(label)) for label, name in enumerate(one.names))
    barriers = tuple((name, *_barrier(one, label)) for label, name in enumerate(one.names))
    return [
        Table("lasting", "Mean times", ("state", "mean time until it is left", "by"), lasting),
        Table("barriers", "Activation energies", ("state", "ΔU (m² s⁻³)", "bounds", "to"), barriers),
        *_shares(one),
    ]


def trust_text(one: Assessment) -> str:
    """Return whether the methods agree; nothing if there is nothing to compare."""
    try:
        found = one.reconciliation
    except StructureError as error:
        return f"The methods could not be compared: {error}" if len(one.results) > 1 else ""
    absent = [name for name in one.settings.get("methods", ()) if name not in one.results]
    without = f" No result by {', '.join(absent)}." if absent else ""
    return f"{agreement_text(found)}{without}\n{verdicts_text(found)}".strip()


def assessment_data(one: Assessment, question: Question = Question()) -> dict[str, Any]:
    """Return the answers, verdicts and all numbers behind them as JSON has them."""
    asked = {name: _each(one, answer) for name, answer in _asked(one, question).items()}
    asked["mean_times"] = _each(one, one.mean_time)
    found = run_data(one.structure, one.results)
    found["findings"] += findings_data("assessment", one.findings, one.names)
    return plain(
        {"intensity": one.intensity, "complete": one.complete, **asked, "occupancies": _share_data(one), **found}
    )


def _questions(one: Assessment, question: Question) -> list[str]:
    """Answers to what was asked, for each state."""
    asked = _asked(one, question).values()
    return ["\n".join(_answered(answer, label) for label in range(len(one.names))) for answer in asked]


def _asked(one: Assessment, question: Question) -> dict[str, Callable[[int], Answer]]:
    """What answers each part of a question for a state, by its name in JSON."""
    asked: dict[str, Callable[[int], Answer]] = {}
    if question.within is not None:
        asked["probabilities_of_leaving"] = partial(one.probability_of_leaving, within=question.within)
    if question.mean_time is not None:
        asked["allowed_intensities"] = partial(one.allowed_intensity, mean_time=question.mean_time)
    return asked


def _answered(answer: Callable[[int], Answer], label: int) -> str:
    try:
        return str(answer(label))
    except StructureError as error:
        return str(error)


def _shares(one: Assessment) -> list[Table | Sentences]:
    """The share of time of each state and what limits it, or why there is none."""
    try:
        found = one.occupancy()
    except StructureError as error:
        return [Sentences((f"There are no shares of time: {error}",))]
    rows = []
    for share, name in zip(found, one.names, strict=True):
        state = str(share["state"].item())
        interval = f"({float(share['lower']):.2g} to {float(share['upper']):.2g})"
        rows.append((name, f"{float(share):.3g} {interval}" if state == name else f"counted with {state}"))
    time = float(found["log_escape_time"])
    until = f"Shares are of the time before motion escapes, after {duration_text(time)} on average."
    note = [Sentences((until,))] if math.isfinite(time) else []
    return [Table("shares", "Shares of time", ("state", "share of time"), tuple(rows)), *note]


def _barrier(one: Assessment, label: int) -> Sequence[str]:
    try:
        found = one.energy(label)
    except StructureError:
        return "not known", "–", "–"
    return f"{found.value:.6g}", f"{bounds_text(found)} ({found.bound})", goal_name(one.names, found.target)


def _each(one: Assessment, answer: Callable[[int], Answer]) -> list[dict[str, Any]]:
    """An answer for each state that has one."""
    found = []
    for label, name in enumerate(one.names):
        try:
            found.append({"state": name, **dataclasses.asdict(answer(label))})
        except StructureError:
            continue
    return found


def _share_data(one: Assessment) -> list[dict[str, Any]]:
    try:
        found = one.occupancy()
    except StructureError:
        return []
    names = ("state", "lower", "upper", "log_escape_time")
    return [
        {"attractor": name, "value": float(share), **{key: share[key].item() for key in names}}
        for share, name in zip(found, one.names, strict=True)
    ]

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
from vibrokit.comparison.tables import agreement_text, verdicts_text
from vibrokit.errors import StructureError
from vibrokit.report.blocks import Sentences, Table
from vibrokit.report.data import findings_data, plain, run_data
from vibrokit.report.text import findings_text
from vibrokit.results.codes import Severity
from vibrokit.results.energy import bounds_text
from vibrokit.results.finding import Finding
from vibrokit.results.labels import goal_name


@dataclasses.dataclass(frozen=True)
class Question:
    """What a user asks beside how long each state lasts at the scene's noise.

    Attributes
    ----------
    mean_time : str or None
        A mean time that each state has to last, such as ``"1 yr"``.
    within : str or None
        A time within which a state may be left.
    """

    mean_time: str | None = None
    within: str | None = None


def assessment_text(title: str, one: Assessment, question: Question = Question()) -> str:
    """Return the answers, the verdicts on the methods, and what is left open."""
    heading = title if one.complete else f"{title} (incomplete)"
    sections = [heading, states_text(one), *_questions(one, question), trust_text(one)]
    parts = {"states": one.structure.findings, **{name: part.findings for name, part in one.results.items()}}
    sections += [
        _open_text(name, findings, one.names) for name, findings in {**parts, "assessment": one.findings}.items()
    ]
    return "\n\n".join(section for section in sections if section) + f"\n\n{one.seconds:.1f} s."


def _open_text(name: str, findings: Sequence[Finding], names: Sequence[str]) -> str:
    """What limits the numbers, each sentence once; what only explains them is in the records."""
    serious = [finding for finding in findings if finding.severity is not Severity.INFO]
    text = findings_text(list({finding.sentence(names): finding for finding in serious}.values()), names)
    return f"{name}:\n{text}" if text else ""


def states_text(one: Assessment) -> str:
    """Return how long each state lasts, its activation energy and its share of time: a table of each."""
    if not one.names:
        return "No steady state was found."
    shares, why = _shares(one)
    texts = ["\n".join([f"At {noise_text(one)}:", *lasting_table(one).lines]), "\n".join(barrier_table(one).lines)]
    if not why:
        texts.append("\n".join(share_table(one, shares).lines))
    return "\n\n".join([*texts, *why])


def noise_text(one: Assessment) -> str:
    """Return the noise intensity of the scene, and its spectral density where that has a value."""
    density = one.psd_ratio * one.intensity
    psd = "" if math.isnan(density) else f", a PSD of {density:.4g} (m/s²)²/Hz"
    return f"D = {one.intensity:g} m² s⁻³{psd}"


def states_blocks(one: Assessment) -> list[Table | Sentences]:
    """Return the tables of how long each state lasts, of its activation energy and of its share of time."""
    shares, why = _shares(one)
    last = Sentences(tuple(why)) if why else share_table(one, shares)
    return [lasting_table(one), barrier_table(one), last]


def lasting_table(one: Assessment) -> Table:
    """Return how long each state lasts."""
    rows = tuple((name, *_lasting(one, label)) for label, name in enumerate(one.names))
    return Table("lasting", "How long each state lasts", ("state", "mean time until it is left", "by"), rows)


def barrier_table(one: Assessment) -> Table:
    """Return the activation energy of each state."""
    rows = tuple((name, *_barrier(one, label)) for label, name in enumerate(one.names))
    return Table("barriers", "Activation energies", ("state", "ΔU (m² s⁻³)", "bounds", "to"), rows)


def share_table(one: Assessment, shares: Sequence[str]) -> Table:
    """Return the share of time of each state."""
    return Table("shares", "Shares of time", ("state", "share of time"), tuple(zip(one.names, shares, strict=True)))


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


def _shares(one: Assessment) -> tuple[list[str], list[str]]:
    """The share of time of each state, and what limits it or why there is none."""
    try:
        found = one.occupancy()
    except StructureError as error:
        return ["–" for _ in one.names], [f"There are no shares of time: {error}"]
    texts = []
    for share, name in zip(found, one.names, strict=True):
        state = str(share["state"].item())
        interval = f"({float(share['lower']):.2g} to {float(share['upper']):.2g})"
        texts.append(f"{float(share):.3g} {interval}" if state == name else f"with {state}")
    time = float(found["log_escape_time"])
    until = f"Shares are of the time before motion escapes, after {duration_text(time)} on average."
    return texts, [until] if math.isfinite(time) else []


def _lasting(one: Assessment, label: int) -> Sequence[str]:
    try:
        found = one.mean_time(label)
    except StructureError:
        return "not known", "–"
    remarks = ["extrapolated"] * found.extrapolated + ["left before it has formed"] * (not found.metastable)
    return found.number, ", ".join([" and ".join(found.methods), *remarks])


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

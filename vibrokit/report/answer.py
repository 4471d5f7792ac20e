"""The answer of an assessment in a few sentences."""

from __future__ import annotations

from vibrokit.assessment.answers import MeanTime
from vibrokit.assessment.assessment import Assessment
from vibrokit.comparison.tables import agreement_text
from vibrokit.errors import StructureError, counted
from vibrokit.report.assessment import noise_text


def answer_sentences(one: Assessment) -> tuple[str, ...]:
    """Return which state lasts longest, how long the others last, and what supports it."""
    times = _mean_times(one)
    if not times:
        known = f"{counted(len(one.names), 'steady state')} found" if one.names else "no steady state was found"
        return (f"At {noise_text(one)} it is not known how long a state lasts: {known}.", _trust(one))
    (first, longest), *others = sorted(times.items(), key=lambda item: -item[1].log_value)
    rank = " lasts longest: it" if len(times) == len(one.names) > 1 else ""
    answers = [f"At {noise_text(one)}, {first}{rank} is left after {_time(longest)}."]
    if others:
        answers.append("; ".join(f"{name} is left after {_time(time)}" for name, time in others) + ".")
    open_ = [name for name in one.names if name not in times]
    if open_:
        answers.append(f"It is not known how long {', '.join(open_)} {'lasts' if len(open_) == 1 else 'last'}.")
    return (*answers, _trust(one))


def _mean_times(one: Assessment) -> dict[str, MeanTime]:
    found = {}
    for name in one.names:
        try:
            found[name] = one.mean_time(name)
        except StructureError:
            continue
    return found


def _time(time: MeanTime) -> str:
    remarks = ["extrapolated"] * time.extrapolated + ["before motion has settled in it"] * (not time.metastable)
    return f"{time.number} on average ({', '.join(['by ' + ' and '.join(time.methods), *remarks])})"


def _trust(one: Assessment) -> str:
    """Whether the methods agree, whether all work was done, and how much was reported."""
    try:
        agreement = agreement_text(one.reconciliation)
    except StructureError as error:
        agreement = f"Methods could not be compared: {error}"
    serious = sum(len(part.serious) for part in (one.structure, *one.results.values(), one))
    state = "The work was stopped before its end." if not one.complete else ""
    limits = f"{counted(serious, 'finding limits', 'findings limit')} the trust; see below." if serious else ""
    return " ".join(part for part in (agreement, state, limits) if part)

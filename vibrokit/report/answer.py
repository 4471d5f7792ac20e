"""The answer of an assessment in a few sentences, for a reader who does not know the methods."""

from __future__ import annotations

import re

from vibrokit.assessment.answers import MeanTime
from vibrokit.assessment.assessment import Assessment
from vibrokit.assessment.durations import duration_text
from vibrokit.comparison.tables import agreement_sentence
from vibrokit.errors import StructureError, counted
from vibrokit.report.assessment import noise_text
from vibrokit.text_units import unit_text

_POWER = re.compile(r"(?<=[0-9])e([-+][0-9]+)|\b10\^(-?[0-9.]+)")


def answer_sentences(one: Assessment) -> tuple[str, ...]:
    """Return how long each state lasts, the longest first, and how far these numbers can be trusted."""
    times = dict(sorted(_mean_times(one).items(), key=lambda item: -item[1].log_value))
    open_ = ", ".join(_described(one, name) for name in one.names if name not in times)
    if not times:
        known = f"it is not known how long it stays in {open_}." if open_ else "no steady state was found."
        return _in_prose(f"The mass moves under {noise_text(one)}; {known}"), _trust(one)
    first, *others = (_left(one, name, time) for name, time in times.items())
    noise = noise_text(one)
    sentences = [f"{noise[0].upper()}{noise[1:]} drives the mass out of {first}."]
    if others:
        longest, *rest = times.values()
        ranked = not open_ and all(longest.log_lower > time.log_upper for time in rest)
        order = "" if ranked else " These intervals do not settle which state lasts longest."
        sentences.append(f"It drives the mass out of {'; out of '.join(others)}.{order}")
    if open_:
        sentences.append(f"It is not known how long the mass stays in {open_}.")
    if all(state.touched for state in one.structure.attractors):
        sentences.append("Every steady state that was found touches a stop: none runs clear.")
    return (*map(_in_prose, sentences), _trust(one))


def _mean_times(one: Assessment) -> dict[str, MeanTime]:
    found = {}
    for name in one.names:
        try:
            found[name] = one.mean_time(name)
        except StructureError:
            continue
    return found


def _left(one: Assessment, name: str, time: MeanTime) -> str:
    """After how long a state is left."""
    value, lower, upper = map(duration_text, (time.log_value, time.log_lower, time.log_upper))
    remarks = ", extrapolated" * time.extrapolated + ", before motion has settled there" * (not time.metastable)
    return f"{_described(one, name)} after {value} on average (95 % interval: {lower} to {upper}{remarks})"


def _described(one: Assessment, name: str) -> str:
    """A state, and how hard it is on the stops."""
    impacts = one.structure.attractors[one.names.index(name)].impacts
    noun = "impact" if impacts == 1 else "impacts"
    hits = f" ({impacts:.4g} {noun} per orbit)" if impacts else " (no impacts)" if one.oscillator.barriers else ""
    return f"“{name}”{hits}"


def _in_prose(text: str) -> str:
    """A text with powers of ten as they are printed: 2·10⁻⁵, 10²⁰⁶."""

    def power(match: re.Match[str]) -> str:
        return f"·10^{int(match[1])}" if match[1] else f"10^{float(match[2]):.0f}"

    return unit_text(_POWER.sub(power, text))


def _trust(one: Assessment) -> str:
    """Whether the methods agree, and how much was reported."""
    try:
        agreement = agreement_sentence(one.reconciliation)
    except StructureError as error:
        agreement = f"Methods could not be compared: {error}"
    serious = sum(len(part.serious) for part in (one.structure, *one.results.values(), one))
    limits = f" Below, {counted(serious, 'warning')} {'says' if serious == 1 else 'say'} what limits these numbers."
    return agreement + (limits if serious else "")

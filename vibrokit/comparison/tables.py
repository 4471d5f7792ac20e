"""A reconciliation as text: each exit's numbers by method, and the verdicts as sentences."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from vibrokit.comparison.quantities import OF_EXITS, OF_STATES, Kind, Quantity
from vibrokit.comparison.verdicts import Agreement, exit_name
from vibrokit.results.codes import Code
from vibrokit.text_table import number_text, power_text, text_table

if TYPE_CHECKING:
    from vibrokit.comparison.reconciliation import Reconciliation


def reconciliation_text(one: Reconciliation) -> str:
    """Return how long each state lasts and whether the methods agree, the verdicts, and a table of each exit."""
    sections = [overview_text(one), verdicts_text(one)]
    sections += ["\n".join([title, *text_table(rows)]) for title, rows in quantity_rows(one)]
    return "\n\n".join(section for section in sections if section)


def quantity_rows(one: Reconciliation) -> list[tuple[str, list[tuple[str, ...]]]]:
    """Return for each exit and each share of time its name, and rows of its numbers by method under their heading."""
    found = []
    for source, target in one.exits:
        own = (q for q in one.quantities if (q.source, q.target) == (source, target) and q.kind not in OF_STATES)
        found.append((exit_name(one.names, source, target), _rows(own, one.methods)))
    for label, name in enumerate(one.names):
        shares = one.shares(label)
        if shares:
            found.append((f"share of time in {name}", _rows(shares, one.methods)))
    return found


def overview_text(one: Reconciliation) -> str:
    """Return whether the methods agree, and the mean time until each state is left, the longest first."""
    return "\n".join([agreement_text(one), *_lasting(one)])


def agreement_text(one: Reconciliation) -> str:
    """Return whether the methods agree, and what could not be compared."""
    open_ = _about(one, (code for code in Agreement if code not in (Agreement.AGREE, Agreement.DISAGREE)))
    return " ".join([agreement_sentence(one), *([f"Not settled: {open_}."] if open_ else []), *_not_compared(one)])


def agreement_sentence(one: Reconciliation) -> str:
    """Return whether the methods agree."""
    wrong = _about(one, [Agreement.DISAGREE])
    if wrong:
        return f"Methods disagree on {wrong}: do not rely on its numbers yet."
    if _not_compared(one) or any(verdict.code is not Agreement.AGREE for verdict in one.verdicts):
        return "No methods disagree, but not every number is confirmed by a second method."
    return "All methods agree."


def _about(one: Reconciliation, codes: Iterable[Agreement]) -> str:
    """What the verdicts with these codes are about, each once."""
    wanted = tuple(codes)
    return ", ".join(dict.fromkeys(verdict.about(one.names) for verdict in one.verdicts if verdict.code in wanted))


def _not_compared(one: Reconciliation) -> list[str]:
    """Sentences on results that are incomplete, and on exits of which some methods say nothing."""
    incomplete = [str(finding.values["method"]) for finding in one.found(Code.USED_INCOMPLETE)]
    sentences = [f"Incomplete: {', '.join(incomplete)}."] if incomplete else []
    known = {(q.source, q.target, q.method) for q in one.quantities if q.kind in OF_EXITS}
    unknown: dict[str, list[str]] = {}
    for exit_ in one.exits:
        absent = ", ".join(method for method in one.methods if (*exit_, method) not in known)
        unknown.setdefault(absent, []).append(exit_name(one.names, *exit_))
    return [*sentences, *(f"Nothing on {', '.join(exits)} by {absent}." for absent, exits in unknown.items() if absent)]


def _lasting(one: Reconciliation) -> list[str]:
    """The mean time until each state is left, at the least intensity at which all of them are known."""
    times = [q for q in one.quantities if q.kind is Kind.LOG_TIME and q.resolved and q.metastable]
    leaving = [q for q in times if q.target == one.leaving(q.source)]
    known = [{q.intensity for q in leaving if q.source == source} for source in {q.source for q in leaving}]
    if not known or not set.intersection(*known):
        return []
    intensity = min(set.intersection(*known))
    best: dict[int, Quantity] = {}
    for q in leaving:
        if q.intensity == intensity and (q.source not in best or q.error < best[q.source].error):
            best[q.source] = q
    lines = [f"Mean time until a state is left at D = {intensity:g}, the longest first:"]
    for q in sorted(best.values(), key=lambda q: -q.value):
        value, lower, upper = map(power_text, (q.value, q.lower, q.upper))
        lines.append(f"  {one.names[q.source]}: {value} s ({lower} to {upper} s), by {q.method}")
    return lines


def verdicts_text(one: Reconciliation) -> str:
    """Return the verdicts, the serious ones first."""
    return "\n".join(f"{about} [{code}]: {sentence}" for about, code, sentence in verdict_rows(one))


def verdict_rows(one: Reconciliation) -> list[tuple[str, str, str]]:
    """Return what each verdict is about, its code and its sentence, the serious ones first."""
    order = list(Agreement)
    ranked = sorted(one.verdicts, key=lambda verdict: -order.index(verdict.code))
    return [(verdict.about(one.names), str(verdict.code), verdict.sentence()) for verdict in ranked]


def _rows(quantities: Iterable[Quantity], methods: tuple[str, ...]) -> list[tuple[str, ...]]:
    cells: dict[tuple[str, str], dict[str, str]] = {}
    for q in sorted(quantities, key=lambda q: (list(Kind).index(q.kind), -q.intensity if q.resolved else 0.0)):
        at = number_text(q.intensity, ".4g")
        cells.setdefault((q.kind.label, at), {})[q.method] = _cell(q)
    return [("", "D", *methods), *((*key, *(row.get(name, "") for name in methods)) for key, row in cells.items())]


def _cell(q: Quantity) -> str:
    if not q.resolved:
        return number_text(q.value, ".5g")
    if q.upper - q.lower <= 1e-4 * abs(q.value):
        return f"{q.value:.5g}"
    return f"{q.value:.4g} ({q.lower:.4g} to {q.upper:.4g})"

"""reconcile: compares several results of one scene."""

from __future__ import annotations

import dataclasses
import itertools
import os
import time
from collections.abc import Iterator, Sequence
from typing import Any

from vibrokit.arguments import real
from vibrokit.comparison.of_exits import exit_quantities, with_prefactors
from vibrokit.comparison.of_states import state_quantities
from vibrokit.comparison.pairs import Side, verdict_of, verdict_of_shares
from vibrokit.comparison.quantities import OF_EXITS, Kind, Quantity
from vibrokit.comparison.reconciliation import Reconciliation
from vibrokit.comparison.verdicts import Verdict
from vibrokit.construction import called
from vibrokit.errors import ParameterError, StructureError, shown
from vibrokit.results.codes import Code
from vibrokit.results.files import load_result
from vibrokit.results.finding import Finding
from vibrokit.results.one_scene import check_comparable
from vibrokit.results.record import Record
from vibrokit.results.result import Result


@called
def reconcile(*given: Result | str | os.PathLike[str], level: float = 0.01) -> Reconciliation:
    """Compare several results of one scene.

    Each pair of results is compared exit by exit: mean times at common noise intensities, which a χ² test takes
    together, or energies where there are none. A result that is incomplete is used as far as it goes.

    Parameters
    ----------
    *given : Result or path
        Two at least, such as those of `LeastAction`, `SGCM` and `MFET`, or files of them.
    level : float
        Probability of a false alarm in each verdict, above 0 and below 1.

    Returns
    -------
    Reconciliation

    Raises
    ------
    ParameterError
        The level is not between 0 and 1.
    StructureError
        There are fewer than two results, one is of a kind without energies or rates, they are of different scenes or
        structures, or have no exit in common.
    """
    begun = time.monotonic()
    if not 0.0 < real(level) < 1.0:
        raise ParameterError(f"level must be a probability above 0 and below 1, got {shown(level)}.")
    results = _results_of(given)
    methods = _method_names(results)
    named = list(zip(results, methods, strict=True))
    found = _with_totals([q for result, method in named for q in exit_quantities(result, method)], methods)
    found += with_prefactors(found)
    found += [q for result, method in named for q in state_quantities(result, method)]
    known = [{(q.source, q.target) for q in found if q.method == method and q.kind in OF_EXITS} for method in methods]
    if not any(one & other for one, other in itertools.combinations(known, 2)):
        raise StructureError(
            "the results have no exit in common, so there is nothing to compare; analyze the same attractors with the "
            "same exit."
        )
    incomplete = [
        Finding.of(Code.USED_INCOMPLETE, method=method)
        for result, method in zip(results, methods, strict=True)
        if not result.complete
    ]
    return Reconciliation(
        scene=results[0].scene,
        settings={"level": float(level), "methods": list(methods)},
        findings=tuple(incomplete),
        complete=all(result.complete for result in results),
        seconds=time.monotonic() - begun,
        attractors=results[0].names,
        methods=methods,
        quantities=tuple(found),
        verdicts=tuple(_verdicts(found, results, methods, level)),
        level=float(level),
    )


def _results_of(given: Sequence[Any]) -> list[Result]:
    """Return results and those of files; raises StructureError unless they are two or more on one structure."""
    results = [load_result(one) if isinstance(one, str | os.PathLike) else one for one in given]
    for result in results:
        if not isinstance(result, Result):
            raise StructureError(
                "reconcile takes results with energies or rates, as of LeastAction, SGCM or MFET, got "
                f"{f'a record of kind {result.kind!r}' if isinstance(result, Record) else shown(result)}."
            )
    if len(results) < 2:
        raise StructureError(f"reconcile needs two results or more to compare, got {len(results)}.")
    first = results[0]
    for number, other in enumerate(results[1:], start=2):
        check_comparable(f"result {number}", other, first.scene, first.section)
    return results


def numbered(name: str) -> Iterator[str]:
    """Yield the names that a first, a second, … result of one analyzer has: ``"mfet"``, ``"mfet 2"``, …."""
    yield name
    yield from (f"{name} {number}" for number in itertools.count(2))


def _method_names(results: Sequence[Result]) -> tuple[str, ...]:
    names = list[str]()
    for result in results:
        names.append(next(name for name in numbered(result.made_by) if name not in names))
    return tuple(names)


def _with_totals(quantities: list[Quantity], methods: Sequence[str]) -> list[Quantity]:
    """Add leaving at all for methods that know a single target where others know several."""
    several = {q.source for q in quantities if q.target is None}
    added = []
    for method, source, kind in itertools.product(methods, sorted(several), Kind):
        own = [q for q in quantities if (q.method, q.source, q.kind) == (method, source, kind)]
        if all(q.target is not None for q in own):
            added += [dataclasses.replace(q, target=None) for q in own]
    return quantities + added


def _verdicts(
    quantities: Sequence[Quantity], results: Sequence[Result], methods: Sequence[str], level: float
) -> list[Verdict]:
    """Verdicts on each pair of results: on exits of attractors that both analyzed, then on shares of time."""
    exits = dict.fromkeys((q.source, q.target) for q in quantities if q.kind in OF_EXITS)
    analyzed = {(q.method, q.source) for q in quantities if q.kind in OF_EXITS}
    found: list[Verdict | None] = []
    for pair in itertools.combinations(zip(results, methods, strict=True), 2):
        for source, target in exits:
            if all((method, source) in analyzed for _, method in pair):
                one, other = (_side(quantities, *each, source, target) for each in pair)
                found.append(verdict_of((one, other), source, target, level))
        for label in range(len(results[0].names)):
            one, other = (_side_of_state(quantities, *each, label) for each in pair)
            found.append(verdict_of_shares((one, other), label, level))
    return [verdict for verdict in found if verdict is not None]


def _side_of_state(quantities: Sequence[Quantity], result: Result, method: str, label: int) -> Side:
    own = tuple(q for q in quantities if (q.kind, q.method, q.source) == (Kind.OCCUPANCY, method, label))
    return Side(method, None, own, ("", ""), result.refined_by)


def _side(quantities: Sequence[Quantity], result: Result, method: str, source: int, target: int | None) -> Side:
    own = [q for q in quantities if (q.method, q.source, q.target) == (method, source, target)]
    energies = [q for q in own if q.kind is Kind.ENERGY] or [q for q in own if q.kind is Kind.ARRHENIUS]
    times = tuple(q for q in own if q.kind is Kind.LOG_TIME)
    settings = result.settings.get("exit")
    leaving = {k: v for k, v in settings.items() if k != "for_good"} if isinstance(settings, dict) else {}
    event = times[0].event if times else ""
    return Side(method, energies[0] if energies else None, times, (_text(leaving), event), result.refined_by)


def _text(settings: dict[str, Any]) -> str:
    rest = [f"{key} = {value}" for key, value in sorted(settings.items()) if key != "name" and value is not None]
    return ", ".join([str(settings.get("name", "")), *rest]) if settings else ""

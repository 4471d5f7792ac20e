"""Reconciliation: the numbers of several results for each exit of one scene, and whether they agree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import xarray

from vibrokit.comparison.quantities import OF_EXITS, OF_STATES, Kind, Quantity
from vibrokit.comparison.verdicts import Agreement, Verdict, exit_name
from vibrokit.construction import called
from vibrokit.errors import ResultFileError, StructureError, counted
from vibrokit.results.arrays import Arrays
from vibrokit.results.attractor import Attractor
from vibrokit.results.fields import Whole
from vibrokit.results.labels import goal_of, label_of
from vibrokit.results.record import Record, Summary
from vibrokit.results.table import Table, fields_of

if TYPE_CHECKING:
    from vibrokit.plots.exit_times import ReconciliationArtists

_ANY = -3  # in files: the label of leaving at all
_TARGET = Whole("label of what is reached; -1 for another exit, -2 for escape, -3 for leaving at all", low=_ANY)
_QUANTITIES, _VERDICTS = (
    Table(name, fields_of(kind) | {"target": _TARGET}) for name, kind in (("quantity", Quantity), ("verdict", Verdict))
)
_OF_ATTRACTORS = {name: fields_of(Attractor)[name] for name in ("label", "name")}
_NAMES = Table("attractor", _OF_ATTRACTORS, index="label")


class Reconciliation(Record):
    """The numbers of several results for each exit, and verdicts on each pair of them."""

    kind: ClassVar[str] = "reconciliation"

    attractors: Annotated[tuple[str, ...], "names of the attractors, in the order of their labels"]
    methods: Annotated[tuple[str, ...], "names of the results that were compared, in their order"]
    quantities: Annotated[tuple[Quantity, ...], "all numbers"]
    verdicts: Annotated[tuple[Verdict, ...], "for each pair of results, on each exit that one knows and on each share"]
    level: Annotated[float, "probability of a false alarm in each verdict, if all errors are normal and as stated"]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the attractors, in the order of their labels."""
        return self.attractors

    @property
    def exits(self) -> tuple[tuple[int, int | None], ...]:
        """Source and target of each exit; the target is None for leaving at all, where there are several targets."""
        found = {(q.source, q.target) for q in self.quantities if q.kind in OF_EXITS}
        return tuple(sorted(found, key=lambda pair: (pair[0], pair[1] is None, pair[1] or 0)))

    @property
    def agreed(self) -> bool:
        """Whether no verdict is "disagree"."""
        return all(verdict.code is not Agreement.DISAGREE for verdict in self.verdicts)

    def leaving(self, source: int) -> int | None:
        """Return the target that stands for leaving a state at all, by label: None, or the only one that is known."""
        targets = [target for start, target in self.exits if start == source]
        return targets[0] if len(targets) == 1 else None

    @called
    def table(self, source: int | str, target: int | str | None = None) -> tuple[Quantity, ...]:
        """Return all numbers of one exit, by labels or names.

        Parameters
        ----------
        source : int or str
        target : int or str, optional
            By default leaving at all.

        Raises
        ------
        StructureError
            There is no such attractor, or nothing is known of this exit.
        """
        wanted = self._exit(source, target)
        return tuple(q for q in self.quantities if (q.source, q.target) == wanted and q.kind not in OF_STATES)

    @called
    def shares(self, source: int | str) -> tuple[Quantity, ...]:
        """Return all numbers on the share of time in one state, by label or name."""
        label = label_of(source, self.names)
        return tuple(q for q in self.quantities if q.source == label and q.kind in OF_STATES)

    @called
    def verdicts_of(self, source: int | str, target: int | str | None = None) -> tuple[Verdict, ...]:
        """Return the verdicts on one exit; arguments and errors as of `table`."""
        wanted = self._exit(source, target)
        return tuple(v for v in self.verdicts if (v.source, v.target) == wanted and v.kind is not Kind.OCCUPANCY)

    def _exit(self, source: int | str, target: int | str | None) -> tuple[int, int | None]:
        label = label_of(source, self.names)
        own = [pair for pair in self.exits if pair[0] == label]
        goal = None if target is None else goal_of(target, self.names)
        goal = self.leaving(label) if goal is None else goal
        if (label, goal) not in own:
            known = ", ".join(exit_name(self.names, *pair) for pair in own) or "none"
            raise StructureError(
                f"nothing is known of {exit_name(self.names, label, goal)}; exits that are known: {known}."
            )
        return label, goal

    @property
    def summary(self) -> Summary:
        """The verdicts."""
        title = f"Reconciliation of {', '.join(self.methods)}: {counted(len(self.verdicts), 'verdict')}"
        ranked = sorted(self.verdicts, key=lambda verdict: verdict.code is not Agreement.DISAGREE)
        return Summary(title, tuple((v.about(self.names), f"{v.code}", v.sentence()) for v in ranked))

    def __str__(self) -> str:
        from vibrokit.comparison.tables import reconciliation_text

        return reconciliation_text(self)

    @called
    def plot(self, ax: Any = None) -> ReconciliationArtists:
        """Draw ln τ against 1/D by all methods with a line of slope ΔU; see `vibrokit.plots.exit_times`.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
        """
        from vibrokit.plots.exit_times import ArrheniusLine, ExitTimes, reconciled_times

        series, methods, lines = list[ExitTimes](), list[str](), []
        for index, (source, target) in enumerate(self.exits):
            place = [start for start, _ in self.exits[:index]].count(source)
            own = [q for q in self.quantities if (q.source, q.target) == (source, target)]
            title = exit_name(self.names, source, target)
            for method in self.methods:
                times = [q for q in own if q.kind is Kind.LOG_TIME and q.method == method]
                if times:
                    intensity, value, error = (
                        [getattr(q, name) for q in times] for name in ("intensity", "value", "error")
                    )
                    series.append(ExitTimes(intensity, value, error, source, f"{title}, {method}", place))
                    methods.append(method)
            known = [q for q in own if q.kind is Kind.ENERGY and q.resolved]
            prefactors = [q for q in own if q.kind is Kind.LOG_PREFACTOR and q.resolved]
            if known and prefactors:
                weakest = min(prefactors, key=lambda q: (q.intensity, q.error))
                energy = min(known, key=lambda q: q.error)
                words = f"{title}, slope ΔU of {energy.method}"
                lines.append(ArrheniusLine(energy.value, weakest.value, label=source, title=words, place=place))
        return reconciled_times(series, methods, lines, ax=ax)

    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays with dimensions, coordinates, units and long names."""
        found = _NAMES.variables(self.attractors, label=range(len(self.attractors)), name=self.attractors)
        for table, records in ((_QUANTITIES, self.quantities), (_VERDICTS, self.verdicts)):
            found |= table.variables(records, target=[_ANY if r.target is None else r.target for r in records])
        return xarray.Dataset(found)

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a reconciliation of its arrays; raises ResultFileError."""
        arrays, settings = Arrays(dataset), provenance["settings"]
        methods, level = settings.get("methods"), settings.get("level")
        if (
            not isinstance(level, float)
            or not isinstance(methods, list)
            or not all(isinstance(m, str) for m in methods)
        ):
            raise ResultFileError("its settings have no level, or no methods by name")
        names = tuple(values["name"] for values in _NAMES.read(arrays))
        quantities, verdicts = _QUANTITIES.read(arrays), _VERDICTS.read(arrays)
        for values in (*quantities, *verdicts):
            if max(values["source"], values["target"]) >= len(names):
                raise ResultFileError(f"a number is of attractor {values['source']}, and there are {len(names)}")
            values["target"] = None if values["target"] == _ANY else values["target"]
        return cls(
            attractors=names,
            methods=tuple(methods),
            level=level,
            quantities=tuple(Quantity(**values) for values in quantities),
            verdicts=tuple(Verdict(**values) for values in verdicts),
            **provenance,
        )

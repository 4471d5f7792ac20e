"""Record: what every saved outcome has: where it came from, what was found, and how it is saved, shown and drawn."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import inspect
import os
import platform
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, dataclass_transform

from vibrokit.construction import Constructed, called
from vibrokit.documented import documented
from vibrokit.errors import ResultFileError
from vibrokit.progress import Stats
from vibrokit.results.atomic import write_atomically
from vibrokit.results.codes import Code, Severity
from vibrokit.results.finding import Finding, check_findings, together
from vibrokit.results.netcdf import content_of
from vibrokit.results.provenance import provenance_data

if TYPE_CHECKING:
    import xarray

    from vibrokit.oscillator import Oscillator
    from vibrokit.report.report import Report

Data = Mapping[str, Any]

_SETTINGS = "the arguments or the analyzer's configuration as plain data, from which the same can be built again"


def versions() -> dict[str, str]:
    """Return the versions of Python, the toolkit and the libraries it uses, by name."""
    libraries = ("vibrokit", "numpy", "scipy", "sympy", "numba")
    return {"python": platform.python_version()} | {name: importlib.metadata.version(name) for name in libraries}


@documented
@dataclasses.dataclass(frozen=True)
class Summary:
    """A title and a table."""

    title: Annotated[str, "the title"]
    rows: Annotated[tuple[tuple[str, ...], ...], "the first cell of each row is its name"] = ()

    def text(self, findings: Sequence[Finding], names: Sequence[str]) -> str:
        """Return at most five lines: the title, the first rows, the first warning or error."""
        lines = [self.title, *(f"  {row[0]}: {', '.join(row[1:])}" for row in self.rows[:3])]
        if len(self.rows) > 3:
            lines[-1] += f" … and {len(self.rows) - 3} more"
        serious = [finding for finding in together(findings) if finding.severity is not Severity.INFO]
        lines += [f"  {one.severity}: {' '.join(one.sentence(names).split())}" for one in serious[:1]]
        return "\n".join(line if len(line) <= 160 else f"{line[:160]}…" for line in lines)

    def html(self, findings: Sequence[Finding], names: Sequence[str]) -> str:
        """Return the title, the table and all findings as HTML."""
        body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in self.rows)
        table = f"<table>{body}</table>" if body else ""
        items = "".join(f"<li>{one.severity}: {escape(one.sentence(names))}</li>" for one in together(findings))
        return f"<p><b>{escape(self.title)}</b></p>{table}{f'<ul>{items}</ul>' if items else ''}"


@documented
@dataclass_transform(frozen_default=True, eq_default=False, kw_only_default=True, field_specifiers=(dataclasses.field,))
@dataclasses.dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Record(ABC, metaclass=Constructed):
    """The outcome of one piece of work. Abstract.

    A subclass becomes a frozen dataclass by itself; no decorator is needed.

    For developers
    --------------
    A concrete subclass names its `kind`, which files carry, writes `names`, `plot`, `to_dataset` and `from_dataset`,
    and is registered under the entry-point group ``vibrokit.records`` by its kind. From these everything else just
    works: saving, opening, drawing a saved one.
    """

    kind: ClassVar[str] = ""

    scene: Annotated[Data, "the scene as plain data, with every parameter"]
    settings: Annotated[Data, _SETTINGS] = dataclasses.field(default_factory=dict)
    findings: Annotated[tuple[Finding, ...], "what was found besides numbers"] = ()
    stats: Annotated[Stats, "how much work it took"] = dataclasses.field(default_factory=Stats)
    complete: Annotated[bool, "False if the work was stopped before its end"] = True
    seed: Annotated[int | None, "seed of what was random"] = None
    seconds: Annotated[float, "time that it took", "s"] = 0.0
    versions: Annotated[Data, "versions of the toolkit and of libraries"] = dataclasses.field(default_factory=versions)

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        documented(dataclasses.dataclass(frozen=True, eq=False, repr=False, kw_only=True)(cls))
        if not inspect.isabstract(cls) and ABC not in cls.__bases__ and not cls.__dict__.get("kind"):
            raise TypeError(
                f'{cls.__name__} names no kind; write kind: ClassVar[str] = "...", the name that its files carry.'
            )

    def __post_init__(self) -> None:
        check_findings(self.findings)

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the attractors, in the order of their labels."""

    @abstractmethod
    def plot(self, ax: Any = None) -> Any:
        """Draw the record into `ax`, or into a new figure; return a `vibrokit.plots.artists.Artists`."""

    @abstractmethod
    def to_dataset(self) -> xarray.Dataset:
        """Return the arrays of the record with dimensions, coordinates, units and long names."""

    @classmethod
    @abstractmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        """Make a record of its arrays, which may come from a stranger's file; raises ResultFileError."""

    @property
    def made_by(self) -> str:
        """Name of the analyzer that made it; the kind of a record that no analyzer made."""
        return str(self.settings.get("analyzer") or self.kind)

    @property
    def status(self) -> str:
        """The findings as sentences, a line each."""
        return "\n".join(finding.sentence(self.names) for finding in self.findings)

    @called
    def found(self, code: Code) -> tuple[Finding, ...]:
        """Return the findings of a code."""
        return tuple(finding for finding in self.findings if finding.code is code)

    @property
    def summary(self) -> Summary:
        """Title and rows for a console or a notebook; the findings are added to them."""
        return Summary(type(self).__name__)

    def __repr__(self) -> str:
        return self.summary.text(self.findings, self.names)

    def _repr_html_(self) -> str:
        return self.summary.html(self.findings, self.names)

    @property
    def serious(self) -> tuple[Finding, ...]:
        """The warnings and errors among the findings."""
        return tuple(finding for finding in self.findings if finding.severity is not Severity.INFO)

    @property
    def failed(self) -> bool:
        """Whether something that was asked for is missing."""
        return any(finding.severity is Severity.ERROR for finding in self.findings)

    @property
    def oscillator(self) -> Oscillator:
        """The scene as an oscillator."""
        from vibrokit.scene_file import scene_from_data

        return scene_from_data(self.scene)

    @called
    def report(self, *others: Record, title: str = "Vibro-impact oscillator") -> Report:
        """Return a page on this record, and on others of the same scene; see `vibrokit.Report`."""
        from vibrokit.report.report import Report

        return Report.of(self, *others, title=title)

    @property
    def provenance(self) -> dict[str, Any]:
        """Kind and provenance as plain data."""
        own = {field.name: getattr(self, field.name) for field in dataclasses.fields(Record)}
        return provenance_data(self.kind, self.names, own)

    @called
    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to a netCDF file, whole or not at all; `vibrokit.load_result` opens it.

        Raises
        ------
        ResultFileError
            It has something that netCDF 3 cannot hold.
        """
        try:
            content = self._content()
        except ResultFileError as error:
            raise ResultFileError(f"{type(self).__name__} cannot be saved: {str(error).rstrip('.')}.") from error
        write_atomically(path, content)

    def _content(self) -> bytes:
        """The content of its file, with attributes for people who look into that."""
        document = (type(self).__doc__ or "").strip().partition("\n")[0]
        software = f"vibrokit {self.versions.get('vibrokit', '')}".strip()
        seed = "" if self.seed is None else f", seed {self.seed}"
        about = {
            "title": f"{self.kind}: {document}",
            "Conventions": "CF-1.11",
            "source": software,
            "history": f"computed by {software} in {self.seconds:.1f} s{seed}",
            "status": self.status,
        }
        return content_of(self.to_dataset(), about, self.provenance)

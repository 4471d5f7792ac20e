"""Pages of the manual that are made of tables: each number stands in a CSV file of docs/data, which a command wrote.

`write(docs)` makes validation.rst, performance.rst and barriers.rst. The first line of each CSV file has the command.
"""

from __future__ import annotations

import csv
import dataclasses
import io
import math
import re
import textwrap
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

Row = dict[str, str]
Page = list[str]

COMMENT = "# "
EXACT_BOUNDS = ("certified", "exact")  # two-sided bounds
FEWEST_DIGITS, MOST_DIGITS = 5, 10
WIDTH = 120
PAPER, OTHER = "Scenes of the paper", "Other scenes"
COUNTS = ("exits", "certified or exact", "closed forms", "within bounds", "largest difference")
LEFT_OUT = ("=0.0001)", "=1e-08)", "=1e-12)", "both stops")  # contestants that the CSV file alone has, by their ends
SHOWN = ("energy", "mean_time")  # questions of the public cases whose answers are listed one by one


@dataclasses.dataclass(frozen=True)
class Table:
    """A CSV file with the comments before its column names."""

    path: Path
    comments: Row
    rows: list[Row]

    @property
    def source(self) -> str:
        """The command, the file and the machine, as a paragraph."""
        name = self.path.name
        machine = f"; {self.comments['machine']}" if "machine" in self.comments else ""
        return f"``{self.comments['command']}`` → :download:`{name} <data/{name}>`{machine}"


def read(path: Path) -> Table:
    """Read a CSV file; comments are lines such as ``# command: …``."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    comments = [line.removeprefix(COMMENT).rstrip("\n") for line in lines if line.startswith(COMMENT)]
    rows = list(csv.DictReader(line for line in lines if not line.startswith(COMMENT)))
    return Table(path, dict(comment.split(": ", 1) for comment in comments), rows)


def write(docs: Path) -> None:
    """Write all pages."""
    validation(docs)
    performance(docs)
    barriers(docs)


# --- pages


def validation(docs: Path) -> None:
    """The page of comparisons with closed forms, published values and other programs."""
    _write(
        docs / "validation.rst",
        "Validation",
        "Each table compares numbers of vibrokit with closed forms, published values or results of other "
        "programs. The command above a table writes the CSV file of which the table is made. Energies are in m² "
        "s⁻³.",
        (_public_cases, _extremes, _gallery_exact, _published, _independent, _spectrum),
    )


def performance(docs: Path) -> None:
    """The page of computing times."""
    _write(
        docs / "performance.rst",
        "Performance",
        "The contestants of a race run one after another in each round, and a ratio compares times of the same "
        "round: its median stands before the quartiles. The command above a table writes the CSV file of which the "
        "table is made, on the machine that stands beside it.",
        (_analyzers, _steppers, _located, _races, _compilation),
    )


def barriers(docs: Path) -> None:
    """The page of energies, one row for each exit."""
    _write(
        docs / "barriers.rst",
        "Computed barriers",
        "Activation energies ΔU (m² s⁻³) of the scenes that the tests use as references, one row for each exit. "
        "Download the file of a scene and run ``vibrokit run FILE.toml`` to compute its rows, or ``vibrokit run "
        "FILE.toml --exit first-contact`` where the target is a stop. ``lower`` and ``upper`` are bounds of ΔU; "
        "``bound`` names their basis (:doc:`how-to/least-action`). The error is that of the "
        "certificate, relative to ΔU; rows without one have no certified path. A value behind ≤ is an upper "
        "bound.",
        (_energies,),
    )


def _write(path: Path, title: str, text: str, sections: Sequence[Callable[[Path], Page]]) -> None:
    page = _section(title, text, line="=")
    for section in sections:
        page += section(path.parent / "data")
    path.write_text("\n".join(page).rstrip("\n") + "\n", encoding="utf-8")


# --- sections of the validation


def _public_cases(data: Path) -> Page:
    if not (table := _table(data, "public_cases")):
        return []
    questions: dict[str, list[Row]] = {}
    for row in table.rows:
        questions.setdefault(row["question"], []).append(row)
    cases = {row["case"] for row in table.rows}
    missed = [row for row in table.rows if row["met"] == "no"]
    unmet = {row["case"] for row in missed}
    page = _section(
        "Scenes from the literature",
        f"{len(cases)} scenes come from papers, textbooks, and the issues and examples of other programs, with "
        f"{len(table.rows)} right values: closed forms, published numbers, or results of independent integration. "
        f"The tolerances are those of the sources. vibrokit meets {len(table.rows) - len(missed)} of "
        f"{len(table.rows)} values and {len(cases) - len(unmet)} of {len(cases)} scenes with default settings. The "
        "last column has the largest difference of the values that are met, in units of their tolerance.",
        table,
    )
    page += _grid(
        ("question", "values", "met", "largest difference"),
        (
            (
                question.replace("_", " "), str(len(rows)), str(sum(row["met"] == "yes" for row in rows)),
                _largest(float(row["used"]) for row in rows if row["met"] == "yes"),
            )
            for question, rows in questions.items()
        ),
    )  # fmt: skip
    for row in missed:
        reason = row["remark"].partition(":")[0] or "the value differs"
        page += [f"Not met: {row['case']}, {row['question'].replace('_', ' ')} ({reason}).", ""]
    page += ["The energies and mean exit times (s) among them:", ""]
    page += _grid(
        ("scene", "quantity", "found", "right", "tolerance", "source"),
        (
            (
                row["case"], row["question"].replace("_", " "), _digits(row["found"], 8), _digits(row["right"], 8),
                row["tolerance"], row["source"],
            )
            for row in table.rows if row["question"] in SHOWN
        ),
    )  # fmt: skip
    return page


def _extremes(data: Path) -> Page:
    if not (table := _table(data, "extremes")):
        return []
    families: dict[str, list[Row]] = {}
    for row in table.rows:
        families.setdefault(_family(row["scene"]), []).append(row)
    page = _section(
        "Extreme scenes",
        "Stiffnesses from 1 to 1e8, damping ratios from 1e-4 to 2, and distances from a fold or from grazing "
        "contact of 1e-8 to 1e-2. Where a closed form exists, the columns count the exits whose bounds contain "
        "it, and have the largest relative difference of the energies that are certified or exact. The other "
        "energies are upper bounds and estimates. A scene without an energy has one attractor, or the time limit "
        "stopped a search.",
        table,
    )
    return page + _grid(
        ("family", "scenes", "without an energy", *COUNTS),
        ((family, *_scenes(rows), *_counts(rows)) for family, rows in families.items()),
    )


def _gallery_exact(data: Path) -> Page:
    if not (table := _table(data, "gallery")):
        return []
    scenes: dict[str, list[Row]] = {}
    for row in table.rows:
        if row["exact"]:
            scenes.setdefault(_name(row["scene"]), []).append(row)
    page = _section(
        "Closed forms of the gallery",
        "Without forcing, with linear damping and additive noise, ΔU is 4ζω_n times the potential barrier per "
        "unit mass; the least action to the first contact with a stop is 2ζω_n³c², where c is the smallest "
        "distance of the forced motion from the stop (:doc:`conventions`).",
        table,
    )
    return page + _grid(
        ("scene", *COUNTS),
        ((scene, *_counts(rows)) for scene, rows in scenes.items()),
    )


def _published(data: Path) -> Page:
    if not (table := _table(data, "published")):
        return []
    met = sum(row["verdict"] == "met" for row in table.rows)
    page = _section(
        "Published energies of the paper",
        f"The same three methods give {met} of the {len(table.rows)} published energies (:doc:`bibliography`) "
        "within their errors. I is the state that hits the stops, N the state that runs clear of them.",
        table,
    )
    columns = ("scene", "state", "method", "published", "here", "reason")
    return page + _grid((*columns[:-1], "comparison"), ([row[column] for column in columns] for row in table.rows))


def _independent(data: Path) -> Page:
    minimized, carried = _table(data, "minimized"), _table(data, "carried")
    if not (minimized and carried):
        return []
    page = _section(
        "Independent programs",
        "Two programs of the tests share no code with vibrokit. The first minimizes the action on a grid of "
        "quintic elements, from a certified path. The second carries each path from section to section by SciPy's "
        "DOP853 and Hamilton's equations that are written out by hand. Columns have the largest relative "
        "difference of the action, and the largest misfit at a section in units of the extent of the path.",
        minimized,
        carried,
    )
    names = dict.fromkeys(row["scene"] for table in (minimized, carried) for row in table.rows)

    def largest(table: Table, scene: str, column: str) -> str:
        return _largest(abs(float(row[column])) for row in table.rows if row["scene"] == scene)

    return page + _grid(
        ("scene", "paths", "minimized: action", "carried: action", "carried: misfit"),
        (
            (
                name, str(sum(row["scene"] == name for row in carried.rows)), largest(minimized, name, "difference"),
                largest(carried, name, "difference"), largest(carried, name, "misfit"),
            )
            for name in names
        ),
    )  # fmt: skip


def _spectrum(data: Path) -> Page:
    if not (table := _table(data, "klein_kramers")):
        return []
    page = _section(
        "Exit rates at finite noise",
        "ln of the rate (s⁻¹) from one well of :math:`\\ddot x + 2\\zeta\\dot x - x + x^3 = \\xi` to the other: "
        "by the spectrum of the Klein–Kramers operator, by SGCM and by MFET, with the error estimates of both.",
        table,
    )
    return page + _grid(
        ("ζ", "ΔU/D", "spectrum", "SGCM", "MFET"),
        (
            (
                row["damping"], row["ratio"], f"{float(row['spectrum']):.4f}",
                *(f"{float(row[name]):.3f} ± {float(row[name + '_error']):.3f}" for name in ("sgcm", "mfet")),
            )
            for row in table.rows
        ),
    )  # fmt: skip


# --- sections of the performance


def _analyzers(data: Path) -> Page:
    if not (table := _table(data, "analyzers")):
        return []
    page = _section(
        "Analyzers",
        "Processor time of all threads (s) on ``hertz-0.570`` with default settings, compiled kernels and one "
        "source at a time. The mean time is that of the likeliest exit, in forcing periods, at the noise "
        "intensity of the scene.",
        table,
    )
    whole, *sources = dict.fromkeys(row["source"] for row in table.rows)  # the structure is that of all sources
    by_analyzer: dict[tuple[str, str], list[str]] = {}
    for row in table.rows:
        value = row["value"] if row["source"] == whole else f"{row['value']} ± {row['error']}"
        by_analyzer.setdefault((row["analyzer"], row["quantity"]), []).extend((value, row["seconds"]))
    heads = [head for source in sources for head in (source, "seconds")]
    rows = ((*what, *cells, *[""] * (len(heads) - len(cells))) for what, cells in by_analyzer.items())
    return page + _grid(("analyzer", "quantity", *heads), rows)


def _steppers(data: Path) -> Page:
    if not (table := _table(data, "steppers")):
        return []
    page = _section(
        "Steppers",
        "Distance in (x, v) from a finer reference after two periods, over 64 starts on ``hertz-0.570``, and time "
        "(µs) for each trajectory and period, in an ensemble and of one trajectory alone. ``vibrokit trade "
        "SCENE`` measures this for a scene of yours.",
        table,
    )
    ladders: dict[str, list[Row]] = {}
    for row in table.rows:
        ladders.setdefault(row["stepper"].partition("(")[0], []).append(row)
    shown = [row for rows in ladders.values() for n, row in enumerate(rows) if n % 2 or row["default"]]
    return page + _grid(
        ("stepper", "median error", "90 %", "ensemble", "alone"),
        (
            (
                f"``{row['stepper']}``" + (", default" if row["default"] else ""), row["error"], row["error_90"],
                row["ensemble_us"], row["alone_us"],
            )
            for row in shown
        ),
    )  # fmt: skip


def _located(data: Path) -> Page:
    if not (table := _table(data, "located_ensemble")):
        return []
    flows = list(dict.fromkeys(row["flow"] for row in table.rows))
    of = {(row["flow"], row["contestant"]): row for row in table.rows}
    page = _section(
        "Ensembles with stops",
        "4096 trajectories over five periods that start near the hammering state of ``hertz-0.570``: median error "
        "in (x, v) of the motion, and time (µs) for each trajectory and period.",
        table,
    )
    return page + _grid(
        ("stepper", "error", *(flow.replace("_", " ") for flow in flows)),
        (
            (f"``{name}``", of[flows[0], name]["error"], *(of[flow, name]["cost"] for flow in flows))
            for name in dict.fromkeys(row["contestant"] for row in table.rows)
            if not name.endswith(LEFT_OUT)
        ),
    )


def _races(data: Path) -> Page:
    races = (
        ("hamiltonian_ensemble", "Hamilton's equations, µs per trajectory and period"),
        ("stochastic_step", "one noisy step, ns"),
        ("basins", "basin of 400 × 400 cells, s"),
        ("ring_speed", "action plot, processor s"),
    )
    tables = [(table, quantity) for name, quantity in races if (table := _table(data, name))]
    if not tables:
        return []
    page = _section(
        "Against loops written by hand",
        "Programs in Numba and C for ``hertz-0.570`` alone, with constants inlined and tabulated forcing; the naive "
        "one evaluates the formula as written. Before a race, the results of the contestants are compared. Ratios are "
        "to the first program of each race.",
        *(table for table, _ in tables),
    )
    rows = []
    for table, quantity in tables:
        for row in table.rows:
            if row["contestant"].endswith(LEFT_OUT):
                continue
            what = quantity + (f", {row['attractor']}" if "attractor" in row else "")
            rows.append(
                (
                    what,
                    row["contestant"],
                    row.get("total", row["cost"]),
                    f"{row['ratio']} ({row['ratio_25']} – {row['ratio_75']})",
                )
            )
    return page + _grid(("race", "program", "median", "ratio"), rows)


def _compilation(data: Path) -> Page:
    if not (table := _table(data, "compile_cost")):
        return []
    page = _section(
        "Compilation",
        "Processor seconds until a kernel of a scene with one stop runs: of the first scene with an empty folder of "
        "kernels (the flows one after another), of another scene with a spring or a law of another form, and loaded "
        "from disk by another process.",
        table,
    )
    steppers = dict.fromkeys(row["stepper"] for row in table.rows)
    of = {(row["stepper"], row["flow"]): row for row in table.rows}
    return page + _grid(
        ("flow", *steppers),
        (
            (
                flow.replace("_", " "),
                *(" / ".join(of[stepper, flow][key] for key in ("first", "another", "loaded")) for stepper in steppers),
            )
            for flow in dict.fromkeys(row["flow"] for row in table.rows)
        ),
    )


# --- rows of energies


def _energies(data: Path) -> Page:
    if not (table := _table(data, "gallery")):
        return []
    page = [table.source, ""]
    for title, rows in _by_kind(table.rows).items():
        page += _section(title, "") + _barrier_rows(rows)
    return page


def _by_kind(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows with an energy: those of the scenes of the paper, and the others."""
    kinds: dict[str, list[Row]] = {PAPER: [], OTHER: []}
    for row in rows:
        if row["energy"]:
            kinds[PAPER if _name(row["scene"]).startswith("hertz-") else OTHER].append(row)
    return {title: own for title, own in kinds.items() if own}


def _barrier_rows(rows: Sequence[Row]) -> Page:
    return _grid(
        ("scene", "exit", "ΔU", "lower", "upper", "bound", "error"),
        ((_scene_link(_name(row["scene"])), row["exit"], *_energy(row)) for row in rows),
    )


def _scene_link(name: str) -> str:
    return f":download:`{name} <data/scenes/{file_name(name)}>`"


def file_name(name: str) -> str:
    """The name of the file of a scene: letters and digits, and the dot of a decimal number."""
    return re.sub(r"[^a-z0-9.]+", "-", name.lower()).strip("-") + ".toml"


def _energy(row: Row) -> tuple[str, ...]:
    """Energy with as many digits as its error has, its bounds, their kind and the error."""
    value, lower, upper, error = (float(row[column]) for column in ("energy", "lower", "upper", "error"))
    relative = max(error / value, 1e-16) if row["residual"] and value > 0 else math.nan
    digits = FEWEST_DIGITS if math.isnan(relative) else min(max(int(-math.log10(relative)), FEWEST_DIGITS), MOST_DIGITS)
    shown = f"{value:.{digits}g}" if row["bound"] in EXACT_BOUNDS else f"{_most(row, value)}{value:.{digits}g}"
    return shown, f"{lower:.6g}", f"{upper:.{digits}g}", row["bound"], "" if math.isnan(relative) else f"{relative:.0e}"


def _most(row: Row, value: float) -> str:
    return "≤ " if float(row["upper"]) <= value * (1 + 1e-6) else ""


def _scenes(rows: Sequence[Row]) -> tuple[str, str]:
    """Scenes, and those without an energy."""
    names = {row["scene"] for row in rows}
    return str(len(names)), str(len(names - {row["scene"] for row in rows if row["energy"]}))


def _counts(rows: Sequence[Row]) -> tuple[str, ...]:
    """Exits; those with two-sided bounds, with a closed form, with bounds that contain it; the largest difference."""
    found = [row for row in rows if row["energy"]]
    exact = [row for row in found if row["exact"]]
    differences = (abs(float(row["energy"]) / float(row["exact"]) - 1) for row in exact if row["bound"] in EXACT_BOUNDS)
    return (
        str(len(found)), str(sum(row["bound"] in EXACT_BOUNDS for row in found)), str(len(exact) or "–"),
        str(sum(not wrong(row) for row in exact)) if exact else "–", _largest(differences),
    )  # fmt: skip


def wrong(row: Row, tolerance: float = 1e-8) -> bool:
    """Whether a closed form lies outside the bounds of an energy."""
    lower, upper, exact = (float(row[column]) for column in ("lower", "upper", "exact"))
    return not lower * (1 - tolerance) <= exact <= upper * (1 + tolerance)


def _name(scene: str) -> str:
    return scene.partition(": ")[2]


def _family(scene: str) -> str:
    """The name of a scene without its numbers."""
    return re.sub(r"\s+from\b.*", "", re.sub(r",?\s*(gap )?[a-z]*=?-?\d.*", "", _name(scene))).strip(", ")


# --- reStructuredText


def _table(data: Path, name: str) -> Table | None:
    path = data / f"{name}.csv"
    return read(path) if path.exists() else None


def _section(title: str, text: str, *tables: Table, line: str = "-") -> Page:
    """A heading, a paragraph, and the commands that wrote some tables."""
    page = [title, line * len(title), ""]
    if text:
        page += [*textwrap.wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False), ""]
    lines = [f"| {table.source}" for table in tables] if len(tables) > 1 else [table.source for table in tables]
    return [*page, *lines, ""] if lines else page


def _grid(header: Sequence[str], rows: Iterable[Sequence[str]]) -> Page:
    """A table whose rows are lines."""
    return [".. csv-table::", f"   :header: {_line(header)}", "", *(f"   {_line(row)}" for row in rows), ""]


def _line(cells: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, quoting=csv.QUOTE_ALL, lineterminator="").writerow(cells)
    return text.getvalue()


def _largest(values: Iterable[float]) -> str:
    found = [value for value in values if not math.isnan(value)]
    return f"{max(found):.2g}" if found else "–"


def _digits(text: str, digits: int) -> str:
    try:
        return f"{float(text):.{digits}g}"
    except ValueError:
        return text

"""Every number in the tables of a page is one of the object for other programs, to the digits that the page has."""

import csv
import itertools
import json
import math
import re

import pytest

from tests.report.page import Page
from vibrokit.assessment.plausibility import plausibility
from vibrokit.report.assessment import assessment_data
from vibrokit.report.data import reconciliation_data

SECONDS = {"s": 1.0, "minutes": 60.0, "hours": 3600.0, "days": 86400.0, "years": 31557600.0}
NUMBER = re.compile(r"(10\^)?([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)")


def same(text, value):
    """Whether a number as text is a value, rounded to the digits of the text."""
    power, digits = NUMBER.fullmatch(text).groups()
    mantissa, _, exponent = digits.partition("e")
    unit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    if "." not in mantissa and not exponent and abs(float(mantissa)) >= 1000:  # written out to three digits at least
        unit = 10.0 ** (len(mantissa.lstrip("+-")) - 3)
    shown = float(digits)
    return math.isclose(shown, math.log10(value) if power else value, rel_tol=1e-12, abs_tol=0.500001 * unit)


def check(cells, wanted):
    """Each number in some cells is the wanted one, in order."""
    found = [match[0] for cell in cells for match in NUMBER.finditer(cell)]
    assert len(found) == len(wanted), (cells, wanted)
    for text, value in zip(found, wanted, strict=True):
        assert same(text, value), (cells, text, value)


def finite(*values):
    return [value for value in values if value is not None and math.isfinite(value)]


@pytest.fixture(scope="module")
def tables(report):
    """Tables of the page by chapter and name, after a look that page and files have the same cells."""
    shown = Page(report.html).tables
    for cells, table in zip(shown, report.tables, strict=True):
        assert cells == list(csv.reader(table.csv.splitlines()))
    named = {(c.title, b.name): b.rows for c in report.chapters for b in c.blocks if b in report.tables}
    assert len(named) == len(shown)
    return named


@pytest.fixture(scope="module")
def data(assessment):
    return json.loads(json.dumps(assessment_data(assessment), allow_nan=False))


def test_answers(tables, data):
    lasting = "How long each state lasts"
    for row, time in zip(tables[lasting, "lasting"], data["mean_times"], strict=True):
        unit = SECONDS[row[1].split()[1]]
        periods = [time["value"] / time["period"]] if "periods" in row[1] else []
        check([row[1]], [*(time[name] / unit for name in ("value", "lower", "upper")), *periods])
        assert row[2].split(",")[0] == " and ".join(time["methods"])
    for state, row in enumerate(tables[lasting, "barriers"]):
        own = [one for one in data["energies"] if one["source"] == state and one["bound"] == row[2].split("(")[1][:-1]]
        assert any(same(row[1], one["value"]) for one in own)
        check([row[2]], [own[0]["lower"], own[0]["upper"]])
    for row, share in zip(tables[lasting, "shares"], data["occupancies"], strict=True):
        check([row[1]], [share["value"], share["lower"], share["upper"]])


def test_states(tables, data):
    for row, one in zip(tables["Steady states", "states"], data["attractors"], strict=True):
        fractions = [100 * one["basin_fraction"], 100 * one["basin_fraction_error"]]
        assert row[0] == one["name"]
        check(row[1:], [one["label"], one["period"], one["impacts"], *fractions, *one["points"][0][:2]])


def test_each_method(tables, data):
    for (chapter, name), rows in tables.items():
        method = chapter.removeprefix("By ")
        if name == "energies":
            for row, one in zip(rows, [e for e in data["energies"] if e["analyzer"] == method], strict=True):
                assert row[0] == one["exit"]
                bounds = finite(one["lower"], one["upper"], one["numerical_error"], one["residual"])
                check(row[1:8], finite(one["value"], one["ratio"], *bounds))
        elif name == "rates":
            for row, one in zip(rows, [r for r in data["rates"] if r["analyzer"] == method], strict=True):
                assert row[0] == one["exit"]
                check(row[1:5], [one["intensity"], math.exp(-one["log_value"]), one["value"], one["log_error"]])


def test_comparison(tables, assessment):
    found = json.loads(json.dumps(reconciliation_data(assessment.reconciliation), allow_nan=False))
    chapter = "Agreement of the methods"
    wanted = sorted((one["about"], one["code"], one["text"]) for one in found["verdicts"])
    assert sorted(tables[chapter, "verdicts"]) == wanted
    shown = [row for (title, name), rows in tables.items() if title == chapter and "numbers" in name for row in rows]
    cells = [cell for row in shown for cell in row[2:] if cell]
    assert len(cells) == len(found["quantities"])
    for cell in cells:
        numbers = [match[0] for match in NUMBER.finditer(cell)]
        assert any(
            all(same(text, one[name]) for text, name in zip(numbers, ("value", "lower", "upper"), strict=False))
            for one in found["quantities"]
        )


def test_scene(tables, assessment):
    osc = assessment.oscillator
    rows = {row[0]: row for row in tables["Scene", "inputs"]}
    for path, value in osc.parameters.items():
        check([rows[path][2]], [value])
        number, _, unit = rows[path][4].partition(" ")
        if unit:
            assert same(number, value / {"Hz": 2 * math.pi, "kHz": 2e3 * math.pi, "mm": 1e-3, "µm": 1e-6}[unit])
    forms = plausibility(osc).rows
    for row, one in itertools.zip_longest(tables["Scene", "closed-forms"], forms):
        check([row[1]], [one.value])

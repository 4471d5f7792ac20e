"""How records show themselves in a console and in a notebook."""

import dataclasses

import numpy as np
import pytest

from tests.builders import (
    attractor,
    empty_result,
    empty_structure,
    full_continuation,
    full_result,
    full_structure,
    spiral,
)  # fmt: skip
from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding, together
from vibrokit.results.trajectory import Trajectory


@pytest.mark.parametrize(
    "make",
    [full_structure, full_result, full_continuation, empty_structure, empty_result],
    ids=lambda make: make.__name__,
)
def test_five_lines_are_enough(make):
    assert 1 <= len(repr(make()).splitlines()) <= 5
    assert max(map(len, repr(make()).splitlines())) <= 180


@pytest.mark.parametrize(
    ("code", "name", "one", "two"),
    [
        (Code.STARTS_UNSETTLED, "count", "1 start did", "2 starts did"),
        (Code.BRANCHES, "branches", "1 branch of", "2 branches of"),
        (Code.BRANCHES, "values", "at 1 value of", "at 2 values of"),
        (Code.CHAOTIC_SOURCE, "count", "from 1 unstable orbit inside", "from 2 unstable orbits inside"),
    ],
)
def test_one_is_singular(code, name, one, two):
    values = {"branches": 3, "values": 3, "parameter": "x", "periods": (1,)}
    assert one in str(Finding(code, 0, values={**values, name: 1}))
    assert two in str(Finding(code, 0, values={**values, name: 2}))


def test_a_result_shows_three_energies_and_the_first_warning():
    result = full_result()
    _, first, second, third, warning = repr(result).splitlines()
    assert first.startswith("  clear → hammering-period-4: ΔU = 9e-05 m² s⁻³, ")
    assert warning == f"  error: {result.findings[0].sentence(result.names)}"
    info = Finding.of(Code.SADDLES, count=3)
    more = dataclasses.replace(result, energies=result.energies + result.energies[:2], findings=(info,))
    assert repr(more).splitlines()[1:] == [first, second, f"{third} … and 2 more"]


def test_long_sentences_are_cut_and_stay_on_one_line():
    finding = Finding.of(Code.SOURCE_FAILED, 0, reason="first line\nsecond line " + "and so on " * 100)
    lines = repr(dataclasses.replace(full_result(), findings=(finding,))).splitlines()
    assert (len(lines), lines[-1][-1]) == (5, "…")


def test_notebooks_show_a_table_and_all_findings_and_names_are_no_markup():
    text = full_structure()._repr_html_()
    assert (text.count("<tr>"), text.count("<li>"), "«limit cycle»-4" in text) == (6, 3, True)
    odd = dataclasses.replace(empty_structure(), attractors=(attractor(0, "periodic", 1, name="<b>&"),))._repr_html_()
    assert ("&lt;b&gt;&amp;" in odd, "<b>&" in odd) == (True, False)


def test_what_carries_arrays_shows_none_of_them():
    structure, result = full_structure(), full_result()
    t = np.linspace(0, 1, 1000)
    for shown in (
        *structure.attractors, *structure.saddles, *structure.manifolds, structure.basins, result.section,
        result.energies[0], spiral(), Trajectory(t, np.stack([t, t], axis=1)),
    ):  # fmt: skip
        assert "array(" not in repr(shown)
        assert len(repr(shown)) < 500


# Findings at several noise intensities are shown once


def failed(intensity, reason="why.", source=0):
    return Finding.of(Code.INTENSITY_FAILED, source, intensity=intensity, reason=reason)


def uncertain(intensity, error, target=1):
    return Finding.of(Code.RATE_UNCERTAIN, 0, target, intensity=intensity, error=error, accepted=0.1)


def unsettled(intensity, replicas):
    return Finding.of(Code.SPLITTING_NOT_CONVERGED, 0, intensity=intensity, replicas=replicas, error=0.08, wanted=0.05)


def remark(text):
    return Finding.of(Code.REMARK, 0, text=text)


def needed(known):
    return Finding.of(Code.ENERGY_NEEDS_RATES, 0, 1, known=known)


@pytest.mark.parametrize(
    ("findings", "shown"),
    [
        ([failed(1e-4), failed(2e-5), failed(5e-5)], ["2e-05 to 0.0001"]),
        ([failed(1e-4), failed(1e-4)], ["D = 0.0001: why."]),
        ([failed(1e-4), failed(2e-5, "else.")], ["D = 0.0001: why.", "D = 2e-05: else."]),
        ([failed(1e-4), failed(2e-5, source=1)], ["D = 0.0001", "D = 2e-05"]),
        ([uncertain(1e-4, 0.2), uncertain(2e-5, 0.3), uncertain(1e-5, 0.4, 2)], ["0.2 to 0.3, above 0.1.", "0.4"]),
        ([unsettled(2e-5, 96), unsettled(1e-4, 80)], ["80 replicas to 96 replicas"]),
        ([remark("a"), remark("b")], ["A", "B"]),  # what is not of a noise intensity is not merged
        ([needed(0), needed(1)], ["0", "1"]),
    ],
)
def test_numbers_of_one_sentence_become_ranges(findings, shown):
    sentences = [one.sentence() for one in together(findings)]
    assert len(sentences) == len(shown)
    assert all(part in sentence for part, sentence in zip(shown, sentences, strict=True))

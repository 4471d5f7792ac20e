"""What is printed of records, and the object for other programs."""

import dataclasses
import json
import math
from typing import ClassVar

import numpy as np
import pytest

import vibrokit as vk
from tests.builders import full_result, rewritten, say
from vibrokit.cli import main
from vibrokit.progress import Stats
from vibrokit.report.data import plain, run_data
from vibrokit.report.tables import energy_table, rate_table, sensitivity_table
from vibrokit.report.text import findings_text, record_text, stats_text
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.finding import Finding
from vibrokit.results.result import Result
from vibrokit.results.section import Section

NAMES = ("clear", "hammering")
SCENE = {"noise": {"name": "white", "intensity": 2e-5}}
THERE = ActivationEnergy(0, 1, 9e-5, 8e-5, 9.1e-5, "least action", Bound.CERTIFIED, 1e-11, 1e-12, saddle=3)
SECOND = ActivationEnergy(0, 1, 1.1e-4, 0.0, 1.1e-4, "least action", Bound.UPPER, 1e-10, 1e-12)
BACK = ActivationEnergy(1, 0, 4e-5, 3.9e-5, math.inf, "graph", Bound.ESTIMATE, 1e-6)
TOUCH = ActivationEnergy(0, -1, 5e-5, 4e-5, 6e-5, "graph", Bound.ESTIMATE, 1e-5)


def result(*energies, **fields):
    section = Section(labels=np.zeros((1, 1), dtype=np.int16), bounds=np.zeros((2, 2)), points=(), names=NAMES)
    return Result(energies=energies, section=section, **{"scene": SCENE, **fields})


def cells(line):
    """Cells of a line of a table."""
    return [cell for cell in line.split("  ") if cell]


def test_energies_are_told_by_name_with_their_bounds_and_their_ratio_to_the_noise():
    lines = energy_table(result(), [THERE, BACK, TOUCH]).lines
    heads = ["exit", "ΔU", "ΔU/D", "lower", "upper", "bound", "error", "residual", "saddle", "method"]
    assert [cell.strip() for cell in cells(lines[0])] == heads
    assert [cell.strip() for cell in cells(lines[1])] == [
        "clear → hammering", "9e-05", "4.5", "8e-05", "9.1e-05", "certified", "1.0e-11", "1.0e-12", "3", "least action",
    ]  # fmt: skip
    assert [cell.strip() for cell in cells(lines[2])][4:9] == ["unknown", "estimate", "1.0e-06", "–", "–"]
    assert lines[3].startswith("clear → exit ")


class WithRates(Result):
    """A result with rates of any size."""

    kind: ClassVar[str] = "with-rates"

    @property
    def rates(self):
        """One that a float holds, and one that it does not."""
        given = [(0, 1, math.log(0.25), 0.03, "commitment"), (1, -1, -2000.0, 0.5, "contact")]
        return tuple(ExitRate(a, b, 2e-5, value, error, event, "SGCM") for a, b, value, error, event in given)


def test_rates_are_told_with_mean_times_of_any_size():
    section = Section(labels=np.zeros((1, 1), dtype=np.int16), bounds=np.zeros((2, 2)), points=(), names=NAMES)
    found = WithRates(energies=(), section=section, scene=SCENE)
    lines = [[cell.strip() for cell in cells(line)] for line in rate_table(found).lines]
    assert lines[0] == ["exit", "D", "mean time (s)", "rate (s⁻¹)", "error of ln", "event", "method"]
    assert lines[1] == ["clear → hammering", "2e-05", "4", "0.25", "0.03", "commitment", "SGCM"]
    assert lines[2] == ["hammering → exit", "2e-05", "10^868.59", "10^-868.59", "0.5", "contact", "SGCM"]
    assert rate_table(found).text in record_text("scene", found)
    (one, other) = run_data(None, {"sgcm": found})["rates"]
    assert (one["exit"], one["value"], one["analyzer"]) == ("clear → hammering", pytest.approx(0.25), "sgcm")
    assert (other["value"], other["log_value"]) == (0.0, -2000.0)


@pytest.mark.parametrize(
    ("error", "shown"),
    [
        (1e-12, "0.1234567891"),
        (1e-4, "0.12346"),
        (0.01, "0.123"),
        (0.5, "0.12"),
        (0.0, "0.1234567891"),
        (math.nan, "0.123457"),
    ],
)
def test_an_energy_has_the_digits_that_its_error_leaves(error, shown):
    energy = ActivationEnergy(0, 1, 0.12345678912345, 0.1, 0.2, "graph", Bound.ESTIMATE, error)
    assert cells(energy_table(result(), [energy]).lines[1])[1].strip() == shown


def test_a_scene_without_noise_has_no_ratio():
    assert "–" in energy_table(result(scene={"noise": None}), [THERE]).rows[0]


def test_findings_come_by_severity_with_advice_where_something_is_wrong():
    findings = [
        Finding.of(Code.REMARK, text="first"),
        Finding.of(Code.NO_CERTIFICATE, 0, action=1.0, reason="too stiff."),
        Finding.of(Code.SOURCE_FAILED, 1, reason="it is chaotic."),
    ]
    error, warning, info = findings_text(findings, NAMES).splitlines()
    assert error == f"error: Hammering could not be analyzed: it is chaotic. {Code.SOURCE_FAILED.advice}"
    assert warning.startswith("warning: A path from clear ")
    assert warning.endswith(Code.NO_CERTIFICATE.advice)
    assert info == "info: First"


def test_work_is_one_line():
    stats = Stats(trajectories=1200, newton_iterations=7, seconds={"graph": 2.0, "basins": 8.0, "names": 0.001})
    line = stats_text(result(stats=stats, seconds=10.4))
    assert line == "10.4 s (basins 8.0 s, graph 2.0 s); 1,200 trajectories, 7 Newton iterations."


def test_a_result_has_energies_all_paths_transitions_and_findings():
    text = record_text("least-action", result(THERE, BACK, branches=(SECOND, BACK, THERE)))
    assert text.startswith("least-action\n")
    assert [line.split()[3] for line in text.splitlines() if line.startswith("clear → hammering  ")] == [
        "9e-05", "9e-05", "0.00011",
    ]  # fmt: skip
    assert "from \\ to" in text
    assert "ln of the stationary weights at D = 2e-05" in text


@pytest.mark.parametrize(
    ("found", "shown", "absent"),
    [
        (result(THERE), [], "Transitions"),
        (result(TOUCH), [], "to another attractor"),
        (result(), ["No activation energy was found."], "Transitions"),
        (result(complete=False), ["title (incomplete)"], "Transitions"),
    ],
)
def test_what_is_not_there_is_not_told(found, shown, absent):
    text = record_text("title", found)
    assert all(words in text for words in shown)
    assert absent not in text


def test_a_result_of_an_unknown_kind_has_its_energies(tmp_path, capsys):
    full_result().save(tmp_path / "r.nc")
    (tmp_path / "r.nc").write_bytes(rewritten((tmp_path / "r.nc").read_bytes(), say("kind", "unheard-of")))
    assert main(["report", str(tmp_path / "r.nc")]) == 1  # it is incomplete
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("  ")[0] for line in lines if "→" in line] == [
        "clear → hammering-period-4", "hammering-period-4 → clear", "chaotic → exit",
    ]  # fmt: skip
    assert any(line.startswith("warning: ") and "unheard-of" in line for line in lines)


def test_plain_data_is_json():
    value = {"a": (1.0, math.inf, 1 + 2j), "b": np.array([[1, 2]]), "c": np.float64("nan"), "d": Bound.UPPER, "e": True}
    expected = {"a": [1.0, None, [1.0, 2.0]], "b": [[1, 2]], "c": None, "d": "upper", "e": True}
    assert json.loads(json.dumps(plain(value), allow_nan=False)) == expected


def test_the_object_has_energies_branches_and_transitions_by_analyzer():
    found = result(THERE, BACK, TOUCH, branches=(THERE, SECOND), findings=(Finding.of(Code.REMARK, 0, text="so"),))
    data = json.loads(json.dumps(run_data(None, {"least-action": found}), allow_nan=False))
    assert [energy["upper"] for energy in data["energies"]] == [9.1e-5, None, 6e-5]
    assert [energy["ratio"] for energy in data["branches"]] == pytest.approx([4.5, 5.5])
    assert {energy["analyzer"] for energy in data["energies"]} == {"least-action"}
    transitions = data["transitions"]["least-action"]
    assert transitions["energies"] == [[0, 9e-5], [4e-5, 0]]
    assert transitions["names"] == list(NAMES)
    assert (transitions["most_stable"], transitions["missing"]) == (None, [])
    assert [cycle["members"] for cycle in transitions["cycle_hierarchy"]] == [[1], [0]]
    assert (data["attractors"], data["saddles"]) == ([], [])
    assert vk.Transitions.of(found).names == NAMES


def test_sensitivities_are_also_in_per_cent_and_shared_parameters_stand_together():
    """Of ΔU = ζ³ (gap of both stops)², whose powers are its sensitivities in per cent."""
    result = full_result()
    zeta, value = result.scene["damping_ratio"], result.energies[0].value
    slopes = {
        "damping_ratio": 3 * value / zeta,
        "barriers.0.position": value / 0.5,
        "barriers.1.position": -value / 0.5,
    }
    energy = dataclasses.replace(
        result.energies[0], sensitivity=slopes, sensitivity_error=dict.fromkeys(slopes, 0.0)
    )  # fmt: skip
    table = sensitivity_table(dataclasses.replace(result, energies=(energy,)))
    rows = {name: [float(number) for number in numbers] for name, *numbers in table.rows}
    assert rows["damping_ratio"] == pytest.approx([3 * value / zeta, 3], rel=1e-4)
    assert rows["barriers.1.position"] == pytest.approx([-value / 0.5, 1], rel=1e-4)
    assert rows["barriers.*.position"] == pytest.approx([2 * value / 0.5, 2], rel=1e-4)

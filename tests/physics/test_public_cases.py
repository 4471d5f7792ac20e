"""Scenes of other people with their right values, from the table of `tests/benchmarks/public_cases.py`."""

import pytest

from tests.benchmarks.public_cases import QUESTIONS, TABLE, answers, made, met, read_cases

CASES = read_cases()
TRAJECTORIES = {"end", "deepest", "rebound", "height_ratio"}
"""Questions that single trajectories answer, in about a second."""


def brief(name):
    return {check["question"] for check in CASES[name]["checks"]} <= TRAJECTORIES


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if brief(name)])
def test_trajectories(name):
    assert_met(name, 60.0)


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in CASES if not brief(name)])
def test_whole_scenes(name):
    assert_met(name, 300.0)


def assert_met(name, limit):
    missed = [row for row in answers(made(CASES[name], limit)) if not met(row["check"], row["found"])]
    assert not missed, "\n".join(f"{row['check']}: {row['found']} {row['why']}" for row in missed)


def test_the_table_is_complete():
    with TABLE.open(encoding="utf-8") as file:
        assert file.read().count("[[cases]]") == len(CASES) >= 40
    for row in CASES.values():
        assert row["source"]
        assert row["checks"]
        for check in row["checks"]:
            assert check["question"] in QUESTIONS
            tolerant = "absolute" in check or "relative" in check
            assert tolerant is isinstance(check["value"], float | list)

"""A stage that is stopped keeps what was found; what goes on afterwards is stopped again a little later."""

import pytest

from vibrokit.errors import OutOfTime, StructureError
from vibrokit.progress import AFTERWARDS, Deadline, advance, put_off, stage, working
from vibrokit.results.codes import Code
from vibrokit.results.stoppable import Stoppable


@pytest.mark.parametrize(
    ("reason", "word"), [(KeyboardInterrupt, "interrupt"), (Deadline, "time limit"), (OutOfTime, "time limit")]
)
def test_what_ends_a_stage_is_a_finding(reason, word):
    found = []
    with Stoppable("graph", 3) as work:
        found.append(1)
        work.doing = "paths"
        raise reason
    (finding,) = work.findings
    assert work.stopped
    assert found == [1]
    assert (finding.code, finding.source) == (Code.STOPPED, 3)
    assert finding.values == {"stage": "paths", "reason": word}


def test_a_stage_that_ends_by_itself_has_no_finding():
    with Stoppable("graph") as work:
        pass
    assert not work.stopped
    assert work.findings == ()


@pytest.mark.parametrize("error", [StructureError("no"), ValueError(), SystemExit()])
def test_other_errors_go_on(error):
    with pytest.raises(type(error)), Stoppable("graph") as work:
        raise error
    assert not work.stopped


def test_after_a_limit_there_is_little_time(clock):
    with working(time_limit=10), stage("graph"):
        clock.now += 11
        with Stoppable("first") as first:
            advance()
        clock.now += 0.9 * AFTERWARDS
        advance()
        clock.now += 0.2 * AFTERWARDS
        with put_off():
            advance()  # what is returned is put together
        with Stoppable("second") as second:
            advance()
    assert [one.findings[0].values["reason"] for one in (first, second)] == ["time limit", "time limit"]


@pytest.mark.parametrize("asked", [True, False], ids=["asked for", "raised by Python"])
def test_after_ctrl_c_there_is_little_time_in_all_the_work_around(clock, asked):
    with working() as outer, working(time_limit=1000) as inner, stage("graph"):
        assert not outer.over
        with Stoppable("first") as first:
            if asked:
                outer.interrupt()
                assert outer.over
                advance()
            raise KeyboardInterrupt
        assert outer.over
        assert inner.over
        clock.now += 1.1 * AFTERWARDS
        with Stoppable("second") as second:
            advance()
    assert [one.findings[0].values["reason"] for one in (first, second)] == ["interrupt", "interrupt"]


def test_a_limit_of_a_part_stops_no_other_part(clock):
    with working(time_limit=1000) as outer, stage("all"):
        with working(time_limit=10), stage("part"), Stoppable("part") as part:
            clock.now += 11
            advance()
        clock.now += 2 * AFTERWARDS
        advance()
        assert not outer.over
    assert part.stopped

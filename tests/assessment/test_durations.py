import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibrokit.assessment.durations import duration_text, interval_text, seconds_in
from vibrokit.errors import ParameterError

YEAR = 365.25 * 86400


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("8 h", 28800), ("1yr", YEAR), ("30 min", 1800), ("2 d", 172800), ("0.5", 0.5), (0.5, 0.5), (3, 3),
        ("12 periods", 18.0), ("1 period", 1.5), ("2.5e3 ms", 2.5), ("1 week", 604800), (" 3 Hours ", 10800),
        ("5 µs", 5e-6),
    ],
)  # fmt: skip
def test_durations_in_seconds(text, seconds):
    assert seconds_in(text, period=1.5) == pytest.approx(seconds, rel=1e-14)


@pytest.mark.parametrize(
    "text",
    ["", "h", "-1 h", "0", "nan", "inf", "1 yaer", "1 h 30 min", "1e999 s", "1e308 yr", None, True, math.nan, -1.0,
     "12 periods"],
)  # fmt: skip
def test_what_is_no_duration_is_refused(text):
    """A number of periods is none without a section."""
    with pytest.raises(ParameterError):
        seconds_in(text)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.24, "0.24 s"), (11.9 * YEAR, "11.9 years"), (3.2 * 3600, "3.2 hours"), (1e-5, "1e-05 s"), (119, "119 s")],
)
def test_durations_read_well(seconds, text):
    assert duration_text(math.log(seconds)) == text


def test_durations_beyond_floats_and_intervals():
    assert duration_text(2000.0) == f"10^{2000 / math.log(10) - math.log10(YEAR):.2f} years"
    assert duration_text(-2000.0) == "10^-868.59 s"
    assert [duration_text(end) for end in (-math.inf, math.inf, math.nan)] == ["0 s", "infinite", "unknown"]
    assert interval_text(*map(math.log, (0.24, 0.22, 0.27))) == "0.24 s (0.22 to 0.27)"
    assert interval_text(*map(math.log, (86400.0, 3600.0, 864000.0))) == "24 hours (1 to 240)"
    assert interval_text(0.0, -math.inf, math.inf) == "1 s (0 s to infinite)"
    assert interval_text(*map(math.log, (300 * YEAR, 0.5, 1e12 * YEAR))) == "300 years (0.5 s to 1e+12 years)"


@given(st.floats(1e-300, 1e300))
def test_what_is_written_reads_as_the_same(seconds):
    text = duration_text(math.log(seconds))
    if "^" not in text:
        assert seconds_in(text) == pytest.approx(seconds, rel=5.1e-3)


@given(st.floats(1e-200, 1e200), st.sampled_from(["s", "min", "h", "d", "yr", "ms"]))
def test_a_number_with_a_unit_scales(number, unit):
    assert seconds_in(f"{number!r} {unit}") == pytest.approx(number * seconds_in(f"1 {unit}"), rel=1e-14)

"""Common periods of excitations, and whole-number ratios near those that have none: against known approximations."""

import math

import pytest

import vibrokit as vk
from vibrokit.errors import NoSectionError, ParameterError

TWO_PI = 2 * math.pi


def two_tones(first, second):
    parts = [vk.Harmonic(0.1, first), vk.SupportMotion(1e-3, second)]
    return vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=parts)


def test_a_ratio_of_large_whole_numbers_has_a_long_section():
    """65/91.3 = 650/913, so that the two repeat together after 10 s."""
    assert two_tones(TWO_PI * 65.0, TWO_PI * 91.3).period == pytest.approx(10.0, rel=1e-14)
    last = vk.common_ratios(TWO_PI * 65.0, TWO_PI * 91.3)[-1]
    assert (last.slow, last.fast) == (650, 913)
    assert str(last) == "650/913 (exact, a section of 10 s)"


def test_frequencies_may_have_units():
    assert vk.common_ratios("65 Hz", "91.3 Hz") == vk.common_ratios(TWO_PI * 65.0, TWO_PI * 91.3)


def test_known_approximations_of_pi_and_of_the_golden_section():
    found = vk.common_ratios(1.0, math.pi)
    near = {(ratio.slow, ratio.fast): ratio for ratio in found}
    assert {(1, 3), (7, 22), (106, 333), (113, 355)} <= set(near)
    assert near[7, 22].error == pytest.approx(math.pi * 7 / 22 - 1, rel=1e-9)
    assert near[7, 22].section == pytest.approx(7 * TWO_PI)
    golden = (math.sqrt(5) - 1) / 2
    fibonacci = [(1, 2), (2, 3), (3, 5), (5, 8), (8, 13), (13, 21), (21, 34), (34, 55)]
    assert [(r.slow, r.fast) for r in vk.common_ratios(golden, 1.0)][:8] == fibonacci


def test_each_is_nearer_than_the_last_and_its_section_repeats_both():
    found = vk.common_ratios(math.sqrt(2), 1.0)
    errors = [abs(ratio.error) for ratio in found]
    assert errors == sorted(errors, reverse=True)
    for ratio in found:
        osc = two_tones(1.0, ratio.fast / ratio.slow)
        assert osc.period == pytest.approx(ratio.section, rel=1e-9)


def test_who_asks_for_a_section_is_offered_near_ratios():
    with pytest.raises(NoSectionError) as caught:
        _ = two_tones(1.0, math.pi).period
    said = str(caught.value)
    assert "7/22 (off by 4.0e-04, a section of 43.98 s)" in said
    assert said.endswith("1000.")
    with pytest.raises(NoSectionError, match=r"no section; give"):  # nothing near
        _ = two_tones(1.0, 1e4 * math.pi).period


@pytest.mark.parametrize("pair", [(0.0, 1.0), (1.0, math.inf), (1.0, math.nan), ("65", 1.0), (1.0, 1001.0)])
def test_what_is_no_pair_of_frequencies(pair):
    with pytest.raises(ParameterError, match=r"^common_ratios: .*(greater than 0|at most 1000)"):
        vk.common_ratios(*pair)

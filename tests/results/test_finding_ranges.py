"""Findings at several noise intensities are shown once, with the range of their numbers."""

import pytest

from vibrokit.results.codes import Code
from vibrokit.results.finding import Finding, together


def failed(intensity, reason="why.", source=0):
    return Finding.of(Code.INTENSITY_FAILED, source, intensity=intensity, reason=reason)


def uncertain(intensity, error, target=1):
    return Finding.of(Code.RATE_UNCERTAIN, 0, target, intensity=intensity, error=error, accepted=0.1)


@pytest.mark.parametrize(
    ("findings", "shown"),
    [
        ([failed(1e-4), failed(2e-5), failed(5e-5)], ["2e-05 to 0.0001"]),
        ([failed(1e-4), failed(1e-4)], ["D = 0.0001: why."]),
        ([failed(1e-4), failed(2e-5, "else.")], ["D = 0.0001: why.", "D = 2e-05: else."]),
        ([failed(1e-4), failed(2e-5, source=1)], ["D = 0.0001", "D = 2e-05"]),
        ([uncertain(1e-4, 0.2), uncertain(2e-5, 0.3), uncertain(1e-5, 0.4, 2)], ["0.2 to 0.3, above 0.1.", "0.4"]),
    ],
)
def test_numbers_of_one_sentence_become_ranges(findings, shown):
    sentences = [one.sentence() for one in together(findings)]
    assert len(sentences) == len(shown)
    assert all(part in sentence for part, sentence in zip(shown, sentences, strict=True))


def test_counts_keep_their_nouns():
    values = {"error": 0.08, "wanted": 0.05}
    (one,) = together(
        Finding.of(Code.SPLITTING_NOT_CONVERGED, 0, intensity=d, replicas=n, **values)
        for d, n in ((2e-5, 96), (1e-4, 80))
    )
    assert "80 replicas to 96 replicas" in one.sentence()


def test_what_is_not_of_a_noise_intensity_is_not_merged():
    both = [Finding.of(Code.REMARK, 0, text=t) for t in "ab"]
    assert [one.values["text"] for one in together(both)] == ["a", "b"]
    energies = [Finding.of(Code.ENERGY_NEEDS_RATES, 0, 1, known=known) for known in (0, 1)]
    assert len(together(energies)) == 2

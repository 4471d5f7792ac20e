"""The drawing of a scene has the numbers that the scene gives, and no spring where there is none."""

import pytest
from matplotlib import pyplot as plt

import vibrokit as vk
from vibrokit.report.pictures import scene_picture

CUBIC = vk.CubicSpring(linear=1.0, cubic=2.0)


@pytest.mark.parametrize(
    ("numbers", "shown", "absent"),
    [
        ({"natural_frequency": 2.0, "damping_ratio": 0.1}, ("ω_n = 2 rad s⁻¹", "ζ = 0.1"), ("κ", "c =")),
        ({"stiffness": 4.0, "damping": 0.4}, ("κ = 4 s⁻²", "c = 0.4 s⁻¹"), ("ω_n", "ζ")),
        ({"natural_frequency": 0, "damping": 0.4}, ("c = 0.4 s⁻¹",), ("ω_n", "ζ", "κ")),
        ({"stiffness": 0, "damping_ratio": 0}, ("ζ = 0",), ("ω_n", "κ", "c =")),
        ({"spring": CUBIC, "damping": 0.4}, ("CubicSpring", "c = 0.4 s⁻¹"), ("ω_n", "ζ")),
    ],
)
def test_numbers_in_the_picture(numbers, shown, absent, monkeypatch):
    drawn = []
    monkeypatch.setattr("vibrokit.report.pictures.inline_svg", lambda artists, name: drawn.append(artists) or "")
    scene_picture(vk.Oscillator(**numbers))
    text = drawn[0].texts[0].get_text()
    assert all(words in text for words in shown)
    assert not any(words in text for words in absent)
    assert (drawn[0].spring is None) == (len(shown) == 1)
    plt.close("all")

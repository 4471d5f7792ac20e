"""What a result says and draws: energies by name, histories, quasi-potentials."""

import dataclasses

import numpy as np
import pytest

from tests.builders import empty_result, full_result
from vibrokit.errors import StructureError


def test_what_does_not_exist_is_not_drawn():
    with pytest.raises(StructureError, match="no exit path"):
        empty_result().plot_history()
    with pytest.raises(StructureError, match="no quasi-potential of clear; it has those of chaotic"):
        full_result().plot_quasi_potential("clear")
    with pytest.raises(StructureError, match="no quasi-potential"):
        empty_result().plot_quasi_potential()
    assert empty_result().plot().strands == ()


def test_time_is_drawn_in_sections():
    drawn = full_result().plot_history()
    np.testing.assert_allclose(drawn.momentum_points[0].get_xdata(), np.arange(13), atol=1e-12)
    assert drawn.momenta[0].get_xdata()[-1] == pytest.approx(12)


def test_a_quasi_potential_lies_on_its_nodes():
    drawn = full_result().plot_quasi_potential()
    half, psi = np.array([1 / 19, 0.6 / 15]), full_result().data.quasi_potential.values[0]
    extent = np.array([[-1, 1], [-0.9, 0.3]]) + half[:, None] * [-1, 1]
    np.testing.assert_allclose(drawn.image.get_extent(), extent.ravel(), rtol=1e-12)
    np.testing.assert_array_equal(drawn.image.get_array().filled(np.nan).T, psi)
    assert drawn.attractor.get_label() == "chaotic"


# Energies by name


def test_an_energy_is_found_by_label_or_name():
    result = full_result()
    first, second, third = result.energies
    assert result.energy("clear", "hammering") is result.energy(0, 1) is result.energy(0) is first
    assert result.energy("hamm", "clear") is second
    assert result.energy("chaotic", "exit") is result.energy(2, -1) is third
    assert [result.exit_of(energy) for energy in result.energies] == [
        "clear → hammering-period-4", "hammering-period-4 → clear", "chaotic → exit",
    ]  # fmt: skip


def test_the_exit_of_least_energy_is_the_default():
    result = full_result()
    cheaper = dataclasses.replace(result.energies[0], target=2, value=1e-6)
    assert dataclasses.replace(result, energies=(*result.energies, cheaper)).energy("clear") is cheaper


@pytest.mark.parametrize(
    ("source", "target", "words"),
    [
        ("clear", "chaotic", "no energy of clear → chaotic; the result has clear → hammering-period-4, "),
        ("clear", "exit", "no energy of clear → exit"),
        ("claer", None, "no attractor 'claer'; the nearest is 'clear'"),
        ("c", None, "clear or chaotic"),
        (3, None, "no attractor 3; there are 0 .clear., 1"),
        (-1, None, "no attractor -1"),
        (True, None, "no attractor True"),
    ],
)
def test_an_energy_that_does_not_exist(source, target, words):
    with pytest.raises(StructureError, match=words):
        full_result().energy(source, target)

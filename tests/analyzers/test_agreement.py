"""What is said, and what bounds are kept, when a polished path and the graph price one exit."""

from types import SimpleNamespace

import pytest

from vibrokit.analyzers.agreement import agreed
from vibrokit.results.energy import ActivationEnergy

ORBIT = SimpleNamespace(label=0, is_fixed=True)
CHAOS = SimpleNamespace(label=0, is_fixed=False)


def path(value, error=1e-9):
    return ActivationEnergy(0, 1, value, value - error, value + error, "least action", 1e-12)


def graph(value, error):
    return ActivationEnergy(0, 1, value, max(0.0, value - error), value + error, "graph", float("nan"))


@pytest.mark.parametrize(
    ("polished", "screened", "words"),
    [
        (1.0, (1.01, 0.02), "they agree"),
        (1.0, (1.2, 0.05), "its grid is too coarse here."),
        (1.0, (1.0, 0.8), "too coarse here to say more of the 1 of the path polished"),
        (1.0, (0.5, 0.1), "there is a cheaper way out that was not polished"),
    ],
)
def test_an_orbit_s_energy_is_the_path_s(polished, screened, words):
    (energy,), (said,) = agreed(ORBIT, {1: path(polished)}, {1: graph(*screened)})
    assert words in said
    assert (energy.value, energy.method) == (polished, "least action")
    assert energy.lower == (0.4 if "cheaper" in words else pytest.approx(polished))


def test_a_set_s_energy_is_a_bracket():
    (energy,), (said,) = agreed(CHAOS, {1: path(1.0)}, {1: graph(0.9, 0.2)})
    assert "a bracket" in said
    assert energy.method == "least action (bracket)"
    assert energy.value == 0.9
    assert energy.lower == pytest.approx(0.7)
    assert energy.upper == pytest.approx(1.0)


def test_without_a_path_the_graph_s_is_all_there_is():
    (energy,), (said,) = agreed(ORBIT, {}, {1: graph(0.9, 0.2)})
    assert energy.method == "graph"
    assert "no path was polished" in said


def test_without_a_graph_nothing_is_compared():
    (energy,), said = agreed(ORBIT, {1: path(1.0)}, {})
    assert energy.value == 1.0
    assert said == []

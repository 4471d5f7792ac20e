"""Names of attractors."""

import math

import numpy as np
import pytest

from vibrokit.results.attractor import Attractor
from vibrokit.structure.attractors.names import branch_names_of, labelled, names_of


def made(kind="periodic", period=1, *, width=1.0, middle=0.0, hits=0, depth=0.0):
    """An attractor with what names are made from."""
    angles = np.linspace(0, 2 * np.pi, 65)
    orbit = np.stack([middle + 0.5 * width * np.cos(angles), -0.5 * width * np.sin(angles)], axis=1)
    none = np.empty(0, dtype=complex)
    return Attractor(
        label=-1, kind=kind, period=period, duration=1.0, points=orbit[:1], orbit=orbit, multipliers=none,
        exponents=none, exponent_error=0.0, hits={"right": hits}, peak_depth={"right": depth},
        peak_force={"right": depth}, basin_fraction=math.nan, basin_fraction_error=math.nan, residual=0.0, error=0.0,
    )  # fmt: skip


REST, PRESSED = {"kind": "equilibrium", "width": 0.0}, {"kind": "equilibrium", "width": 0.0, "depth": 0.1}


@pytest.mark.parametrize(
    ("attractors", "names"),
    [
        ([made()], ["clear"]),
        ([made(hits=2, depth=0.1)], ["hammering"]),
        ([made(), made(hits=1, depth=0.1), made(period=4, hits=4, depth=0.1)],
         ["clear", "hammering", "hammering-period-4"]),
        ([made(depth=0.1)], ["pressed"]),  # it never loses contact
        ([made(**PRESSED)], ["pressed"]),
        ([made(**REST)], ["rest"]),
        ([made("limit cycle")], ["cycle"]),
        ([made("chaotic", 0), made("quasiperiodic", 0)], ["chaotic", "quasiperiodic"]),
        ([made(width=2.0), made(width=1.0)], ["large-clear", "small-clear"]),
        ([made(width=2.0), made(width=1.0), made(width=1.5)], ["large-clear", "small-clear", "medium-clear"]),
        ([made(middle=1.0), made(middle=-1.0)], ["right-clear", "left-clear"]),
        ([made(middle=2.0, **REST), made(middle=-1.0, **REST), made(middle=0.5, **REST)],
         ["right-rest", "left-rest", "middle-rest"]),
        ([made(width=1.05), made(width=1.0)], ["clear", "clear-2"]),
        ([made(width=3.0), made(width=1.0), made(width=1.05)], ["clear", "clear-2", "clear-3"]),
        ([made(width=width) for width in (1, 2, 4, 8)], ["clear", "clear-2", "clear-3", "clear-4"]),
        ([], []),
    ],
)  # fmt: skip
def test_names(attractors, names):
    assert names_of(attractors, has_stops=True) == tuple(names)
    found = labelled(attractors, has_stops=True)
    assert [(one.label, one.name) for one in found] == list(enumerate(names))


def test_an_orbit_without_stops_is_an_oscillation():
    assert names_of([made(width=1.0), made(width=3.0)], has_stops=False) == ("small-oscillation", "large-oscillation")
    assert names_of([made(period=3)], has_stops=False) == ("oscillation-period-3",)


@pytest.mark.parametrize(
    ("branch", "name"),
    [
        ([made(), made(width=2.0)], "clear"),
        ([made(), made(hits=1, depth=0.1), made(hits=2, depth=0.2), made()], "clear-and-hammering"),
        ([made(hits=2, depth=0.1), made()], "hammering-and-clear"),
        ([made(period=3), made(period=3, hits=1, depth=0.1)], "clear-and-hammering-period-3"),
        ([made(**REST), made(**PRESSED)], "rest-and-pressed"),
        ([made(depth=0.1), made(hits=1, depth=0.1)], "pressed-and-hammering"),
        ([made(), made("chaotic", 0, hits=1.5, depth=0.1)], "clear-and-chaotic"),
        ([made(hits=1, depth=0.1), made("chaotic", 0, hits=1.5, depth=0.1)], "hammering"),
        ([made("limit cycle"), made("limit cycle", hits=1, depth=0.1)], "cycle"),  # says nothing of stops
    ],
)
def test_a_branch_has_the_names_of_all_its_contacts(branch, name):
    assert branch_names_of([branch], has_stops=True) == (name,)
    assert branch_names_of([branch, branch], has_stops=True) == (name, f"{name}-2")

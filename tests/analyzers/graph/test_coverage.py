"""What the grids cover: a basin and a saddle that reach beyond the region, within the memory allowed."""

import functools
from types import SimpleNamespace

import numpy as np
import pytest

import vibrokit as vk
from tests.layers import long
from vibrokit.analyzers.graph import value_iteration
from vibrokit.analyzers.graph.grids import Grids
from vibrokit.analyzers.graph.known_paths import KnownPaths
from vibrokit.analyzers.graph.potential import Potential
from vibrokit.analyzers.graph.regions import WholeRegion
from vibrokit.analyzers.graph.targets import StateTarget
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.results.basins import ESCAPED
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound, ExitPath

DAMPING = 0.05
EXACT = 4 * DAMPING / 6  # ΔU = 4 ζ ω_n ΔE, and the well of x − x² is 1/6 deep
# The exit path swings from −1/2 to the saddle at 1.
REGIONS = {"cuts the basin": ((-0.2, 1.2), (-0.3, 0.3)), "leaves the saddle out": ((-0.2, 0.9), (-0.3, 0.3))}


@functools.cache
def problem(which):
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=DAMPING, spring=vk.CustomSpring("x - x**2"), noise=vk.WhiteNoise(1e-4)
    )
    structure = vk.find_structure(osc, region=REGIONS[which], rng=0, manifolds=False)
    return ExitProblem(osc, structure, structure.attractors[0], vk.LeaveBasin())


@pytest.mark.long
@pytest.mark.parametrize("which", ["cuts the basin", long("leaves the saddle out")])
def test_grids_reach_beyond_the_region_where_a_known_path_does(which):
    states = np.array([[-0.5, 0.0], [1.0, 0.0]])
    path = ExitPath(np.arange(2.0), states, np.zeros((2, 2)), np.array([0.0, EXACT]), np.array([0, 1]))
    known = ActivationEnergy(0, ESCAPED, EXACT, EXACT, EXACT, "", Bound.UPPER, path=path)
    costs = vk.GraphSearch(nodes=(120, 120)).begin(problem(which), closer=True)
    while not costs.finished:
        costs.refine(KnownPaths([known]))
    (energy,) = costs.solution().estimates
    assert energy.value == pytest.approx(EXACT, rel=0.01)
    assert energy.numerical_error < 0.05 * EXACT


@pytest.mark.long
def test_where_memory_is_short_fewer_nodes_are_taken():
    search, many = vk.GraphSearch(nodes=(240, 240), max_memory_gib=0.05), vk.GraphSearch(nodes=(120, 120))
    found, fewer = search.search(problem("cuts the basin")), many.search(problem("cuts the basin"))
    assert found.estimates[0].value == fewer.estimates[0].value
    (finding,) = [each for each in found.findings if each.code is Code.GRAPH_MEMORY]
    assert (finding.values["nodes_x"], finding.values["wanted_x"]) == (120, 240)
    assert Code.GRAPH_MEMORY not in [each.code for each in fewer.findings]


@pytest.mark.slow
def test_sweeps_that_end_too_early_are_found(monkeypatch):
    search = vk.GraphSearch(nodes=(60, 60))
    enough = search.search(problem("cuts the basin"))
    assert Code.GRAPH_NOT_CONVERGED not in [finding.code for finding in enough.findings]
    monkeypatch.setattr(value_iteration, "_MOST_PERIODS", 4)
    early = search.search(problem("cuts the basin"))
    (finding,) = [each for each in early.findings if each.code is Code.GRAPH_NOT_CONVERGED]
    assert finding.values["part"] > 0.01
    assert early.estimates[0].numerical_error >= finding.values["part"] * early.estimates[0].value


def test_where_half_as_many_nodes_reach_no_exit_all_of_them_show_how_wide_grids_have_to_be(monkeypatch):
    """Around a chaotic attractor whose exit costs almost nothing, the exit is within a node of it on fewer nodes."""
    asked = []

    def solved(self, grids, ceiling, rougher=None):
        asked.append(grids.shape)
        if grids.shape == (64, 64):
            raise StructureError("the exits are within a node of it.")
        return SimpleNamespace(potential=SimpleNamespace(grids=grids))

    box = Grids(np.array([[[-1.0, 1.0], [-1.0, 1.0]]]), (128, 128), 1.0, 1)
    monkeypatch.setattr(WholeRegion, "first", lambda self, steps, shape, intervals: box.with_shape(shape))
    monkeypatch.setattr(WholeRegion, "solved", solved)
    monkeypatch.setattr(WholeRegion, "highest", lambda self, solved: 1.0)
    monkeypatch.setattr(
        WholeRegion, "needed", lambda self, solved, level: [np.ones(solved.potential.grids.shape, bool)]
    )
    with pytest.raises(StructureError):
        WholeRegion(None, None, (), ()).coarser(1, (64, 64), 1, 1.0)
    asked.clear()
    whole, _ = WholeRegion(None, None, (), ()).coarser(1, (128, 128), 1, 1.0)
    assert asked[0] == (64, 64)
    assert (whole.potential.grids.shape, whole.potential.grids.area > box.area) == ((128, 128), True)


def grid(value, change, side):
    """A grid with V at the only target in units of the known action."""
    return SimpleNamespace(
        arrival=lambda target: SimpleNamespace(value=value),
        change=lambda rougher, targets: change,
        ratios=lambda targets: [],
        linearization_error=lambda targets: 0.0,
        potential=SimpleNamespace(ceiling=9.0, grids=SimpleNamespace(shape=(side, side))),
    )


@pytest.mark.parametrize(
    ("value", "change", "nodes_before", "suffice"),
    [
        (1.0, 0.0, 45, True), (0.98, 0.0, 45, False), (0.98, 0.05, 45, True), (0.92, 0.05, 45, False),
        (0.92, 3.0, 45, True), (0.85, 3.0, 45, False), (1.5, 0.1, 45, False), (1.5, 0.1, 90, True),
        (1.15, 0.1, 45, True), (5.0, 3.0, 45, True),
    ],
)  # fmt: skip
def test_v_at_a_known_exit_asks_for_shorter_steps_where_nodes_do_not_explain_it(value, change, nodes_before, suffice):
    """Interpolation raises V, and by no more than about what twice the nodes change."""
    target = SimpleNamespace(labels=(1,), saddle=0)
    known = ActivationEnergy(0, 1, 1.0, 1.0, 1.0, "", Bound.UPPER)
    coverage = WholeRegion(None, None, (target,), (known,))
    assert coverage.steps_suffice(grid(value, change, 90), grid(value, change, nodes_before)) is suffice


def test_the_place_of_a_target_has_the_section_where_v_is_least():
    """A saddle of period 2 on grids of two section intervals: V is least at its second point, on the second section."""
    box = [[-1.0, 1.0], [-1.0, 1.0]]
    grids = Grids(np.array([box] * 4), (21, 21), 0.5, 2)
    x, v = np.moveaxis(grids.nodes(0), -1, 0)
    values = [1 + (x + 0.5) ** 2 + v**2, np.ones_like(x), 0.5 + (x - 0.5) ** 2 + v**2, np.ones_like(x)]
    potential = Potential(grids, values, [], np.zeros((21, 21), dtype=bool), np.empty((0, 2)), 9.0)
    states = np.array([[-0.5, 0.0], [0.5, 0.0]])
    arrival = StateTarget((1,), 0, 1.0, states, direction=np.array([1.0, 0.0])).evaluate(potential)
    assert arrival.value == pytest.approx(0.5)
    assert arrival.place.phase == 2
    assert arrival.place.state == pytest.approx([0.5, 0.0])

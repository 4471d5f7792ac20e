import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from vibrokit.plots import basins as cells
from vibrokit.plots.actions import action_map, action_plot
from vibrokit.plots.axes import COLOURS, colour
from vibrokit.plots.basins import STABLE, UNSTABLE, basin_map, section_portrait
from vibrokit.plots.bifurcation import basin_fractions, bifurcation_diagram
from vibrokit.plots.clipping import clipped
from vibrokit.plots.exit_times import ExitTimes, exit_slopes, exit_times
from vibrokit.plots.portraits import phase_portrait, steady_motions
from vibrokit.results import basins as records

BOX = ((-1.0, 1.0), (-0.5, 0.5))
X_LABEL, V_LABEL = r"displacement $x$ (m)", r"velocity $v$ (m s$^{-1}$)"
FREQUENCY = r"forcing frequency $\omega$ (rad s$^{-1}$)"
POINTS = [[[0.2, 0.1, 9.0]], [[-0.2, 0.1], [-0.3, 0.2]]]  # the first has a noise state besides x and v
LABELS = np.array([[0, 1], [0, 1], [1, 1]])


def names(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def lies_at(*pairs):
    """Each artist lies at its points."""
    for artist, points in pairs:
        np.testing.assert_array_equal(artist.get_xydata(), points)


def pixel(image, place):
    """Colour that an image of cells shows at (x, v)."""
    (left, right, low, high), data = image.get_extent(), image.get_array()
    column = int((place[0] - left) / (right - left) * data.shape[1])
    row = int((place[1] - low) / (high - low) * data.shape[0])
    return image.cmap(image.norm(data[row, column]))


# Curves cut at the edges


def test_a_circle_is_cut_where_it_crosses_the_edges():
    angle = np.linspace(0, 2 * np.pi, 100_001)
    inside = clipped(np.stack([0.6 * np.cos(angle), 0.6 * np.sin(angle)], axis=1), BOX)
    gaps = np.flatnonzero(np.isnan(inside[:, 0]))  # it starts on the right, and is away above and below
    crossings = inside[[gaps[0] - 1, gaps[0] + 1, gaps[1] - 1, gaps[1] + 1]]
    at = np.sqrt(0.6**2 - 0.5**2)
    np.testing.assert_allclose(crossings, [[at, 0.5], [-at, 0.5], [-at, -0.5], [at, -0.5]], atol=1e-8)
    length = np.nansum(np.linalg.norm(np.diff(inside, axis=0), axis=1))
    assert length == pytest.approx(4 * 0.6 * np.arcsin(0.5 / 0.6), rel=1e-8)


@pytest.mark.parametrize(
    ("curve", "inside"),
    [
        ([[0, 0], [0.5, 0.2]], [[0, 0], [0.5, 0.2]]),
        ([[-3, 0.25], [3, 0.25]], [[-1, 0.25], [1, 0.25]]),  # both ends outside, across
        ([[0, -9], [0, 9]], [[0, -0.5], [0, 0.5]]),
        ([[-3, 0.6], [3, 0.6]], np.empty((0, 2))),  # along an edge, outside
        ([[-3, 0.5], [3, 0.5]], [[-1, 0.5], [1, 0.5]]),  # on an edge
        ([[0.9, 0], [1.1, 0], [0.9, 0.1]], [[0.9, 0], [1, 0], [np.nan] * 2, [1, 0.05], [0.9, 0.1]]),
        ([[2, 2]], np.empty((0, 2))),
        ([], np.empty((0, 2))),
        ([[0, 0], [np.nan, 0], [0.1, 0], [0.2, 0]], [[0.1, 0], [0.2, 0]]),
        ([[0, 0], [0.1, 0], [np.nan, 0], [0.1, 0], [0.2, 0]], [[0, 0], [0.1, 0], [np.nan] * 2, [0.1, 0], [0.2, 0]]),
        ([[0, 0], [np.inf, 0]], np.empty((0, 2))),
    ],
)
def test_segments_are_cut(curve, inside):
    np.testing.assert_allclose(clipped(curve, BOX), inside, atol=1e-15)


# Basins and what lies over them


def test_cells_have_the_same_labels_as_in_the_records():
    known = ("UNSETTLED", "ESCAPED", "NOT_FOLLOWED", "AT_COPY")
    assert [getattr(cells, name) for name in known] == [getattr(records, name) for name in known]


def test_basins_carry_labels_and_points():
    artists = basin_map(LABELS, BOX, POINTS)
    assert artists.hatching is None
    np.testing.assert_array_equal(artists.image.get_array(), LABELS.T)
    assert artists.image.get_extent() == [-1, 1, -0.5, 0.5]
    lies_at(*zip(artists.attractors, ([[0.2, 0.1]], POINTS[1]), strict=True))
    assert [marker.get_label() for marker in artists.attractors] == ["attractor 0", "attractor 1"]
    called = basin_map(LABELS, BOX, POINTS, names=["clear", "hammering"]).attractors
    assert [marker.get_label() for marker in called] == ["clear", "hammering"]
    assert (artists.ax.get_xlabel(), artists.ax.get_ylabel()) == (X_LABEL, V_LABEL)


def test_cells_of_every_label_look_different():
    points = [[[k, 0.5]] for k in range(20)]
    artists = basin_map(np.arange(-4, 20)[:, None], ((-4.5, 19.5), (0, 1)), points)
    shown = [pixel(artists.image, (label, 0.5)) for label in range(-4, 20)]
    assert len(set(shown)) == len(shown)
    assert len({colour(k) for k in range(20)}) == len(COLOURS) == 20
    for label, marker in enumerate(artists.attractors):  # basins are pale versions of their attractors' colours
        paler = 0.35 * np.array(to_rgba(marker.get_color())) + 0.65
        np.testing.assert_allclose(shown[label + 4], paler, atol=1e-12)
    assert shown[2][3] == 0  # clear, so that the hatching is seen
    assert artists.hatching.get_hatch()


def test_kinds_choose_markers():
    kinds = ("periodic", "equilibrium", "limit cycle", "chaotic", "quasiperiodic")
    markers = basin_map(np.zeros((2, 2)), BOX, [[[0.0, 0.0]]] * 5, kinds=kinds).attractors
    assert [marker.get_marker() for marker in markers] == ["o", "s", "D", "o", "o"]
    assert markers[3].get_markersize() < markers[0].get_markersize() / 2
    saddles = section_portrait(
        LABELS, BOX, POINTS, saddles=[[[0, 0]]] * 4, saddle_kinds=("saddle", "flip saddle", "repeller", "chaotic")
    ).saddles
    assert [saddle.get_marker() for saddle in saddles] == ["X", "P", "^", "o"]
    assert names(saddles[0].axes)[2:] == ["saddle", "flip saddle", "repeller", "chaotic saddle"]


def test_the_portrait_carries_saddles_and_clipped_manifolds():
    across = [[-2.0, -0.1], [0.0, 0.1], [2.0, 0.3]]
    along = [[0.0, 0.0], [0.0, 0.4]]
    saddle = [[0.0, 0.1], [0.3, 0.3]]
    artists = section_portrait(
        LABELS, BOX, POINTS, kinds=("periodic", "chaotic"), saddles=[saddle], stable=[across, along], unstable=[along]
    )
    (stable, more), (unstable,), (cross,) = artists.stable, artists.unstable, artists.saddles
    np.testing.assert_allclose(stable.get_xydata(), [[-1, 0], [0, 0.1], [1, 0.2]], atol=1e-15)
    lies_at((more, along), (unstable, along), (cross, saddle))
    assert (stable.get_color(), more.get_color(), unstable.get_color()) == (STABLE, STABLE, UNSTABLE)
    axes = stable.axes
    assert (axes.get_xlim(), axes.get_ylim()) == BOX
    assert (axes.get_xlabel(), axes.get_ylabel()) == (X_LABEL, V_LABEL)
    kinds = ["attractor 0, periodic", "attractor 1, chaotic"]
    assert names(axes) == [*kinds, "stable manifold", "unstable manifold", "saddle"]


@pytest.mark.parametrize(
    ("labels", "points", "entries"),
    [
        ([[-1, -2], [-3, 0]], POINTS[:1], ["attractor 0", "not settled", "leaves the region", "not followed"]),
        (np.full((3, 4), -1), [], ["not settled"]),
    ],
)
def test_the_legend_names_cells_without_attractor(labels, points, entries):
    assert names(section_portrait(np.array(labels), BOX, points).ax) == entries


def test_limit_cycles_are_curves_in_the_colour_of_their_attractor():
    (cycle,) = section_portrait(LABELS, BOX, POINTS, cycles={1: SMALL}).cycles
    lies_at((cycle, SMALL))
    assert cycle.get_color() == colour(1)


# Steady motions

ANGLE = np.linspace(0, 2 * np.pi, 65)
SMALL = np.stack([0.3 * np.cos(ANGLE), 0.3 * np.sin(ANGLE)], axis=1)
LARGE = np.stack([0.6 * np.cos(ANGLE), 0.6 * np.sin(ANGLE)], axis=1)


def test_steady_motions_carry_orbits_section_points_and_stops():
    artists = steady_motions([SMALL, LARGE], [SMALL[:1], LARGE[:2]], stops=[(0.5, "right"), (-0.7, "left")])
    lies_at(*zip((*artists.orbits, *artists.points), (SMALL, LARGE, SMALL[:1], LARGE[:2]), strict=True))
    low, high = artists.ax.get_xlim()
    assert low < -0.7 < 0.6 < high
    assert [face.get_xdata()[0] for face in artists.stops] == [0.5, -0.7]
    walls = [(wall.get_x(), wall.get_x() + wall.get_width()) for wall in artists.walls]
    np.testing.assert_allclose(walls, [(0.5, high), (low, -0.7)])
    assert (artists.ax.get_xlabel(), artists.ax.get_ylabel()) == (X_LABEL, V_LABEL)
    assert names(artists.ax) == ["attractor 0", "attractor 1"]
    assert steady_motions([], [], stops=[(0.0, "left")]).walls[0].get_width() > 0


def test_equilibria_are_not_blown_up_to_their_rounding():
    rest = np.array([[1.0, 2e-16], [1.0, 1e-16]])
    axes = steady_motions([rest, -rest], [rest[:1], -rest[:1]], names=["one", "other"]).ax
    assert np.diff(axes.get_ylim()) > 0.1
    assert names(axes) == ["one", "other"]


# What changes with a parameter


def test_the_bifurcation_diagram_carries_points_and_marks():
    values, x, branches = [1.0, 1.0, 2.0, 3.0], [0.1, 0.5, 0.2, 0.3], [0, 4, 0, 0]
    marks = [("grazing", 1.5, 0.15), ("crisis", 2.5, 0.25), ("grazing", 2.8, np.nan), ("new", 2.9, 0.1)]
    artists = bifurcation_diagram(values, x, branches, marks, label=FREQUENCY)
    (first, other), (grazing, at, crisis, new) = artists.branches, artists.marks
    lies_at((first, [[1, 0.1], [2, 0.2], [3, 0.3]]), (other, [[1, 0.5]]))
    lies_at((grazing, [[1.5, 0.15]]), (crisis, [[2.5, 0.25]]))
    assert (first.get_color(), other.get_color()) == (colour(0), colour(4))
    assert at.get_xdata()[0] == 2.8
    assert len({mark.get_marker() for mark in (grazing, crisis, new)}) == 3  # kinds that are new have markers, too
    assert (artists.ax.get_xlabel(), artists.ax.get_ylabel()) == (FREQUENCY, r"displacement on the section $x$ (m)")
    assert names(artists.ax) == ["branch 0", "branch 4", "grazing", "crisis", "new"]
    nothing = bifurcation_diagram([], [], [], [], label=FREQUENCY)
    assert (nothing.branches, nothing.marks) == ((), ())


def heights(area, value):
    """Least and largest height of an area at a value."""
    corners = area.get_paths()[0].vertices
    own = corners[corners[:, 0] == value, 1]
    return own.min(), own.max()


def test_fractions_are_stacked():
    artists = basin_fractions([3, 1, 2], [[0.5, 0.25, 0.5], [np.nan, 0.5, 0.25]], ["a", "b"], label=FREQUENCY)
    (a, b), rest = artists.areas, artists.remainder
    assert [heights(a, value) for value in (1, 2, 3)] == [(0, 0.25), (0, 0.5), (0, 0.5)]
    assert [heights(b, value) for value in (1, 2, 3)] == [(0.25, 0.75), (0.5, 0.75), (0.5, 0.5)]
    assert [heights(rest, value) for value in (1, 2, 3)] == [(0.75, 1), (0.75, 1), (0.5, 1)]
    assert (a.axes.get_xlim(), a.axes.get_ylim(), a.axes.get_xlabel()) == ((1, 3), (0, 1), FREQUENCY)
    assert names(a.axes) == ["a", "b", "none of these"]


def test_a_gap_where_nothing_is_known():
    shares = [[0.5, 0.5, np.nan, 0.5, np.nan]] * 2
    artists = basin_fractions([1, 2, 3, 4, 5], shares, ["a", "b"], label=FREQUENCY, branches=[3, 7])
    assert artists.remainder is None
    assert [tuple(area.get_facecolor()[0][:3]) for area in artists.areas] == [to_rgba(colour(k))[:3] for k in (3, 7)]
    for area in artists.areas:
        assert np.unique(np.concatenate([path.vertices[:, 0] for path in area.get_paths()])).tolist() == [1, 2, 4]


# Action plots

ANGLES = [np.linspace(0, 6, 50), np.linspace(0, 6, 60)]
RADII = [np.linspace(0, 1, 50), np.zeros(60)]
ACTIONS = [1e-4 * (2 + np.cos(ANGLES[0])), 1e-3 * (2 + np.cos(ANGLES[1]))]
ACTIONS[0][:5] = np.nan


def test_actions_are_drawn_against_the_angle():
    artists = action_plot(ANGLES, RADII, ACTIONS, labels=[2, 0], names=["a", "b"], energies=[(2, 1e-4), (0, 1e-3)])
    for marks, angle, action in zip(artists.starts, ANGLES, ACTIONS, strict=True):
        lies_at((marks, np.stack([np.degrees(angle), action], axis=1)))
    assert [marks.get_color() for marks in artists.starts] == [colour(2), colour(0)]
    (least,) = artists.least  # the second search is a ring
    finite = least.get_ydata()[np.isfinite(least.get_ydata())]
    assert (finite.min(), len(finite)) == (np.nanmin(ACTIONS[0]), 45)
    assert [line.get_ydata()[0] for line in artists.energies] == [1e-4, 1e-3]
    assert "1.000 \\times 10^{-4}" in artists.numbers[0].get_text()
    assert names(artists.ax) == ["leaving a", "leaving b"]
    assert artists.ax.get_yscale() == "log"


def test_the_map_of_actions_marks_the_least():
    artists = action_map(ANGLES[0], RADII[0], ACTIONS[0], name="hammering")
    assert len(artists.others.get_xydata()) == 5
    best = int(np.nanargmin(ACTIONS[0]))
    np.testing.assert_allclose(artists.best.get_xydata(), [[np.degrees(ANGLES[0][best]), RADII[0][best]]])
    np.testing.assert_allclose(np.sort(artists.starts.get_array()), np.sort(ACTIONS[0][5:]))
    assert artists.ax.get_title() == "leaving hammering"
    assert "hammering" not in action_map(ANGLES[0], RADII[0], ACTIONS[0]).ax.get_title()


def test_a_search_that_found_no_exit_is_drawn(tmp_path):
    nothing = np.full(50, np.nan)
    artists = action_map(ANGLES[0], RADII[0], nothing)
    assert artists.best is None
    assert action_plot([], [], [], labels=[], names=[]).starts == ()
    action_plot(ANGLES[:1], RADII[:1], [nothing], labels=[0], names=["a"]).figure.savefig(tmp_path / "p.png", dpi=40)


# Mean exit times

TIMES = ExitTimes([4e-3, 2e-3, 1e-3], [1 + 0.01 / d for d in (4e-3, 2e-3, 1e-3)], [0.1, 0.2, 0.3], 1, "a → b")


def test_exit_times_are_drawn_against_the_inverse_intensity():
    artists = exit_times([TIMES])
    line, _, (bars,) = artists.points[0]
    np.testing.assert_allclose(line.get_xydata(), [[250, 3.5], [500, 6.0], [1000, 11.0]])
    lengths = [segment[1, 1] - segment[0, 1] for segment in bars.get_segments()]
    np.testing.assert_allclose(lengths, [0.2, 0.4, 0.6])
    assert names(artists.ax) == ["a → b"]


def test_slopes_of_exact_exit_times_are_the_energy():
    artists = exit_slopes([TIMES], [(1, "exact", 0.01, 0.009, 0.012)])
    line, _, (bars,) = artists.points[0]
    np.testing.assert_allclose(line.get_xydata(), [[2 / 750, 0.01], [2 / 1500, 0.01]])
    lengths = [segment[1, 1] - segment[0, 1] for segment in bars.get_segments()]
    np.testing.assert_allclose(lengths, [2 * np.hypot(0.1, 0.2) / 250, 2 * np.hypot(0.2, 0.3) / 500])
    assert artists.limits[0].get_ydata()[0] == 0.01
    assert (artists.bounds[0].get_y(), artists.bounds[0].get_height()) == pytest.approx((0.009, 0.003))
    assert names(artists.ax) == ["a → b", "exact"]
    assert to_rgba(artists.limits[0].get_color()) == to_rgba(line.get_color()) == to_rgba(colour(1))


@pytest.mark.parametrize(("lower", "upper"), [(0.009, np.inf), (np.nan, 0.012)])
def test_a_bound_that_is_not_known_is_shaded_to_the_edge(lower, upper):
    artists = exit_slopes([TIMES], [(1, "exact", 0.01, lower, upper)])
    (low, high), (band,) = artists.ax.get_ylim(), artists.bounds
    ends = (0.009, high) if np.isinf(upper) else (low, 0.012)
    assert (band.get_y(), band.get_y() + band.get_height()) == pytest.approx(ends, rel=1e-12)


def test_one_intensity_has_no_slope(tmp_path):
    artists = exit_slopes([ExitTimes([1e-3], [2.0], [0.1])])
    assert artists.points == ()
    assert artists.legend is None
    exit_times([]).figure.savefig(tmp_path / "p.png", dpi=40)


# All of them

PICTURES = {
    "basin_map": lambda ax: basin_map(LABELS, BOX, POINTS, ax=ax),
    "section_portrait": lambda ax: section_portrait(LABELS, BOX, POINTS, stable=[SMALL], ax=ax),
    "steady_motions": lambda ax: steady_motions([SMALL], [SMALL[:1]], stops=[(0.5, "right")], ax=ax),
    "bifurcation_diagram": lambda ax: bifurcation_diagram([1], [2], [0], [("fold", 1, 2)], label="k (1)", ax=ax),
    "phase_portrait": lambda ax: phase_portrait(SMALL[:, 0], SMALL[:, 1], stops=(0.5,), ax=ax),
    "action_plot": lambda ax: action_plot(ANGLES, RADII, ACTIONS, labels=[0, 1], names=["a", "b"], ax=ax),
    "basin_fractions": lambda ax: basin_fractions([1, 2], [[0.5, 0.5]], ["a"], label="k (1)", ax=ax),
    "exit_times": lambda ax: exit_times([TIMES], ax=ax),
    "exit_slopes": lambda ax: exit_slopes([TIMES], [(0, "limit", 1.0, 0.9, 1.1)], ax=ax),
}


@pytest.mark.parametrize("draw", PICTURES.values(), ids=PICTURES)
def test_axes_that_are_given_are_drawn_into(draw, tmp_path):
    figure = Figure(layout="constrained")
    axes, other = figure.subplots(1, 2)
    artists = draw(axes)
    assert artists.ax is axes
    assert artists.figure is figure
    for field in dataclasses.fields(artists)[1:]:
        part = getattr(artists, field.name)
        for artist in part if isinstance(part, tuple) else [part]:
            assert artist is None or getattr(artist, "axes", axes) is axes
    assert not other.has_data()
    assert draw(None).ax is not axes
    figure.savefig(tmp_path / "p.png", dpi=50)


def test_no_window_is_ever_opened():
    code = (
        "import importlib, pkgutil, sys, vibrokit.plots\n"
        "for one in pkgutil.iter_modules(vibrokit.plots.__path__):\n"
        "    importlib.import_module(f'vibrokit.plots.{one.name}')\n"
        "assert not {'matplotlib.pyplot', 'vibrokit.results', 'numba', 'sympy'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from vibrokit.plots import basins as cells
from vibrokit.plots.actions import action_map, action_plot
from vibrokit.plots.axes import COLOURS, colour
from vibrokit.plots.basins import STABLE, UNSTABLE, basin_map, section_portrait
from vibrokit.plots.bifurcation import basin_fractions, bifurcation_diagram
from vibrokit.plots.clipping import clipped
from vibrokit.plots.exit_times import ExitTimes, exit_slopes, exit_times
from vibrokit.plots.portraits import phase_portrait, steady_motions
from vibrokit.plots.quasi_potential import quasi_potential_map
from vibrokit.results import basins as records

BOX = ((-1.0, 1.0), (-0.5, 0.5))
X_LABEL, V_LABEL = r"displacement $x$ (m)", r"velocity $v$ (m s$^{-1}$)"
FREQUENCY = r"forcing frequency $\omega$ (rad s$^{-1}$)"
POINTS = [[[0.2, 0.1, 9.0]], [[-0.2, 0.1], [-0.3, 0.2]]]  # the first has a noise state besides x and v
LABELS = np.array([[0, 1], [0, 1], [1, 1]])


def names(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


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
    gaps = np.flatnonzero(np.isnan(inside[:, 0]))
    np.testing.assert_array_equal(np.isnan(inside[:, 0]), np.isnan(inside[:, 1]))
    assert len(gaps) == 2  # starts on the right, is away above and below
    drawn = inside[~np.isnan(inside[:, 0])]
    assert np.abs(drawn[:, 1]).max() == 0.5
    np.testing.assert_allclose(np.hypot(*drawn.T), 0.6, rtol=1e-8)
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
    for name in ("UNSETTLED", "ESCAPED", "NOT_FOLLOWED"):
        assert getattr(cells, name) == getattr(records, name)


def test_basins_carry_labels_and_points():
    artists = basin_map(LABELS, BOX, POINTS)
    image, (clear, hammering) = artists.image, artists.attractors
    assert artists.hatching is None
    np.testing.assert_array_equal(image.get_array(), LABELS.T)
    assert image.get_extent() == [-1, 1, -0.5, 0.5]
    np.testing.assert_array_equal(clear.get_xydata(), [[0.2, 0.1]])
    np.testing.assert_array_equal(hammering.get_xydata(), POINTS[1])
    assert [clear.get_label(), hammering.get_label()] == ["attractor 0", "attractor 1"]
    called = basin_map(LABELS, BOX, POINTS, names=["clear", "hammering"]).attractors
    assert [marker.get_label() for marker in called] == ["clear", "hammering"]
    assert (image.axes.get_xlabel(), image.axes.get_ylabel()) == (X_LABEL, V_LABEL)


def test_cells_of_every_label_look_different():
    labels = np.arange(-3, 20)[:, None]
    box = ((-3.5, 19.5), (0, 1))
    points = [[[k, 0.5]] for k in range(20)]
    artists = basin_map(labels, box, points)
    image, under, markers = artists.image, artists.hatching, artists.attractors
    shown = [pixel(image, (label, 0.5)) for label in range(-3, 20)]
    assert len(set(shown)) == len(shown)
    for label, marker in enumerate(markers):  # basins are pale versions of their attractors' colours
        paler = 0.35 * np.array(to_rgba(marker.get_color())) + 0.65
        np.testing.assert_allclose(shown[label + 3], paler, atol=1e-12)
    not_followed, left, unsettled = shown[:3]
    assert left[3] == 0  # clear, so that the hatching is seen
    assert isinstance(under, Rectangle)
    assert under.get_hatch()
    assert under.get_zorder() < image.get_zorder()
    for grey in (not_followed, unsettled):
        assert grey[0] == grey[1] == grey[2]
        assert grey[3] == 1


def test_twenty_attractors_have_twenty_colours():
    assert len({colour(k) for k in range(20)}) == len(COLOURS) == 20


def test_hatching_is_drawn_only_where_motion_leaves():
    assert basin_map(LABELS, BOX, POINTS).hatching is None
    assert basin_map(np.where(LABELS == 0, -2, 1), BOX, POINTS).hatching.get_hatch()


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
    np.testing.assert_array_equal(more.get_xydata(), along)
    np.testing.assert_array_equal(unstable.get_xydata(), along)
    np.testing.assert_array_equal(cross.get_xydata(), saddle)
    assert stable.get_color() == more.get_color() == STABLE
    assert unstable.get_color() == UNSTABLE
    axes = stable.axes
    assert (axes.get_xlim(), axes.get_ylim()) == BOX
    assert (axes.get_xlabel(), axes.get_ylabel()) == (X_LABEL, V_LABEL)
    kinds = ["attractor 0, periodic", "attractor 1, chaotic"]
    assert names(axes) == [*kinds, "stable manifold", "unstable manifold", "saddle"]


def test_the_legend_names_cells_without_attractor():
    labels = np.array([[-1, -2], [-3, 0]])
    artists = section_portrait(labels, BOX, POINTS[:1])
    assert names(artists.ax) == ["attractor 0", "not settled", "leaves the region", "not followed"]


def test_a_region_without_attractors_is_drawn():
    artists = section_portrait(np.full((3, 4), -1), BOX, [])
    assert (artists.hatching, artists.attractors, artists.saddles) == (None, (), ())
    assert names(artists.ax) == ["not settled"]


def test_limit_cycles_are_curves_in_the_colour_of_their_attractor():
    (cycle,) = section_portrait(LABELS, BOX, POINTS, cycles={1: SMALL}).cycles
    np.testing.assert_array_equal(cycle.get_xydata(), SMALL)
    assert cycle.get_color() == colour(1)


# Steady motions

ANGLE = np.linspace(0, 2 * np.pi, 65)
SMALL = np.stack([0.3 * np.cos(ANGLE), 0.3 * np.sin(ANGLE)], axis=1)
LARGE = np.stack([0.6 * np.cos(ANGLE), 0.6 * np.sin(ANGLE)], axis=1)


def test_steady_motions_carry_orbits_section_points_and_stops():
    artists = steady_motions([SMALL, LARGE], [SMALL[:1], LARGE[:2]], stops=[(0.5, "right"), (-0.7, "left")])
    (small, large), (small_points, large_points) = artists.orbits, artists.points
    (right, left), (right_wall, left_wall) = artists.stops, artists.walls
    np.testing.assert_array_equal(small.get_xydata(), SMALL)
    np.testing.assert_array_equal(small_points.get_xydata(), SMALL[:1])
    np.testing.assert_array_equal(large.get_xydata(), LARGE)
    np.testing.assert_array_equal(large_points.get_xydata(), LARGE[:2])
    axes = small.axes
    low, high = axes.get_xlim()
    assert low < -0.7 < 0.6 < high
    assert (right.get_xdata()[0], left.get_xdata()[0]) == (0.5, -0.7)
    assert (right_wall.get_x(), right_wall.get_x() + right_wall.get_width()) == pytest.approx((0.5, high))
    assert (left_wall.get_x(), left_wall.get_x() + left_wall.get_width()) == pytest.approx((low, -0.7))
    assert right_wall.get_hatch()
    assert right_wall.get_zorder() < right.get_zorder() < small.get_zorder() < small_points.get_zorder()
    assert (axes.get_xlabel(), axes.get_ylabel()) == (X_LABEL, V_LABEL)
    assert names(axes) == ["attractor 0", "attractor 1"]


def test_equilibria_are_not_blown_up_to_their_rounding():
    rest = np.array([[1.0, 2e-16], [1.0, 1e-16]])
    axes = steady_motions([rest, -rest], [rest[:1], -rest[:1]], names=["one", "other"]).ax
    assert np.diff(axes.get_ylim()) > 0.1
    assert names(axes) == ["one", "other"]


def test_walls_where_nothing_moves():
    artists = steady_motions([], [], stops=[(0.0, "left")])
    (face,), (wall,) = artists.stops, artists.walls
    assert face.get_xdata()[0] == 0
    assert wall.get_width() > 0


# What changes with a parameter


def test_the_bifurcation_diagram_carries_points_and_marks():
    values, x, branches = [1.0, 1.0, 2.0, 3.0], [0.1, 0.5, 0.2, 0.3], [0, 4, 0, 0]
    marks = [("grazing", 1.5, 0.15), ("fold", 2.5, 0.25), ("grazing", 2.8, np.nan), ("grazing", 2.9, np.nan)]
    artists = bifurcation_diagram(values, x, branches, marks, label=FREQUENCY)
    (first, other), (grazing, at, also, fold) = artists.branches, artists.marks
    np.testing.assert_array_equal(first.get_xydata(), [[1, 0.1], [2, 0.2], [3, 0.3]])
    np.testing.assert_array_equal(other.get_xydata(), [[1, 0.5]])
    assert (first.get_color(), other.get_color()) == (colour(0), colour(4))
    np.testing.assert_array_equal(grazing.get_xydata(), [[1.5, 0.15]])
    np.testing.assert_array_equal(fold.get_xydata(), [[2.5, 0.25]])
    assert (at.get_xdata()[0], also.get_xdata()[0]) == (2.8, 2.9)
    assert grazing.get_marker() != fold.get_marker()
    axes = first.axes
    assert axes.get_xlabel() == FREQUENCY
    assert axes.get_ylabel() == r"displacement on the section $x$ (m)"
    assert names(axes) == ["branch 0", "branch 4", "grazing", "fold"]


def test_a_kind_that_is_new_has_a_marker_and_a_name():
    marks = [("crisis", 1.0, 0.0), ("unheard of", 2.0, 0.0)]
    artists = bifurcation_diagram([1.0], [0.0], [0], marks, label="k (1)")
    first, second = artists.marks
    assert first.get_marker() != second.get_marker()
    assert names(artists.ax) == ["branch 0", "crisis", "unheard of"]


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
    assert (a.axes.get_xlim(), a.axes.get_ylim()) == ((1, 3), (0, 1))
    assert a.axes.get_xlabel() == FREQUENCY
    assert names(a.axes) == ["a", "b", "none of these"]


def test_a_gap_where_nothing_is_known():
    nan = np.nan
    artists = basin_fractions([1, 2, 3, 4, 5], [[0.5, 0.5, nan, 0.5, nan]] * 2, ["a", "b"], label=FREQUENCY)
    assert artists.remainder is None
    for area in artists.areas:
        assert np.unique(np.concatenate([path.vertices[:, 0] for path in area.get_paths()])).tolist() == [1, 2, 4]


def test_a_diagram_without_points_is_drawn():
    artists = bifurcation_diagram([], [], [], [], label=FREQUENCY)
    assert (artists.branches, artists.marks) == ((), ())


def test_nothing_is_left_where_all_is_reached():
    artists = basin_fractions([1, 2], [[0.9, 0.8], [0.1, 0.2]], ["a", "b"], label=FREQUENCY, branches=[3, 7])
    assert artists.remainder is None
    assert [tuple(area.get_facecolor()[0][:3]) for area in artists.areas] == [to_rgba(colour(k))[:3] for k in (3, 7)]


# Action plots

ANGLES = [np.linspace(0, 6, 50), np.linspace(0, 6, 60)]
RADII = [np.linspace(0, 1, 50), np.zeros(60)]
ACTIONS = [1e-4 * (2 + np.cos(ANGLES[0])), 1e-3 * (2 + np.cos(ANGLES[1]))]
ACTIONS[0][:5] = np.nan


def test_actions_are_drawn_against_the_angle():
    artists = action_plot(ANGLES, RADII, ACTIONS, labels=[2, 0], names=["a", "b"], energies=[(2, 1e-4), (0, 1e-3)])
    for marks, angle, action in zip(artists.starts, ANGLES, ACTIONS, strict=True):
        np.testing.assert_allclose(marks.get_xdata(), np.degrees(angle))
        np.testing.assert_array_equal(marks.get_ydata(), action)
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


def test_one_intensity_has_no_slope(tmp_path):
    artists = exit_slopes([ExitTimes([1e-3], [2.0], [0.1])])
    assert artists.points == ()
    assert artists.legend is None
    exit_times([]).figure.savefig(tmp_path / "p.png", dpi=40)


# Quasi-potentials


def test_all_attractors_are_marked_on_a_quasi_potential():
    artists = quasi_potential_map(np.ones((3, 2)), BOX, POINTS[0][0:1], names=["a", "b"], others={1: POINTS[1]})
    assert [to_rgba(line.get_color()) for line in (artists.attractor, *artists.others)] == [
        to_rgba(colour(label)) for label in (0, 1)
    ]
    assert names(artists.ax) == ["a", "b"]


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
        "import sys, vibrokit.plots.actions, vibrokit.plots.basins, vibrokit.plots.bifurcation\n"
        "import vibrokit.plots.exit_times, vibrokit.plots.portraits, vibrokit.plots.trade\n"
        "assert not {'matplotlib.pyplot', 'vibrokit.results', 'numba', 'sympy'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)

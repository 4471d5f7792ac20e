import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

from vibrokit.plots.axes import colour
from vibrokit.plots.exit_paths import exit_paths, path_history
from vibrokit.plots.quasi_potential import quasi_potential_map
from vibrokit.results.energy import ActivationEnergy, ExitPath
from vibrokit.results.path_pictures import plot_exit_paths
from vibrokit.results.section import Section

BOX = ((-1.0, 1.0), (-0.5, 0.5))
LABELS = np.array([[0, 1, 1], [0, 1, 1], [0, 0, 1], [0, 0, -1]])
FOUR = np.array([[0.2, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.2, -0.1]])
CROWD = np.random.default_rng(0).uniform(-0.3, 0.3, (200, 2))
LONG = np.stack([np.linspace(0.0, 0.9, 21), 0.2 * np.sin(np.arange(21))], axis=1)
SADDLE = np.array([[0.9, 0.2]])
MANIFOLD = np.array([[0.9, -3.0], [0.9, 3.0]])
TIME = np.linspace(0.0, 40.0, 401)
ACTION = 1e-4 * np.exp(0.5 * (TIME - 40.0))
HISTORY = (TIME, 1e-3 * np.sin(TIME), ACTION, np.arange(0, 401, 20))


def names(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def drawn(artists, colour_of):
    """Lines of a colour that are no markers of attractors."""
    return [line for line in artists if getattr(line, "get_color", lambda: None)() == colour_of]


def test_a_path_is_joined_point_by_point():
    artists = exit_paths(LABELS, BOX, [[[0.0, 0.0]], [[0.5, 0.0]]], [LONG], sources=[0], names=["the way out"])
    _, strand = drawn(artists, colour(0))[:2]
    np.testing.assert_array_equal(strand.get_xydata(), LONG)
    assert strand.get_linestyle() == "-"
    *_, start, end = artists
    np.testing.assert_array_equal(start.get_xydata(), LONG[:1])
    np.testing.assert_array_equal(end.get_xydata(), LONG[-1:])
    assert start.get_marker() != end.get_marker()
    assert names(strand.axes) == [
        "attractor 0",
        "attractor 1",
        "the way out",
        "not settled",
        "start of a path",
        "end of a path",
    ]


def test_a_path_from_an_orbit_of_period_four_is_four_strands():
    artists = exit_paths(LABELS, BOX, [FOUR], [LONG], sources=[0])
    strands = drawn(artists, colour(0))[1:5]
    for first, strand in enumerate(strands):
        np.testing.assert_array_equal(strand.get_xydata(), LONG[first::4])
    assert [name for name in names(artists[-1].axes) if "exit path" in name] == ["exit path from 0"]


def test_a_path_given_all_along_is_a_line_without_dots():
    artists = exit_paths(LABELS, BOX, [FOUR], [LONG, -LONG], sources=[0, 0], names=["a", "b"], curves=[True, False])
    by_name = {artist.get_label(): artist for artist in artists}
    np.testing.assert_array_equal(by_name["a"].get_xydata(), LONG)
    assert by_name["a"].get_marker() == ""
    np.testing.assert_array_equal(by_name["b"].get_xydata(), -LONG[::4])
    assert by_name["b"].get_marker() == "o"


@pytest.mark.parametrize(("swing", "shown"), [(0.0, 41), (0.3, 5)])
def test_paths_from_rest_are_shown_whole_and_others_on_the_section(swing, shown):
    t = np.linspace(0.0, 4.0, 41)
    x = np.exp(2 * (t - 4.0)) + swing * np.sin(2 * np.pi * t)
    q = np.stack([x, np.gradient(x, t)], axis=1)
    path = ExitPath(t, q, 0 * q, t, np.arange(0, 41, 10))
    energy = ActivationEnergy(0, 1, 1.0, 1.0, 1.0, "least action", 0.0, path)
    data = Section(LABELS.astype(np.int16), np.array(BOX), (FOUR[:1], FOUR[1:2])).data
    artists = plot_exit_paths(data, [energy])
    (line,) = [artist for artist in artists if artist.get_label().startswith("path 0 → 1")]
    np.testing.assert_array_equal(line.get_xydata(), q if swing == 0 else q[path.section])
    assert len(line.get_xydata()) == shown


def test_a_path_from_chaos_is_dots():
    artists = exit_paths(LABELS, BOX, [CROWD], [LONG], sources=[0])
    _, dots = drawn(artists, colour(0))[:2]
    np.testing.assert_array_equal(dots.get_xydata(), LONG)
    assert dots.get_linestyle() == "None"


def test_saddles_and_manifolds_lie_under_the_path():
    artists = exit_paths(LABELS, BOX, [FOUR], [LONG], sources=[0], saddles=[SADDLE], chaotic=[CROWD], stable=[MANIFOLD])
    axes = artists[0].axes
    assert (axes.get_xlim(), axes.get_ylim()) == BOX
    by_name = {artist.get_label(): artist for artist in artists}
    np.testing.assert_allclose(by_name["stable manifold"].get_xydata(), [[0.9, -0.5], [0.9, 0.5]])
    np.testing.assert_array_equal(by_name["saddle"].get_xydata(), SADDLE)
    np.testing.assert_array_equal(by_name["chaotic saddle"].get_xydata(), CROWD)
    assert by_name["stable manifold"].get_zorder() < by_name["exit path from 0"].get_zorder()


def test_two_ways_out_of_one_attractor_look_different():
    two = [FOUR[:1], FOUR[1:2]]
    artists = exit_paths(LABELS, BOX, two, [LONG, -LONG, LONG], sources=[0, 0, 1], names=["a", "b", "c"])
    by_name = {artist.get_label(): artist for artist in artists}
    a, b, c = (by_name[name] for name in "abc")
    assert a.get_color() == b.get_color() != c.get_color()
    assert a._dash_pattern != b._dash_pattern


def test_the_legend_is_outside_of_the_picture(tmp_path):
    figure = Figure(layout="constrained")
    axes = figure.subplots(1, 2)
    drawings = [None, axes[0]]
    for ax in drawings:
        own = exit_paths(LABELS, BOX, [FOUR], [LONG], sources=[0], ax=ax)[0].axes
        own.get_figure().savefig(tmp_path / "p.png", dpi=60)
        box, legend = own.get_window_extent(), own.get_legend().get_window_extent()
        assert not box.overlaps(legend.padded(-1))


def test_without_paths_the_section_is_drawn():
    artists = exit_paths(np.full((2, 2), -1), BOX, [])
    assert names(artists[0].axes) == ["not settled"]
    empty = exit_paths(LABELS, BOX, [FOUR], [np.empty((0, 2))], sources=[0])
    assert empty


def test_histories_carry_momentum_action_and_section_points():
    line, dots, action, action_dots = path_history([HISTORY], sources=[1], names=["out"], period=2.0)
    np.testing.assert_array_equal(line.get_xydata(), np.stack([TIME / 2, HISTORY[1]], axis=1))
    np.testing.assert_array_equal(dots.get_xdata(), np.arange(21))
    np.testing.assert_array_equal(action.get_ydata(), ACTION)
    np.testing.assert_array_equal(action_dots.get_ydata(), ACTION[::20])
    upper, lower = line.axes, action.axes
    assert upper.get_ylabel() == r"momentum $p_2$ (m s$^{-2}$)"
    assert lower.get_ylabel() == r"action $S$ (m$^2$ s$^{-3}$)"
    assert "T" in lower.get_xlabel()
    assert upper.get_title() == "out"
    assert upper.get_xlim() == lower.get_xlim()
    assert line.get_color() == colour(1)
    assert upper.get_position().y0 > lower.get_position().y0


def test_the_time_axis_begins_where_the_action_does():
    line, *_ = path_history([HISTORY])
    low, high = line.axes.get_xlim()
    begins = 40 - np.log(1e4) / 0.5
    assert begins - 3 < low < begins < 40 < high < 43
    assert "(s)" in line.get_figure().axes[1].get_xlabel()


def test_each_path_has_its_own_panels():
    artists = path_history([HISTORY, HISTORY], sources=[0, 1])
    assert len({artist.axes for artist in artists}) == 4
    figure = Figure()
    axes = figure.subplots(2, 2)
    own = path_history([HISTORY, HISTORY], ax=axes)
    assert {artist.axes for artist in own} == set(axes.ravel())
    single = Figure().subplots(2)
    assert {artist.axes for artist in path_history([HISTORY], ax=single)} == set(single)


# Quasi-potential


def potential(shape=(40, 30)):
    x, v = (low + (high - low) * (np.arange(n) + 0.5) / n for (low, high), n in zip(BOX, shape, strict=True))
    return x[:, None] ** 2 + v[None] ** 2


def test_the_quasi_potential_lies_where_it_belongs():
    psi = potential()
    psi[:5] = np.inf
    image, levels, point, saddle, path = quasi_potential_map(
        psi, BOX, FOUR[:1], saddles=[SADDLE], paths=[LONG], top=0.5
    )
    assert image.get_extent() == [-1, 1, -0.5, 0.5]
    np.testing.assert_array_equal(image.get_array().mask.T, np.isinf(psi))
    np.testing.assert_array_equal(image.get_array().filled(np.inf).T, psi)
    assert image.get_clim() == (0, 0.5)
    for value, lines in zip(levels.levels, levels.allsegs, strict=True):
        for segment in lines:  # of x² + v², up to what linear interpolation between cells leaves
            np.testing.assert_allclose((segment**2).sum(axis=1), value, atol=0.25 * 0.05**2)
    np.testing.assert_array_equal(point.get_xydata(), FOUR[:1])
    np.testing.assert_array_equal(saddle.get_xydata(), SADDLE)
    np.testing.assert_array_equal(path.get_xydata(), LONG)


@pytest.mark.parametrize("psi", [np.full((3, 3), np.inf), np.zeros((3, 3)), np.ones((1, 4))])
def test_flat_and_unknown_potentials_are_drawn(psi, tmp_path):
    image, *_ = quasi_potential_map(psi, BOX, FOUR)
    image.get_figure().savefig(tmp_path / "p.png", dpi=40)


def test_no_window_is_ever_opened():
    code = (
        "import sys, vibrokit.plots.exit_paths, vibrokit.plots.quasi_potential\n"
        "assert not {'matplotlib.pyplot', 'vibrokit.results', 'numba', 'sympy'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)

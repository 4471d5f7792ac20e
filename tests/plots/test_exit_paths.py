import numpy as np
import pytest
from matplotlib.figure import Figure

from vibrokit.errors import VibrokitError
from vibrokit.plots.axes import MARKS, colour
from vibrokit.plots.exit_paths import exit_paths, path_history
from vibrokit.plots.quasi_potential import quasi_potential_map
from vibrokit.results.energy import ActivationEnergy, Bound, ExitPath
from vibrokit.results.result import Result
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


def lies_at(*pairs):
    """Each artist lies at its points."""
    for artist, points in pairs:
        np.testing.assert_array_equal(artist.get_xydata(), points)


def test_a_path_is_joined_point_by_point():
    two = [[[0.0, 0.0]], [[0.5, 0.0]]]
    artists = exit_paths(LABELS, BOX, two, [LONG], sources=[0], titles=["a path"], names=["clear", "hammering"])
    ((strand,),) = artists.strands
    (start,), (end,) = artists.starts, artists.ends
    lies_at((strand, LONG), (start, LONG[:1]), (end, LONG[-1:]))
    assert (strand.get_linestyle(), strand.get_color()) == ("-", colour(0))
    assert start.get_marker() != end.get_marker()
    ends = ["start of a path", "end of a path"]
    assert names(artists.ax) == ["clear", "hammering", "a path", "not settled", *ends]


def test_a_path_from_an_orbit_of_period_four_is_four_strands_unless_it_is_given_all_along():
    four, whole = exit_paths(LABELS, BOX, [FOUR], [LONG, -LONG], sources=[0, 0], curves=[False, True]).strands
    assert [strand.get_marker() for strand in (four[0], *whole)] == [MARKS[0], ""]
    lies_at(*zip(four, (LONG[first::4] for first in range(4)), strict=True), (whole[0], -LONG))
    assert [name for name in names(four[0].axes) if "exit path" in name] == ["exit path from attractor 0"] * 2


@pytest.mark.parametrize(("swing", "shown"), [(0.0, 41), (0.3, 5)])
def test_paths_from_rest_are_shown_whole_and_others_on_the_section(swing, shown):
    t = np.linspace(0.0, 4.0, 41)
    x = np.exp(2 * (t - 4.0)) + swing * np.sin(2 * np.pi * t)
    q = np.stack([x, np.gradient(x, t)], axis=1)
    path = ExitPath(t, q, 0 * q, t, np.arange(0, 41, 10))
    energy = ActivationEnergy(0, 1, 1.0, 1.0, 1.0, "least action", Bound.UPPER, path=path)
    section = Section(LABELS.astype(np.int16), np.array(BOX), (FOUR[:1], FOUR[1:2]), ("rest", "hammering"))
    ((line,),) = Result(energies=(energy,), section=section, scene={}).plot().strands
    assert line.get_label().startswith("rest → hammering, ")
    np.testing.assert_array_equal(line.get_xydata(), q if swing == 0 else q[path.section])
    assert len(line.get_xydata()) == shown


def test_a_path_from_chaos_is_dots():
    ((dots,),) = exit_paths(LABELS, BOX, [CROWD], [LONG], sources=[0]).strands
    lies_at((dots, LONG))
    assert dots.get_linestyle() == "None"


def test_saddles_and_manifolds_lie_under_the_path():
    artists = exit_paths(LABELS, BOX, [FOUR], [LONG], sources=[0], saddles=[SADDLE], chaotic=[CROWD], stable=[MANIFOLD])
    assert (artists.ax.get_xlim(), artists.ax.get_ylim()) == BOX
    (manifold,), (saddle, chaotic) = artists.section.stable, artists.section.saddles
    np.testing.assert_allclose(manifold.get_xydata(), [[0.9, -0.5], [0.9, 0.5]])
    lies_at((saddle, SADDLE), (chaotic, CROWD))
    assert (saddle.get_label(), chaotic.get_label()) == ("saddle", "chaotic saddle")


def test_two_ways_out_of_one_attractor_look_different():
    two = [FOUR[:1], FOUR[1:2]]
    artists = exit_paths(LABELS, BOX, two, [LONG, -LONG, LONG], sources=[0, 0, 1])
    (a,), (b,), (c,) = artists.strands
    assert a.get_color() == b.get_color() != c.get_color()
    assert a._dash_pattern != b._dash_pattern


def test_the_legend_is_outside_of_the_picture(tmp_path):
    figure = Figure(layout="constrained")
    axes = figure.subplots(1, 2)
    for ax in (None, axes[0]):
        own = exit_paths(LABELS, BOX, [FOUR], [LONG], sources=[0], ax=ax).ax
        own.get_figure().savefig(tmp_path / "p.png", dpi=60)
        box, legend = own.get_window_extent(), own.get_legend().get_window_extent()
        assert not box.overlaps(legend.padded(-1))


def test_without_paths_the_section_is_drawn():
    artists = exit_paths(np.full((2, 2), -1), BOX, [])
    assert names(artists.ax) == ["not settled"]
    assert artists.strands == artists.starts == ()
    (strands,) = exit_paths(LABELS, BOX, [FOUR], [np.empty((0, 2))], sources=[0]).strands
    assert [len(strand.get_xydata()) for strand in strands] == [0, 0, 0, 0]


def test_histories_carry_momentum_action_and_section_points():
    artists = path_history([HISTORY], sources=[1], titles=["out"], period=2.0)
    momentum, action = np.stack([TIME / 2, HISTORY[1]], axis=1), np.stack([TIME / 2, ACTION], axis=1)
    lies_at(
        (artists.momenta[0], momentum), (artists.momentum_points[0], momentum[::20]),
        (artists.actions[0], action), (artists.action_points[0], action[::20]),
    )  # fmt: skip
    upper, lower = artists.ax, artists.actions[0].axes
    assert artists.momenta[0].axes is upper
    labels = (upper.get_ylabel(), lower.get_ylabel(), upper.get_title())
    assert labels == (r"momentum $p_2$ (m s$^{-2}$)", r"action $S$ (m$^2$ s$^{-3}$)", "out")
    assert upper.get_xlim() == lower.get_xlim()
    assert artists.momenta[0].get_color() == colour(1)


def test_the_time_axis_begins_where_the_action_does():
    artists = path_history([HISTORY])
    low, high = artists.ax.get_xlim()
    begins = 40 - np.log(1e4) / 0.5
    assert begins - 3 < low < begins < 40 < high < 43
    assert "(s)" in artists.figure.axes[1].get_xlabel()


def test_each_path_has_its_own_panels():
    def panels(artists):
        return {line.axes for line in (*artists.momenta, *artists.actions)}

    assert len(panels(path_history([HISTORY, HISTORY], sources=[0, 1]))) == 4
    axes = Figure().subplots(2, 2)
    assert panels(path_history([HISTORY, HISTORY], ax=axes)) == set(axes.ravel())
    single = Figure().subplots(2)
    assert panels(path_history([HISTORY], ax=single)) == set(single)
    with pytest.raises(VibrokitError, match=r"ax has 1 axes; give an array of shape \(2, 2\)"):
        path_history([HISTORY, HISTORY], ax=Figure().add_subplot())


# Quasi-potential


def potential(shape=(40, 30)):
    x, v = (low + (high - low) * (np.arange(n) + 0.5) / n for (low, high), n in zip(BOX, shape, strict=True))
    return x[:, None] ** 2 + v[None] ** 2


def test_the_quasi_potential_lies_where_it_belongs():
    psi = potential()
    psi[:5] = np.inf
    artists = quasi_potential_map(
        psi, BOX, FOUR[:1], label=1, names=["clear", "hammering"], saddles=[SADDLE], paths=[LONG], top=0.5,
        others={0: FOUR[1:]},
    )  # fmt: skip
    image, levels = artists.image, artists.contours
    lies_at((artists.attractor, FOUR[:1]), (artists.saddles[0], SADDLE), (artists.paths[0], LONG))
    assert names(artists.ax) == ["hammering", "clear", "saddle", "exit path"]
    assert [line.get_color() for line in (artists.attractor, *artists.others)] == [colour(1), colour(0)]
    assert image.get_extent() == [-1, 1, -0.5, 0.5]
    np.testing.assert_array_equal(image.get_array().filled(np.inf).T, psi)
    assert image.get_clim() == (0, 0.5)
    for value, lines in zip(levels.levels, levels.allsegs, strict=True):
        for segment in lines:  # of x² + v², up to what linear interpolation between cells leaves
            np.testing.assert_allclose((segment**2).sum(axis=1), value, atol=0.25 * 0.05**2)


@pytest.mark.parametrize("psi", [np.full((3, 3), np.inf), np.zeros((3, 3)), np.ones((1, 4))])
def test_flat_and_unknown_potentials_are_drawn(psi, tmp_path):
    artists = quasi_potential_map(psi, BOX, FOUR)
    assert artists.contours is None
    artists.figure.savefig(tmp_path / "p.png", dpi=40)

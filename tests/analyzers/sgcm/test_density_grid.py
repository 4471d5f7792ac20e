"""Nodes beside the faces of an exit, and shares of cells, against areas in closed form."""

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import scene
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.results.region import Region

REGION = Region((-1.0, 1.5), (-2.0, 2.0))


@pytest.mark.parametrize("barriers", [(), (vk.Barrier(vk.Linear(1e3), 0.9, "right"),)])
@pytest.mark.parametrize("faces", [(-np.inf, 0.31), (-0.4, 0.31), (-0.41, np.inf)])
def test_faces_are_halfway_between_nodes_of_a_grid_that_covers_the_region(barriers, faces):
    grid = DensityGrid.of(scene(*barriers), REGION, (71, 50), np.array([faces, (-np.inf, 0.7)]))
    assert grid.shape == (71, 50)
    assert grid.x[0] <= REGION.x[0]
    assert grid.x[-1] >= REGION.x[1]
    assert grid.v[0] <= REGION.v[0]
    assert grid.v[-1] >= REGION.v[1]
    middles = 0.5 * (grid.x[1:] + grid.x[:-1])
    for face in (face for face in faces if np.isfinite(face)):
        assert np.abs(middles - face).min() < 1e-3 * np.diff(grid.x).min()
    assert np.abs(0.5 * (grid.v[1:] + grid.v[:-1]) - 0.7).min() < 1e-12


def test_a_face_outside_the_region_changes_nothing():
    plain = DensityGrid.of(scene(), REGION, (40, 40))
    faced = DensityGrid.of(scene(), REGION, (40, 40), np.array([(-3.0, 2.0), (-np.inf, np.inf)]))
    np.testing.assert_array_equal(faced.x, plain.x)


def test_the_share_of_a_half_plane_and_of_a_disc_is_their_area():
    grid = DensityGrid(np.linspace(0.0, 1.0, 101), np.linspace(0.0, 1.0, 101))
    x, v = np.moveaxis(grid.nodes, -1, 0)
    half = grid.share(x - 0.503)
    assert (half * grid.areas).sum() == pytest.approx(1.01 * 0.502, rel=1e-9)  # outermost cells are whole ones
    disc = grid.share(0.3 - np.hypot(x - 0.5, v - 0.5))
    assert (disc * grid.areas).sum() == pytest.approx(np.pi * 0.09, rel=1e-3)


def test_a_share_of_nothing_known_is_nothing():
    grid = DensityGrid(np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 5))
    assert not grid.share(np.full((5, 5), -np.inf)).any()
    assert grid.share(np.where(np.eye(5) > 0, 1.0, -np.inf)).max() == 1.0

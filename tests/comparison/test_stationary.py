"""Stationary densities: balance of rates, exact distributions, bad input."""

import math

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import double_well
from vibrokit.comparison.quantities import Kind
from vibrokit.comparison.verdicts import Agreement
from vibrokit.results.one_scene import part_of


@pytest.fixture(scope="module")
def wells():
    """Double well at ζ = 0.2, and what SGCM finds for both sides at ΔU/D = 10."""
    osc = double_well(noise=vk.WhiteNoise(intensity=0.02)).replace(damping_ratio=0.2)
    structure = vk.find_structure(osc, cells=(40, 40), manifolds=False, rng=0)
    return vk.SGCM(intensities=(0.02,), nodes=(80, 80), steps=40).run(osc, structure)


@pytest.mark.slow
def test_density_of_the_double_well_is_the_one_of_boltzmann(wells):
    found = vk.StationaryDensity.of(wells, nodes=(81, 81))
    np.testing.assert_allclose(found.occupancies.values, [[0.5, 0.5]], rtol=0.01)
    assert (found.occupancies["lower"] < 0.5).all()
    assert (found.occupancies["upper"] > 0.5).all()
    x, v = np.meshgrid(found.x, found.v, indexing="ij")
    energy = 0.5 * v**2 - 0.5 * x**2 + 0.25 * x**4 + 0.25
    known = energy < 0.25
    area = (found.x[1] - found.x[0]) * (found.v[1] - found.v[0])
    exact = -4 * 0.2 * energy / 0.02
    exact -= math.log(np.exp(exact).sum() * area)
    np.testing.assert_allclose(found.log_density[0][known], exact[known], atol=0.15)
    assert float((found.density[0] * area).sum()) == pytest.approx(1.0, rel=0.02)


@pytest.mark.slow
def test_barrier_at_the_saddle(wells):
    barrier = float(wells.barrier("left-rest")[0])
    assert barrier == pytest.approx(4 * 0.2 * 0.25, abs=0.02)  # within D: half of the density of the saddle has left
    both = vk.StationaryDensity.of(wells)
    for source in (0, "right-rest"):  # Boltzmann's law has no prefactor, and each side has half of p at the saddle
        assert float(both.barrier(source)[0]) == pytest.approx(4 * 0.2 * 0.25, abs=0.15 * 0.02)
    assert barrier - float(both.barrier(0)[0]) == pytest.approx(0.02 * math.log(2), abs=0.15 * 0.02)


@pytest.mark.slow
def test_all_shares_and_barriers_of_a_density_are_reconciled(wells):
    """Half of the time at each side, by rates and by the density; two runs of one method agree in all."""
    found = vk.reconcile(wells, wells)
    assert {verdict.code for verdict in found.verdicts} == {Agreement.AGREE}
    for kind in (Kind.OCCUPANCY, Kind.DENSITY_SHARE):
        shares = [q.value for q in found.quantities if q.kind is kind]
        np.testing.assert_allclose(shares, [0.5] * 4, rtol=0.01)
    barriers = [q for q in found.table("left-rest") if q.kind is Kind.BARRIER]
    assert len(barriers) == 2
    assert all(q.lower < 4 * 0.2 * 0.25 < q.upper for q in barriers)


@pytest.mark.slow
def test_picture_shows_the_saddle(wells):
    artists = vk.StationaryDensity.of(wells).plot()
    assert len(artists.saddles) == len(artists.others) == 1
    marked = np.concatenate([line.get_xdata() for line in (artists.attractor, *artists.others)])
    np.testing.assert_allclose(np.sort(marked), [-1.0, 1.0], atol=1e-6)
    assert len(vk.StationaryDensity.of(wells).plot(intensity=0.5, paths=[[[0.0, 0.0]]]).paths) == 1
    assert "x" in artists.ax.get_xlabel()


@pytest.mark.slow
def test_pictures_of_the_rates(wells):
    assert len(wells.plot_rates().points) == 2
    assert len(wells.plot_rates(source="left-rest").points) == 1
    artists = wells.plot_slopes(limits=wells.energies)
    assert artists.points == ()  # one intensity
    assert len(artists.limits) == len(artists.bounds) == len(wells.energies)
    with pytest.raises(vk.errors.StructureError):
        wells.plot_slopes(source="neither")


@pytest.mark.slow
def test_an_attractor_without_a_density_is_named_and_too_few_nodes_are_refused(wells):
    with pytest.raises(vk.errors.StructureError, match="right-rest"):
        vk.StationaryDensity.of(part_of(wells, 0))
    with pytest.raises(vk.errors.StructureError, match="needs a result of SGCM"):
        vk.StationaryDensity.of(3)
    for nodes in ((2, 2), (1, 9), 3.5, "many"):
        with pytest.raises(vk.errors.StructureError):
            vk.StationaryDensity.of(wells, nodes)

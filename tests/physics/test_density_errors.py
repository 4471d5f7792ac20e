"""Whether error estimates of densities contain the errors, against closed forms, certified energies and simulations."""

import math

import numpy as np
import pytest

import vibrokit as vk
from tests.klein_kramers import double_well_rate
from tests.layers import long
from tests.scenes import double_well
from vibrokit.analyzers.sgcm import cores
from vibrokit.results.codes import Code

pytestmark = pytest.mark.slow

HAMMERING = 0.119755  # certified by LeastAction: one-sided stop, hammering → clear


def one_sided(length, side):
    """A stop on one side, in units of length in which the gap is 0.4 times `length`; ζ = 0.03."""
    sign = 1.0 if side == "right" else -1.0
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.03,
        barriers=(vk.Barrier(vk.Hertz(40.0 / math.sqrt(length)), sign * 0.4 * length, side),),
        excitations=(vk.Harmonic(0.3 * length, 1.35, 0.0 if sign > 0 else math.pi),),
        noise=vk.WhiteNoise(1e-2 * length**2),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("length", "side", "depths"),
    [
        long(1.0, "right", (4, 8, 12, 16, 20)),
        long(1.0, "right", (6, 20)),
        (1e-3, "left", (6, 20)),
    ],
)
def test_the_limit_contains_the_certified_energy_if_the_target_is_not_metastable(length, side, depths):
    """The barrier of the clear state is 4.2e-4, far below D. So the core that counts as clear decides the rate."""
    osc, energy = one_sided(length, side), HAMMERING * length**2
    structure = vk.find_structure(osc, manifolds=False, cells=(100, 100), rng=0)
    found = vk.SGCM(source="hammering", intensities=tuple(energy / depth for depth in depths)).run(osc, structure)
    assert found.findings  # that the target is not metastable, or that the rates are uncertain
    for limit in found.energies:
        assert limit.lower <= energy <= limit.upper < 2 * energy


@pytest.mark.long
@pytest.mark.parametrize(("length", "side"), [(1.0, "right"), (1e-3, "left")])
def test_a_small_state_beside_a_wide_one_is_left_as_in_simulations(length, side):
    """The clear state, ΔU/D = 10 and 20: its basin has 1.4 % of the cells of the region."""
    osc, simulated = one_sided(length, side), {4.2e-5: (12.96, 0.05), 2.1e-5: (23.41, 0.06)}  # by MFET, in periods
    structure = vk.find_structure(osc, manifolds=False, cells=(100, 100), rng=0)
    found = vk.SGCM(source="clear", intensities=tuple(D * length**2 for D in simulated)).run(osc, structure)
    assert len(found.rates) == 2
    for rate, (time, error) in zip(found.rates, simulated.values(), strict=True):
        assert abs(-rate.log_value - math.log(osc.section_interval) - time) <= rate.log_error + 2 * error
        assert rate.log_error < 0.6


@pytest.mark.long
@pytest.mark.parametrize(("damping", "depth"), [(0.1, 20), (0.5, 30)])
def test_rates_are_exact_wherever_states_are_committed(damping, depth, monkeypatch):
    """Also nearer to the basin's edge, farther from it, and in the core only: the exact rate is in the stated error."""
    osc = double_well(damping_ratio=damping, noise=vk.WhiteNoise(damping))
    structure = vk.find_structure(osc, cells=(100, 100), manifolds=False, rng=0)
    intensity = damping / depth  # ΔU = 4ζ × 1/4
    exact = double_well_rate(damping, intensity)
    committed = []
    for deviations in (3.5, 5.0, 1e4):
        monkeypatch.setattr(cores, "_COMMITTED", deviations)
        found = vk.SGCM(source=0, intensities=(intensity,), nodes=(100, 100)).run(osc, structure)
        (rate,) = found.rates
        assert abs(rate.log_value - exact) <= rate.log_error
        assert rate.log_error < 0.15
        committed.append(np.sum(found.data["log_committor"].values == 0))
    assert committed[0] > committed[1] > committed[2]


@pytest.mark.long
@pytest.mark.parametrize(("length", "side"), [(1.0, "right"), (1e-3, "left")])
def test_motion_beyond_the_region_of_the_structure_comes_back(length, side):
    """Between the states the mass is faster than in the region of the structure: what left it there was lost.

    ln of the mean time in s by direct simulation: 10.758(20) from 2500 exits, and 7.796(50) from 400.
    """
    sign = 1.0 if side == "right" else -1.0
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.03,
        barriers=(vk.Barrier(vk.Hertz(100.0 / math.sqrt(length)), sign * 0.5 * length, side),),
        excitations=(vk.Harmonic(0.2 * length, 1.3, 0.0 if sign > 0 else math.pi),),
        noise=vk.WhiteNoise(1e-4 * length**2),
    )  # fmt: skip
    structure = vk.find_structure(osc, manifolds=False, cells=(100, 100), rng=0)
    intensities = (1.2709e-3 * length**2, 7.26228e-4 * length**2)
    found = vk.SGCM(source="clear", intensities=intensities).run(osc, structure)
    for rate, time, error in zip(found.rates, (7.796, 10.758), (0.05, 0.02), strict=True):
        assert abs(-rate.log_value - time) < 2 * math.hypot(error, rate.log_error)
        assert rate.log_error < 0.1
    assert not found.found(Code.DENSITY_AT_EDGE)


class Beyond(vk.LeaveRegion):
    """x beyond a place."""

    place: float = 3.0

    def bounds(self, osc):
        """A half-plane to the left of the place."""
        return np.array([[-np.inf, self.place], [-np.inf, np.inf]])


@pytest.mark.long
@pytest.mark.parametrize(
    ("capacity", "current"),
    [
        (1.25, 0.7),
        (0.5, 0.9),
        (1.25, 0.9),
    ],
)
def test_escape_of_a_tilted_washboard_is_that_of_kramers(capacity, current):
    """A current-biased Josephson junction, β φ″ + φ′ + sin φ = I: closed forms of ΔU and of Kramers' prefactor."""
    well = math.asin(current)
    barrier = (2 / capacity**2) * (2 * math.cos(well) - 2 * current * math.acos(current))
    stiffness, damping = math.cos(well) / capacity, 1 / capacity
    prefactor = (math.sqrt(damping**2 / 4 + stiffness) - damping / 2) / (2 * math.pi)
    intensities = tuple(barrier / depth for depth in (8, 11, 14))
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=damping / 2, spring=vk.CustomSpring("sin(x)/b", b=capacity),
        excitations=(vk.Constant(current / capacity),), noise=vk.WhiteNoise(intensities[0]),
    )  # fmt: skip
    exit_ = Beyond(place=math.pi - well + 1.2)
    region = ((-1.5, exit_.place + 1.5), (-3.0, 3.0))
    structure = vk.find_structure(osc, region=region, cells=(40, 40), manifolds=False, rng=0)
    source = min(structure.attractors, key=lambda each: abs(each.points[0, 0] - well)).label
    found = vk.SGCM(source=source, intensities=intensities, exit=exit_, nodes=(150, 150)).run(osc, structure)
    for rate in found.rates:
        formula_error = rate.intensity / barrier  # the next order of the formula
        expected = math.log(prefactor) - barrier / rate.intensity
        assert abs(rate.log_value - expected) <= rate.log_error + formula_error
        assert rate.log_error < 0.25
    (energy,) = found.energies
    assert energy.lower <= barrier <= energy.upper
    assert energy.value == pytest.approx(barrier, rel=0.01)


@pytest.mark.long
@pytest.mark.parametrize("damping", [0.2, 1.0])
def test_rates_of_states_that_do_not_last_are_those_of_simulations_all_the_same(damping):
    """Wells as deep as ΔU/D = 1 and 2, core to core: what counts as an exit decides the rate, and is no error of it."""
    osc = double_well(damping_ratio=damping, noise=vk.WhiteNoise(damping))
    structure = vk.find_structure(osc, cells=(100, 100), manifolds=False, rng=0)
    given = {"source": 0, "intensities": (damping, damping / 2)}
    simulated = vk.MFET(target_error=0.01, splitting=False, **given).run(osc, structure)
    found = vk.SGCM(nodes=(120, 120), **given).run(osc, structure)
    assert found.found(Code.NOT_METASTABLE)
    for rate, other in zip(found.rates, simulated.rates, strict=True):
        assert abs(rate.log_value - other.log_value) <= rate.log_error + 3 * other.log_error
        assert rate.log_error < 0.1


TUBE = vk.Oscillator(
    natural_frequency=250.7133, damping_ratio=0.008,
    barriers=tuple(
        vk.Barrier(vk.Linear(5.714286e6), place, side) for place, side in ((0.25e-3, "right"), (-0.25e-3, "left"))
    ),
    excitations=(vk.Harmonic(17.142857, 408.407),), noise=vk.WhiteNoise(2e-4),
)  # fmt: skip


@pytest.fixture(scope="module")
def tube():
    return vk.find_structure(TUBE, manifolds=False, cells=(100, 100), rng=0)


@pytest.mark.long
def test_thin_basins_between_stiff_stops_have_the_error_that_they_have(tube):
    """Simulated trajectories leave clear for good after 38.1(8) s and 7.8(6)e3 s; ΔU = 0.0021725 is certified."""
    found = vk.SGCM(source="clear", intensities=(4e-4, 2e-4), nodes=(290, 290)).run(TUBE, tube)
    for intensity, time, error in ((4e-4, 38.1, 0.8), (2e-4, 7.8e3, 0.6e3)):
        rates = [rate for rate in found.rates if rate.intensity == intensity]
        together = math.log(sum(rate.value for rate in rates))
        stated = max(rate.log_error for rate in rates)
        assert abs(together + math.log(time)) <= stated + 2 * error / time
    assert found.found(Code.RATE_UNCERTAIN)
    least = found.energy("clear", "hammering")
    assert least.lower <= 0.0021725 <= least.upper


@pytest.mark.long
def test_exits_that_are_not_resolved_cost_no_others(tube):
    """The first section in another basin: the rate to period 3, with 0.07 % of the cells, is not resolved."""
    analyzer = vk.SGCM(source="clear", exit=vk.LeaveBasin(for_good=False), intensities=(4e-4, 2e-4), nodes=(280, 280))
    found = analyzer.run(TUBE, tube)
    least = found.energy("clear", "hammering")
    assert least.lower <= 0.0021725 <= least.upper
    assert {finding.code for finding in found.findings} >= {Code.RATE_UNKNOWN, Code.ENERGY_NEEDS_RATES}

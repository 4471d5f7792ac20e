"""A mass without a spring: free motion in closed form, rest that no force determines, and the rattle of gears."""

import math

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.analyzers.sgcm.density_grid import DensityGrid
from vibrokit.errors import ParameterError, StructureError
from vibrokit.results.codes import Code
from vibrokit.results.region import Region

C = 0.6  # damping (s⁻¹)


def mass(*excitations, **more):
    return vk.Oscillator(**{"natural_frequency": 0, "damping": C} | more, excitations=excitations)


def stops(stiffness, gap=0.6):
    return [vk.Barrier(vk.Linear(stiffness), side * gap, name) for side, name in ((1, "right"), (-1, "left"))]


def coasting(t, v, c=C):
    """State at a time after a start at x = 0 with a velocity, under damping alone."""
    return -v / c * math.expm1(-c * t), v * math.exp(-c * t)


class TestFreeMotion:
    @pytest.mark.parametrize("stepper", [None, vk.Order8(1e-12), vk.FreeFlight(), vk.RK8(256)], ids=str)
    def test_terminal_velocity(self, stepper):
        """x″ + c x′ = f from rest: v = f/c (1 − exp(−ct)), x = f t/c − v/c."""
        path = mass(vk.Constant(force=3.0)).trajectory((0.0, 0.0), duration=40.0, samples=16, stepper=stepper)
        v = -3.0 / C * np.expm1(-C * path.t)
        assert path.v == pytest.approx(v, abs=1e-8)
        assert path.x == pytest.approx((3.0 * path.t - v) / C, rel=1e-8, abs=1e-8)
        assert path.v[-1] == pytest.approx(5.0, abs=1e-8)

    @pytest.mark.parametrize("numbers", [{"stiffness": 0}, {"natural_frequency": 0}], ids=str)
    def test_coasting(self, numbers):
        osc = vk.Oscillator(**numbers, damping=C)
        assert osc.trajectory((0.0, 2.0), duration=5.0).states[-1] == pytest.approx(coasting(5.0, 2.0), abs=1e-9)

    def test_without_damping(self):
        osc = vk.Oscillator(natural_frequency=0, damping_ratio=0)
        assert osc.trajectory((1.0, 2.0), duration=5.0).states[-1] == pytest.approx((11.0, 2.0), abs=1e-9)

    @pytest.mark.parametrize("stepper", [vk.Order8(1e-12), vk.FreeFlight()], ids=str)
    def test_forced_drift(self, stepper):
        """x″ + c x′ = F cos Ωt: x = x_0 + Re F e^{iΩt}/(−Ω² + icΩ), and what coasts; the mass goes on about x_0."""
        force, rate, t = 2.0, 3.0, 12.5
        wave = force / (-(rate**2) + 1j * C * rate)
        coast = coasting(t, -(1j * rate * wave).real)
        x = (wave * np.exp(1j * rate * t)).real - wave.real + coast[0]
        v = (1j * rate * wave * np.exp(1j * rate * t)).real + coast[1]
        end = mass(vk.Harmonic(force, rate)).trajectory((0.0, 0.0), duration=t, stepper=stepper).states[-1]
        assert end == pytest.approx((x, v), abs=1e-8)

    def test_flight_under_a_force_with_a_mean(self):
        """(1 + cos Ωt)·f has the mean f; both parts add up."""

        class Raised(vk.Excitation):
            strength: float = vk.parameter("f", "m s^-2")
            rate: float = vk.parameter("Omega", "s^-1", above=0)

            def force(self, t):
                from sympy import cos

                return self.strength * (1 + cos(self.rate * t))

            @property
            def period(self):
                return 2 * math.pi / self.rate

        def end(*excitations):
            return mass(*excitations).trajectory((0.0, 0.0), duration=7.0, stepper=vk.FreeFlight()).states[-1]

        assert end(Raised(2.0, 3.0)) == pytest.approx(end(vk.Constant(2.0), vk.Harmonic(2.0, 3.0)), abs=1e-9)

    def test_diffusion(self):
        """⟨v²⟩ = D(1 − e²)/2c and ⟨x²⟩ = D/c² (t − 2(1 − e)/c + (1 − e²)/2c) with e = exp(−ct)."""
        count, intensity = 20_000, 0.5
        osc = mass(noise=vk.WhiteNoise(intensity))
        ends = osc.section_map(np.zeros((count, 2)), rng=1)
        t, e = osc.section_interval, math.exp(-C * osc.section_interval)
        x2 = intensity / C**2 * (t - 2 * (1 - e) / C + (1 - e * e) / (2 * C))
        v2 = intensity * (1 - e * e) / (2 * C)
        four = 4 * math.sqrt(2 / count)  # standard errors of a variance
        assert ends.var(axis=0) == pytest.approx((x2, v2), rel=four)
        assert np.abs(ends.mean(axis=0)) == pytest.approx((0, 0), abs=4 * math.sqrt(x2 / count))


class TestRest:
    """Where nothing touches a mass without a spring, it rests anywhere: that is no attractor."""

    @pytest.mark.parametrize(
        "osc",
        [
            mass(),
            mass(vk.Harmonic(1.0, 2.0)),
            mass(vk.Constant(1.0), noise=vk.WhiteNoise(1e-3)),
            vk.Oscillator(stiffness=0, damping=C),
            vk.Oscillator(spring=vk.CustomSpring("a*v*abs(v)", a=0.1), damping=C),
        ],
        ids=["free", "forced", "driven", "stiffness 0", "drag"],
    )
    def test_a_mass_that_nothing_holds(self, osc):
        with pytest.raises(
            StructureError, match=r"^no force of the scene depends on x, so that nothing holds .*stops\.$"
        ):
            vk.find_structure(osc)

    def test_a_frequency_of_0_cannot_be_followed(self):
        with pytest.raises(
            ParameterError, match=r"natural_frequency shapes the equations, so motion cannot be followed"
        ):
            vk.continuation(mass(barriers=stops(200.0)), "natural_frequency", [0.1, 0.2])

    @pytest.mark.slow
    def test_a_spring_that_grows_from_nothing(self):
        """κ x + k (x − b) = f in contact: x = (f + kb)/(κ + k), from κ = 0 on."""
        pressed = mass(vk.Constant(2.0), natural_frequency=None, stiffness=0, barriers=stops(200.0))
        traced = vk.continuation(pressed, "stiffness", [0.0, 0.5, 1.0], region=((-0.8, 0.8), (-4, 4)))
        for kappa, one in zip([0.0, 0.5, 1.0], traced.states, strict=True):
            assert one.attractors[0].points[0, 0] == pytest.approx((2.0 + 200.0 * 0.6) / (kappa + 200.0), rel=1e-9)

    @pytest.mark.parametrize("excitations", [(), (vk.Harmonic(0.5, 2 * math.pi),)], ids=["rest", "shaken"])
    def test_a_mass_in_a_gap(self, excitations):
        """All starts come to rest, or to an oscillation of 0.5/(Ω√(Ω² + c²)) = 0.013 m, clear of the stops."""
        osc = mass(*excitations, barriers=stops(200.0))
        with pytest.raises(StructureError, match=r"36 settle at places that no force determines, on motions that"):
            vk.find_structure(osc, starts=(6, 6), region=((-0.5, 0.5), (-0.03, 0.03)))

    def test_a_mass_that_is_pressed_to_a_stop(self):
        """k (x − 0.6) = f: it rests at 0.6 + 2/200."""
        found = vk.find_structure(mass(vk.Constant(2.0), barriers=stops(200.0)), starts=(6, 6), cells=(20, 20))
        assert [one.points[0].tolist() for one in found.attractors] == [pytest.approx([0.61, 0.0], abs=1e-9)]
        assert found.attractors[0].basin_fraction == 1.0
        assert Code.STARTS_NEUTRAL not in [finding.code for finding in found.findings]


@pytest.mark.slow
def test_a_motion_beside_a_family():
    """A mass that is shaken by 12 cos 2πt hammers on both stops, or oscillates by 0.30 m about any place between."""
    shaken = mass(vk.Harmonic(12.0, 2 * math.pi), barriers=stops(200.0))
    found = vk.find_structure(shaken, starts=(12, 12), cells=(40, 40), region=((-1.2, 1.2), (-5, 5)), saddles=False)
    assert [(one.name, one.hits) for one in found.attractors] == [("hammering", {"left": 1, "right": 1})]
    told = {finding.code: finding.values for finding in found.findings}
    assert 0 < told[Code.STARTS_NEUTRAL]["count"] < told[Code.STARTS_NEUTRAL]["starts"] == 144
    assert 0 < told[Code.CELLS_UNSETTLED]["fraction"] < 1 - found.attractors[0].basin_fraction + 1e-12


PRESSED = mass(vk.Constant(-1.0), barriers=stops(200.0), noise=vk.WhiteNoise(0.2))


@pytest.mark.slow
def test_energy_of_leaving_a_stop():
    """2c times the work from rest, at the depth f/k, to the other stop: 2c (1.2 f + f²/2k)."""
    exact, known = 2 * C * (1.2 + 1 / 400), vk.find_structure(PRESSED, cells=(40, 40))
    energy = vk.LeastAction(exit=vk.FirstContact("right")).run(PRESSED, known).energies[0]
    assert energy.value == pytest.approx(exact, rel=1e-9)


def test_nodes_of_a_density_where_most_of_the_mass_is_free():
    """The stops are stiffer than free motion, so that nodes are closer there; in the gap they are equally spaced."""
    grid = DensityGrid.of(mass(barriers=stops(200.0)), Region((-0.9, 0.9), (-4, 4)), (181, 40))
    widths = np.diff(grid.x)
    middle = widths[np.abs(0.5 * (grid.x[:-1] + grid.x[1:])) < 0.4]
    assert np.isfinite(widths).all()
    assert np.ptp(middle) < 1e-3 * middle.mean()
    assert widths[0] < 0.5 * middle.mean()


def gears():
    """x″ + 0.6x′ + 200 B(x) = 4π·0.6 − 4π²·0.1 cos 2πt − 2π·0.1·0.6 sin 2πt with the dead zone B of ±0.6."""
    turn = 2 * math.pi
    forces = (
        vk.Constant(2 * turn * C),
        vk.Harmonic(-(turn**2) * 0.1, turn),
        vk.Harmonic(-turn * 0.1 * C, turn, -0.5 * math.pi),
    )
    return mass(*forces, barriers=stops(200.0))


@pytest.mark.slow
def test_gear_rattle():
    """Four states of published shares of [−0.6, 0.6] × [−4, 4]."""
    found = vk.find_structure(gears(), region=((-0.6, 0.6), (-4.0, 4.0)), saddles=False)
    shares = sorted((one.basin_fraction for one in found.attractors), reverse=True)
    assert shares == pytest.approx([0.679, 0.154, 0.103, 0.063], abs=0.01)

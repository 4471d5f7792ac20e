"""The size of the motions of a scene follows from the formulas of its excitations."""

import math

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import scene
from vibrokit.kernels.choice import single_stepper
from vibrokit.parts.functions import cos, sin
from vibrokit.structure.attractors.describe import describe_orbit
from vibrokit.structure.autonomous import refine_equilibrium
from vibrokit.structure.regions import frame_of, search_region
from vibrokit.structure.scales import length_of
from vibrokit.symbolic.flow_kind import Flow


class TwoTones(vk.Excitation):
    """Two tones that are never at their largest together."""

    strength: float = vk.parameter("s", "m s^-2")
    rate: float = vk.parameter("r", "s^-1", above=0)

    def force(self, t):
        return self.strength * (cos(self.rate * t + 1) + cos(2 * self.rate * t))

    @property
    def period(self):
        return 2 * math.pi / self.rate


class Incommensurate(vk.Excitation):
    """Two tones without a common period."""

    strength: float = vk.parameter("s", "m s^-2")

    def force(self, t):
        return self.strength * (sin(t) + sin(math.sqrt(2) * t))

    @property
    def period(self):
        return math.inf


STOPS = (vk.Barrier(vk.Hertz(50.0), 0.5, "right"), vk.Barrier(vk.Hertz(50.0), -0.5, "left"))
FORCES = vk.Harmonic(-0.7, 0.57), vk.Constant(-0.4)
TIMES = np.linspace(0.0, 2 * math.pi, 2_000_001)
BOTH = np.abs(np.cos(TIMES + 1) + np.cos(2 * TIMES)).max()  # of `TwoTones`


def pushed(*excitations, stops=(), frequency=1.0, damping=0.1):
    return scene(*stops, natural_frequency=frequency, damping_ratio=damping, excitations=excitations)


def response(damping, frequency):
    """The linear response to 0.1 cos ωt."""
    return 0.1 / math.hypot(1 - frequency**2, 2 * damping * frequency)


def self_excited(formula, *, unit=1.0, **parameters):
    """An oscillator without other damping; lengths are in some unit (m)."""
    spring = vk.CustomSpring(f"4*x + {formula}", u=unit, **parameters)
    return scene(natural_frequency=2.0, damping_ratio=0.0, spring=spring)


def rests_at(wells, frequency):
    """x″ + 2ζω x′ − ω² x + ω² x³/w² = 0 rests at ± w."""
    spring = vk.CubicSpring(linear=-(frequency**2), cubic=(frequency / wells) ** 2)
    return scene(natural_frequency=frequency, damping_ratio=0.1, spring=spring)


BISTABLE = "c*(1 - 5*(x/u)**2 + 2*(x/u)**4)*v"  # 1 − 5A²/4 + A⁴/4 = 0 at A = 1 and 2
VAN_DER_POL = "c*((x/u)**2 - 1)*v"
WELLS = [(1.0, 1.0), (1e-4, 1.0), (1e-4, 2e3), (1e5, 1e-3)]  # in any unit
RESONANCES = [(1e-3, 1.0), (0.02, 1.05), (0.02, 0.9)]


@pytest.mark.parametrize(
    ("osc", "length", "error"),
    [
        (pushed(), 1.0, 0.0),  # a linear spring has no length of its own
        (scene(natural_frequency=30.0), 1.0, 0.0),
        # harmonic and constant forces count by amplitude and force, any other by its largest value
        (pushed(*FORCES, frequency=2.0), (5 * 0.7 + 0.4) / 4, 0.0),
        (pushed(*FORCES, stops=STOPS[:1]), 5 * 0.7 + 0.4, 0.0),
        (pushed(*FORCES, stops=STOPS), 0.7 + 0.4, 0.0),
        (pushed(vk.Harmonic(0.1, 0.57), stops=STOPS), 1.0, 0.0),
        (pushed(vk.Harmonic(0.3, 0.57, phase=1.0)), 1.5, 1e-15),
        *((pushed(TwoTones(0.7 * scale, 3.0)), 3.5 * BOTH * scale, 1e-11) for scale in (1.0, 1e-3, 1e6)),
        (pushed(TwoTones(0.7 * 300.0**2, 900.0), frequency=300.0), 3.5 * BOTH, 1e-11),
        (pushed(Incommensurate(0.7), stops=STOPS[:1]), 5 * 1.395, 4e-3),  # it never repeats
        # resonances; amplitudes are tried 2.7 % apart
        *((pushed(vk.Harmonic(0.1, w), damping=z), response(z, w), 0.04) for z, w in RESONANCES),
        *((rests_at(*given), given[0], 1e-8) for given in WELLS),
        *((self_excited(BISTABLE, unit=unit, c=0.1), 2 * unit, 1e-6) for unit in (1.0, 1e-6, 1e3)),
        *((self_excited(VAN_DER_POL, unit=unit, c=0.1), 2 * unit, 1e-6) for unit in (1.0, 1e-6, 1e3)),
        (self_excited("c*(1 + (x/u)**2)*v", c=0.1), 1.0, 0.0),  # damping of one sign
        (self_excited("c*v + 0*u", c=0.1), 1.0, 0.0),
    ],
)
def test_the_length_of_a_scene(osc, length, error):
    assert length_of(osc) == pytest.approx(length, rel=error, abs=0.0)


def test_the_large_motion_of_a_bistable_resonance_is_found():
    """At 1.2, far above the linear resonance, the hardening spring has a second motion of amplitude near 1.45."""
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.02, spring=vk.CubicSpring(1.0, 0.3), excitations=(vk.Harmonic(0.1, 1.2),)
    )
    found = vk.find_structure(osc, cells=(20, 20), saddles=False)
    swings = sorted(np.ptp(attractor.orbit[:, 0]) / 2 for attractor in found.attractors)
    squares = np.array(swings) ** 2
    missing = np.sqrt((1 - 1.2**2 + 0.75 * 0.3 * squares) ** 2 + (2 * 0.02 * 1.2) ** 2) * swings
    assert len(swings) == 2
    assert missing == pytest.approx([0.1, 0.1], rel=0.1)  # harmonic balance, without the third harmonic


@pytest.mark.parametrize(("wells", "frequency"), WELLS)
def test_the_wells_of_a_spring_are_found_in_any_unit(wells, frequency):
    structure = vk.find_structure(rests_at(wells, frequency), cells=(30, 30), manifolds=False)
    assert sorted(float(a.points[0, 0]) for a in structure.attractors) == pytest.approx([-wells, wells], rel=1e-9)
    assert len(structure.saddles) == 1
    assert structure.basins.fraction(0) == pytest.approx(0.5, abs=0.05)


# --- regions end in a stop where the mass does


@pytest.mark.parametrize("stiffness", [1e4, 1e8, 1e12])
def test_a_region_ends_at_the_depth_that_its_speed_reaches(stiffness):
    """A mass of speed v enters a Hertz stop to δ with (2/5) k δ^(5/2) = v²/2, and a linear one to δ = v/√k."""
    stops = (vk.Barrier(vk.Hertz(stiffness), 0.5, "right"), vk.Barrier(vk.Linear(stiffness), -0.5, "left"))
    region = search_region(pushed(TwoTones(0.1, 0.5), stops=stops))
    speed = max(region.v)
    assert region.x[1] - 0.5 == pytest.approx(1.5 * (1.25 * speed**2 / stiffness) ** 0.4, rel=0.06)
    assert -0.5 - region.x[0] == pytest.approx(1.5 * speed / math.sqrt(stiffness), rel=0.06)


def test_a_soft_stop_does_not_narrow_a_region():
    free, soft = (pushed(vk.Harmonic(0.1, 0.5), stops=stops) for stops in ((), STOPS))
    assert max(search_region(soft).x) >= 0.8 * length_of(soft)
    assert max(search_region(free).x) == length_of(free)


@pytest.mark.slow
def test_a_region_contains_every_attractor():
    """A mass that is pressed into a stop rests deeper than slow motions reach."""
    osc = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.1, excitations=(vk.Constant(2.0),),
        barriers=(vk.Barrier(vk.Linear(100.0), 0.0, "right"),),
    )  # fmt: skip
    structure = vk.find_structure(osc, cells=(10, 10), saddles=False)
    (rest,) = structure.attractors
    assert rest.points[0, 0] == pytest.approx(2.0 / 101.0)
    assert frame_of(osc, structure.attractors).contains(rest.points).all()


def frame_of_wells(force, *rests):
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.2, spring=vk.CustomSpring(force))
    stepper = single_stepper(osc, Flow.STATE_VARIATIONAL)
    points = [refine_equilibrium(osc, np.array([x, 0.0])) for x in rests]
    return frame_of(osc, [describe_orbit(osc, point, stepper) for point in points])


def test_wells_that_are_one_shifted_along_x_are_framed_once():
    # A pendulum hangs at each 2π; the frame has a quarter of its width on each side of one turn.
    pendulum = frame_of_wells("sin(x)", -4 * math.pi, 2 * math.pi, 0.0)
    np.testing.assert_allclose(pendulum.x, [-1.5 * math.pi, 1.5 * math.pi], rtol=1e-9)
    # Neighbours at 1 and 3 are alike, but the force is not the same around them.
    low, high = frame_of_wells("(x - 1)*(x - 2)*(x - 3)", 1.0, 3.0).x
    assert low < 1 < 3 < high

"""Scenes: paths of parameters, changes, common periods, the time from section to section."""

import math
import pickle

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.errors import NoSectionError, ParameterError, SceneError


def scene(*excitations, **more):
    return vk.Oscillator(**{"natural_frequency": 2.0, "damping_ratio": 0.01} | more, excitations=excitations)


def harmonic(frequency, amplitude=0.1):
    return vk.Harmonic(amplitude, frequency)


@pytest.fixture
def full():
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.01,
        spring=vk.CustomSpring("a*x + b*x**3", a=1.0, b=0.1),
        barriers=(
            vk.Barrier(vk.Hertz(50.0), 0.5, "right"),
            vk.Barrier(vk.CustomLaw("k*depth", k=40.0), -0.5, "left"),
        ),
        excitations=(vk.Harmonic(0.18, 0.57), vk.Constant(0.2)),
        noise=vk.StateDependentNoise(2e-5, "1 + c*x", c=0.3),
    )


class TestParameters:
    def test_paths(self, full):
        assert full.parameters == {
            "natural_frequency": 1.0,
            "damping_ratio": 0.01,
            "spring.formula": "a*x + b*x**3",
            "spring.a": 1.0,
            "spring.b": 0.1,
            "barriers.0.position": 0.5,
            "barriers.0.law.stiffness": 50.0,
            "barriers.1.position": -0.5,
            "barriers.1.law.formula": "k*depth",
            "barriers.1.law.k": 40.0,
            "excitations.0.amplitude": 0.18,
            "excitations.0.frequency": 0.57,
            "excitations.0.phase": 0.0,
            "excitations.1.force": 0.2,
            "noise.intensity": 2e-5,
            "noise.amplitude": "1 + c*x",
            "noise.c": 0.3,
        }

    def test_every_path_can_be_replaced(self, full):
        for path, value in full.parameters.items():
            new = f"1.5*({value})" if isinstance(value, str) else value + 0.0625
            changed = full.replace({path: new})
            assert changed.parameters == full.parameters | {path: new}
            assert type(changed) is vk.Oscillator
            assert changed != full
        assert full.replace({}) == full

    def test_several_at_once_are_checked_together(self, full):
        moved = full.replace({"barriers.0.position": -1.0, "barriers.1.position": -2.0})
        assert [barrier.position for barrier in moved.barriers] == [-1.0, -2.0]
        with pytest.raises(SceneError, match=r"the left stop, at -0\.5, is to the right of the right stop, at -1"):
            full.replace({"barriers.0.position": -1.0})

    def test_fields_by_keyword(self, full):
        noise = vk.WhiteNoise(intensity=1e-4)
        changed = full.replace(damping_ratio=0.02, noise=noise, excitations=[harmonic(0.6)])
        assert (changed.damping_ratio, changed.noise, changed.excitations) == (0.02, noise, (harmonic(0.6),))
        assert (changed.barriers, changed.spring) == (full.barriers, full.spring)
        assert full.replace({"noise": noise}) == full.replace(noise=noise)
        assert full.replace(noise=None).noise is None
        assert full.replace() == full

    def test_paths_and_keywords_together(self, full):
        changed = full.replace({"noise.intensity": 1e-4, "barriers.0.law.stiffness": 60.0}, damping_ratio=0.02)
        assert changed.parameters == full.parameters | {
            "noise.intensity": 1e-4, "barriers.0.law.stiffness": 60.0, "damping_ratio": 0.02,
        }  # fmt: skip

    def test_a_path_leads_into_a_part_that_is_given_with_it(self, full):
        changed = full.replace({"noise.intensity": 1e-4}, noise=vk.WhiteNoise(1.0))
        assert changed.noise == vk.WhiteNoise(1e-4)

    def test_short_paths(self, full):
        assert full.replace({"frequency": 0.6}) == full.replace({"excitations.0.frequency": 0.6})
        assert full.replace(frequency=0.6).natural_frequency == full.natural_frequency
        assert full.replace({"1.position": -0.6}) == full.replace({"barriers.1.position": -0.6})
        assert full.replace({"law.stiffness": 60.0, "c": 0.4}).parameters["noise.c"] == 0.4
        assert full.entry("frequency").path == "excitations.0.frequency"
        assert full.entry("natural_frequency").value == 1.0

    def test_a_full_path_is_never_short_for_another(self):
        osc = scene(harmonic(2.0), spring=vk.CustomSpring("damping_ratio*x", damping_ratio=3.0))
        assert osc.entry("damping_ratio").value == 0.01
        assert osc.replace({"spring.damping_ratio": 4.0}).damping_ratio == 0.01

    def test_ambiguous_paths_are_refused_with_all_that_match(self, full):
        with pytest.raises(ParameterError) as refused:
            full.replace(position=0.25)
        assert "'position' matches 2 parameters, barriers.0.position, barriers.1.position;" in str(refused.value)
        many = scene(*(harmonic(float(k)) for k in range(1, 40)))
        with pytest.raises(ParameterError) as refused:
            many.entry("amplitude")
        assert all(f"excitations.{k}.amplitude" in str(refused.value) for k in range(39))

    @pytest.mark.parametrize(
        ("changes", "more", "path"),
        [
            ({"frequency": 0.6, "excitations.0.frequency": 0.7}, {}, "excitations.0.frequency"),
            ({"noise.intensity": 1e-4}, {"intensity": 1e-4}, "noise.intensity"),
            ({"damping_ratio": 0.1}, {"damping_ratio": 0.2}, "damping_ratio"),
        ],
    )
    def test_one_parameter_given_twice(self, full, changes, more, path):
        with pytest.raises(ParameterError, match=f"{path} is given 2 times"):
            full.replace(changes, **more)

    @pytest.mark.parametrize(
        ("path", "value"),
        [
            ("excitations.0.freqency", "the nearest is 'excitations.0.frequency'"),
            ("freqency", "the nearest is 'excitations.0.frequency'"),
            ("stifness", "the nearest is 'barriers.0.law.stiffness'"),
            ("barriers.7.position", "the nearest is 'barriers.1.position'"),
            ("atural_frequency", "the nearest is 'natural_frequency'"),
            ("equency", "the nearest is 'excitations.0.frequency'"),
            ("barriers.0.side", "'barriers.0.side'"),
            ("side", "'side'"),
            ("", "natural_frequency, "),
            (".", "natural_frequency, "),
            (3, "natural_frequency, "),
            ("x" * 10000, "natural_frequency, "),
        ],
    )
    def test_unknown_paths(self, full, path, value):
        with pytest.raises(ParameterError) as refused:
            full.replace({path: 1.0})
        message = str(refused.value)
        assert value in message
        assert message.endswith(".")
        assert len(message) < 600

    @pytest.mark.parametrize("field", ["barriers", "excitations", "noise", "spring", "friction"])
    def test_fields_are_checked(self, full, field):
        with pytest.raises(SceneError, match=f"scene: {field} "):
            full.replace(**{field: 1.0})

    def test_replaced_values_are_checked(self, full):
        with pytest.raises(ParameterError, match="Hertz: stiffness must be a finite number at least 0, got -1"):
            full.replace({"barriers.0.law.stiffness": -1.0})

    def test_values(self, full):
        assert pickle.loads(pickle.dumps(full)) == full
        assert hash(full) == hash(full.replace({}))
        _ = full.model  # looked at: what it derived does not travel
        assert pickle.loads(pickle.dumps(full)) == full
        assert len(pickle.dumps(full)) < 3000

    def test_sequences_become_tuples(self):
        osc = vk.Oscillator(
            natural_frequency=1.0, damping_ratio=0.1, barriers=[vk.Barrier(vk.Hertz(1.0), 0.5, "right")],
            excitations=(e for e in [harmonic(1.0)]),
        )  # fmt: skip
        assert isinstance(osc.barriers, tuple)
        assert isinstance(osc.excitations, tuple)
        assert hash(osc) == hash(osc.replace({}))


class TestPeriods:
    @pytest.mark.parametrize(
        ("frequencies", "base"),
        [
            ((0.57,), 0.57),
            ((0.57, 0.57), 0.57),
            ((1.0, 2.0), 1.0),
            ((2.0, 3.0), 1.0),
            ((1.0, 1.5, 2.5), 0.5),
            ((0.3, 0.7), 0.1),
            ((1.0, 1.001), 0.001),
            ((0.1, 0.3, 0.7), 0.1),
            ((1 / 3, 1 / 7), 1 / 21),
        ],
    )
    def test_common_period(self, frequencies, base):
        osc = scene(*map(harmonic, frequencies))
        period = osc.period
        for frequency in frequencies:
            cycles = period * frequency / (2 * math.pi)
            assert cycles == pytest.approx(round(cycles), abs=1e-9)
            assert round(cycles) >= 1
        assert period == pytest.approx(2 * math.pi / base, rel=1e-12)
        assert osc.section_interval == period
        assert not osc.autonomous

    def test_the_common_period_is_the_least_in_any_order(self):
        assert scene(harmonic(2.0), harmonic(3.0)).period == pytest.approx(2 * math.pi, rel=1e-14)
        assert scene(harmonic(4.0), harmonic(6.0)).period == pytest.approx(math.pi, rel=1e-14)
        assert scene(harmonic(2.0), harmonic(3.0)).period == scene(harmonic(3.0), harmonic(2.0)).period
        assert scene(harmonic(0.57), vk.Constant(0.2)).period == 2 * math.pi / 0.57

    @pytest.mark.parametrize("excitations", [(), (vk.Constant(0.2),)], ids=["nothing", "constant"])
    def test_autonomous(self, excitations):
        osc = scene(*excitations)
        assert osc.autonomous
        assert osc.period is None
        assert osc.section_interval == math.pi  # 2π/ω_n
        assert osc.time_unit == math.pi


INCOMMENSURATE = {"√2": (1.0, math.sqrt(2)), "nearly 1": (1.0, 1.0000001), "1009/1013": (1.009, 1.013)}


@pytest.mark.parametrize("frequencies", INCOMMENSURATE.values(), ids=INCOMMENSURATE)
class TestWithoutSection:
    def test_it_is_a_scene(self, frequencies):
        osc = scene(*map(harmonic, frequencies))
        assert not osc.autonomous
        assert osc.replace({"damping_ratio": 0.5}).damping_ratio == 0.5
        assert osc.time_unit == math.pi

    def test_the_section_is_refused(self, frequencies):
        osc = scene(*map(harmonic, frequencies))
        for ask in (lambda: osc.period, lambda: osc.section_interval):
            with pytest.raises(NoSectionError, match=r"^scene: excitations of periods .* no common period.*1000\.$"):
                ask()


class Pulse(vk.Excitation):
    """A push that never comes again."""

    height: float = vk.parameter("P", "m s^-2")

    def force(self, t):
        return self.height / (1 + t**2)

    @property
    def period(self):
        return math.inf


def test_an_excitation_that_never_repeats():
    osc = scene(Pulse(0.3), harmonic(1.0))
    assert not osc.autonomous
    with pytest.raises(NoSectionError, match=r"^scene: an excitation never repeats, so there is no section; .*\.$"):
        _ = osc.section_interval
    with pytest.raises(NoSectionError, match="never repeats"):
        osc.section_map([[0.0, 0.0]], stepper=vk.RK4())
    path = scene(Pulse(0.3)).trajectory((0.0, 0.0), duration=6.0, stepper=vk.RK4(steps=64))
    exact = scene(Pulse(0.3)).trajectory((0.0, 0.0), duration=6.0, stepper=vk.RK4(steps=512))
    assert path.x[-1] == pytest.approx(exact.x[-1], rel=1e-6)
    assert 0.01 < abs(path.x).max() < 0.3


@pytest.mark.parametrize("period", [0, 0.0, -1.0, math.nan, "1", True, [1.0]])
def test_a_period_is_a_positive_number(period):
    class Strange(vk.Excitation):
        def force(self, t):
            return 0

        @property
        def period(self):
            return period

    with pytest.raises(
        SceneError, match=r"^scene: the period of excitations\.0 \(Strange\) must be a positive .*, got "
    ):
        scene(Strange())


def test_intervals_in_a_period():
    forced = scene(harmonic(1.0), vk.Constant(force=0.2))
    period = 2 * math.pi
    assert forced.intervals_in_period(period) == forced.intervals_in_period(5 * period) == 1
    assert forced.intervals_in_period(period / 2) == 2
    assert forced.intervals_in_period(period / 48) == 48
    assert forced.intervals_in_period(1.05 * period) == forced.intervals_in_period(0.4 * period) == 0
    assert forced.intervals_in_period(period / 1e6) == 0
    assert scene().intervals_in_period(0.123) == 1
    assert scene(harmonic(1.0), harmonic(math.sqrt(2))).intervals_in_period(period) == 0


def test_a_multi_harmonic_orbit_has_the_common_period():
    """Two harmonics whose common period is twice the longest: states repeat after that and not before."""
    osc = scene(harmonic(2.0), harmonic(3.0), damping_ratio=0.5)
    settled = osc.section_map([[0.0, 0.0]], periods=20, stepper=vk.RK4())
    assert np.abs(osc.section_map(settled, stepper=vk.RK4()) - settled).max() < 1e-8
    half = osc.trajectory(settled[0], duration=math.pi, stepper=vk.RK4())
    assert abs(half.states[-1] - settled[0]).max() > 1e-3


OWN = {
    "frequency and ratio": {"natural_frequency": 2.0, "damping_ratio": 0.1},
    "stiffness and ratio": {"stiffness": 4.0, "damping_ratio": 0.1},
    "frequency and damping": {"natural_frequency": 2.0, "damping": 0.4},
    "stiffness and damping": {"stiffness": 4.0, "damping": 0.4},
}


class TestOwnNumbers:
    @pytest.mark.parametrize("given", OWN.values(), ids=OWN)
    def test_what_is_given_is_kept(self, given, tmp_path):
        osc = vk.Oscillator(**given)
        assert osc.parameters == given
        assert (osc.own_frequency, osc.linear_damping, osc.reference_frequency) == (2.0, 0.4, 2.0)
        vk.save_scene(osc, tmp_path / "scene.toml")
        assert (tmp_path / "scene.toml").read_text() == "".join(f"{name} = {value}\n" for name, value in given.items())
        assert vk.load_scene(tmp_path / "scene.toml") == osc
        assert pickle.loads(pickle.dumps(osc)) == osc

    @pytest.mark.parametrize("given", OWN.values(), ids=OWN)
    def test_all_are_the_same_motion(self, given):
        """x″ + 0.4 x′ + 4 x = 0 from x = 1: exp(−0.2 t) (cos ω t + 0.2/ω sin ω t), ω² = 4 − 0.04."""
        rate = math.sqrt(3.96)
        x = math.exp(-0.2) * (math.cos(rate) + 0.2 / rate * math.sin(rate))
        assert vk.Oscillator(**given).trajectory((1.0, 0.0), duration=1.0).x[-1] == pytest.approx(x, rel=1e-12)

    def test_the_other_of_a_pair_is_switched(self):
        osc = scene()
        assert osc.replace(stiffness=9.0).parameters == {"stiffness": 9.0, "damping_ratio": 0.01}
        assert osc.replace({"damping": 0.3}).parameters == {"natural_frequency": 2.0, "damping": 0.3}
        assert osc.replace(damping=0.3, natural_frequency=0).parameters == {"natural_frequency": 0.0, "damping": 0.3}
        assert osc.replace(stiffness=9.0).replace(natural_frequency=2.0) == osc
        assert osc.replace(damping=0.3).replace(damping_ratio=0.01) == osc

    def test_a_spring_needs_no_frequency(self):
        osc = vk.Oscillator(spring=vk.CubicSpring(linear=9.0, cubic=1.0), damping=0.3)
        assert osc.parameters == {"damping": 0.3, "spring.linear": 9.0, "spring.cubic": 1.0}
        assert osc.own_frequency == 0.0
        assert vk.Oscillator(spring=osc.spring, damping_ratio=0).linear_damping == 0.0

    @pytest.mark.parametrize(
        ("parts", "frequency"),
        [
            ({"spring": vk.CubicSpring(linear=-9.0, cubic=1.0), "excitations": [harmonic(5.0)]}, 3.0),
            ({"spring": vk.CustomSpring("a*sin(2*x)", a=8.0)}, 4.0),
            ({"spring": vk.CustomSpring("1/x")}, 0.25),
            ({"spring": vk.CubicSpring(linear=0.0, cubic=1.0)}, 0.25),
            ({"natural_frequency": 0, "excitations": [harmonic(2.0), harmonic(5.0), vk.Constant(1.0)]}, 5.0),
            ({"natural_frequency": 0, "excitations": [vk.Constant(1.0)]}, 0.25),
            ({"natural_frequency": 0, "damping": 0.0}, 1.0),
            ({"natural_frequency": 2.0, "excitations": [harmonic(5.0)]}, 2.0),
        ],
    )
    def test_reference_frequency(self, parts, frequency):
        osc = vk.Oscillator(**({"damping": 0.25} | parts))
        assert osc.reference_frequency == pytest.approx(frequency, rel=1e-12)
        assert osc.time_unit == osc.section_interval

"""Parts and scenes whose numbers have units: what a drawing says, divided by the mass in one place."""

import copy
import dataclasses
import json
import math
import pickle
import subprocess
import sys

import numpy as np
import pint
import pytest

import vibrokit as vk
from tests.assessment.test_plausibility import TUBE
from tests.builders import full_structure
from vibrokit.assessment.plausibility import plausibility
from vibrokit.errors import ParameterError, SceneError, StructureError
from vibrokit.parts.parameter import Parameter
from vibrokit.quantity import Quantity
from vibrokit.report.pictures import scene_picture
from vibrokit.report.tables import input_table
from vibrokit.results.one_scene import check_scene
from vibrokit.scene_file import scene_data, scene_from_data, scene_text

DRAWING = """mass = "0.35 kg"
stiffness = "22 kN/m"
damping_ratio = 0.008

[[barriers]]
law = { name = "linear", stiffness = "2 MN/m" }
position = "0.25 mm"
side = "right"

[[barriers]]
law = { name = "linear", stiffness = "2 MN/m" }
position = "-0.25 mm"
side = "left"

[[excitations]]
name = "harmonic"
amplitude = "6 N"
frequency = "65 Hz"
phase = 0.0

[noise]
name = "white"
intensity = "1e-3 N^2/Hz"
"""


@pytest.fixture
def tube(tmp_path):
    (tmp_path / "tube.toml").write_text(DRAWING)
    return vk.load_scene(tmp_path / "tube.toml")


def test_a_scene_as_a_drawing_gives_it_has_the_numbers_of_hand(tube):
    """Bit for bit."""
    assert tube.own_frequency == TUBE.natural_frequency
    assert tube.linear_damping == TUBE.linear_damping
    own = {"natural_frequency": TUBE.natural_frequency, "stiffness": 22e3 / 0.35}
    assert own | tube.parameters == own | TUBE.parameters
    by_hand = {(row.measure, row.subject): row.value for row in plausibility(TUBE).rows}
    found = {(row.measure, row.subject): row.value for row in plausibility(tube).rows}
    assert found == pytest.approx(by_hand, rel=1e-12)


def test_it_is_saved_as_it_was_given(tube):
    assert scene_text(tube) == DRAWING


@pytest.mark.parametrize(
    "copied",
    [
        lambda osc: scene_from_data(json.loads(json.dumps(scene_data(osc)))),
        lambda osc: pickle.loads(pickle.dumps(osc)),
        copy.deepcopy,
        lambda osc: osc.replace({"barriers.0.position": "0.25 mm"}, damping_ratio=0.008),
        lambda osc: osc.replace(mass=1.0).replace(mass="350 g"),
    ],
)
def test_the_mass_of_a_copy_divides_what_was_given(tube, copied):
    found = copied(tube)
    assert found == tube
    assert {path: one.text for path, one in found.quantities.items() if path != "mass"} == {
        path: one.text for path, one in tube.quantities.items() if path != "mass"
    }
    heavy = found.replace(mass=0.7)
    assert heavy.mass == 0.7
    assert heavy.stiffness == 22e3 / 0.7
    assert heavy.barriers[0].law.stiffness == 2e6 / 0.7
    assert heavy.excitations[0].amplitude == 6 / 0.7
    assert heavy.noise.intensity == 1e-3 / 0.7**2 / 2
    assert heavy.barriers[0].position == 2.5e-4
    with pytest.raises(SceneError, match="scene: stiffness is 22 kN/m, which needs the mass"):
        found.replace(mass=None)


def test_plain_numbers_are_per_unit_mass(tube):
    assert TUBE.replace(mass=0.35) == TUBE
    assert TUBE.replace(mass=0.35).parameters == TUBE.parameters
    plain = tube.replace({"excitations.0.amplitude": 5.0})
    assert plain.replace(mass=2.0).excitations[0].amplitude == 5.0
    assert "excitations.0.amplitude" not in plain.quantities


def test_plain_data_of_a_record_has_numbers_and_texts(tube):
    data = scene_data(tube)
    assert data["excitations"][0] == {"name": "harmonic", "amplitude": 6 / 0.35, "frequency": 130 * math.pi, "phase": 0}
    assert type(data["excitations"][0]["amplitude"]) is float
    assert data["given"]["excitations.0.amplitude"] == "6 N"
    assert data["given"]["mass"] == "0.35 kg"
    assert data["mass"] == 0.35
    assert "given" not in scene_data(TUBE)


@pytest.mark.parametrize(
    ("path", "text", "words"),
    [
        ("excitations.0.amplitude", "7 N", r"excitations\.0\.amplitude is 17\.1\d* and given as '7 N'; give one\.$"),
        ("excitations.3.amplitude", "6 N", r"'excitations\.3\.amplitude' is given as '6 N' and has no number\.$"),
        ("weight", "6 N", r"'weight' is given as '6 N' and has no number\.$"),
        ("excitations.0.amplitude", "6 V", "amplitude must be in m s.-2, or kg m s.-2 with the mass of the scene"),
    ],
)
def test_texts_that_do_not_fit_the_numbers_of_a_record(tube, path, text, words):
    data = scene_data(tube)
    with pytest.raises((SceneError, ParameterError), match=words):
        scene_from_data(data | {"given": data["given"] | {path: text}})


def test_a_table_of_texts_that_is_none():
    with pytest.raises(SceneError, match="given must be a table of texts by path, got 3"):
        scene_from_data(scene_data(TUBE) | {"given": 3})


def test_a_force_waits_for_the_mass():
    force = vk.Harmonic("6 N", "65 Hz")
    assert force.amplitude.pending
    assert repr(force) == "Harmonic(amplitude='6 N', frequency='65 Hz', phase=0.0)"
    assert pickle.loads(pickle.dumps(force)) == force
    scene = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=[force], mass=2.0)
    assert scene.excitations[0].amplitude == 3.0
    assert scene.excitations[0].replace(phase=0.1).amplitude == 3.0
    assert force.amplitude.pending
    with pytest.raises(SceneError, match=r"^scene: excitations\.0\.amplitude is 6 N, which needs the mass; give the "):
        vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=scene.excitations)


def test_quantities_of_pint():
    units = pint.UnitRegistry()
    law = vk.Hertz(3 * units.GN / units.m**1.5)
    scene = vk.Oscillator(
        natural_frequency=units.Quantity(40, "Hz"), damping_ratio=0.1, mass=2 * units.kg,
        barriers=[vk.Barrier(law, 0.5 * units.mm, "right")], excitations=[vk.Constant(3 * units.N)],
    )  # fmt: skip
    assert scene.parameters == {
        "natural_frequency": 80 * math.pi, "damping_ratio": 0.1, "barriers.0.position": 5e-4,
        "barriers.0.law.stiffness": 1.5e9, "excitations.0.force": 1.5,
    }  # fmt: skip
    assert scene.quantities["excitations.0.force"].text == "3 N"


def test_damping_of_the_scene():
    scene = vk.Oscillator(mass="2 kg", stiffness="8 N/m", damping="3 N s/m")
    assert (scene.own_frequency, scene.linear_damping) == (2.0, 1.5)
    assert vk.Oscillator(natural_frequency=1.0, damping="3 s^-1").linear_damping == 3.0


def test_damping_in_newton_seconds_is_divided_where_it_is_declared():
    class Dashpot(vk.Spring):
        stiffness: float = vk.parameter("k", "s^-2")
        damping: float = vk.parameter("c", "s^-1", mass_power=1)
        rate: float = vk.parameter("r", "s^-1", default=1.0)

        def force(self, x, v):
            return self.stiffness * x + self.damping * v

    scene = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, spring=Dashpot("4 kN/m", "6 N s/m"), mass=2)
    assert (scene.spring.stiffness, scene.spring.damping) == (2e3, 3.0)
    with pytest.raises(ParameterError, match=r"^Dashpot: rate must be in s\^-1, got '6 N s/m'"):
        Dashpot(1.0, 1.0, "6 N s/m")


def test_what_is_computed_before_the_mass_is_known_is_refused():
    stiffness = Parameter("stiffness", "stiffness", "k", "s^-2", minimum=0)
    assert stiffness.known("Law.from_restitution", "9 s^-2") == 9.0
    assert type(stiffness.known("Law.from_restitution", 9.0)) is float
    with pytest.raises(ParameterError, match=r"^Law: stiffness is 2 MN/m and is computed with before a scene gives"):
        stiffness.known("Law", "2 MN/m")


def test_structural_parameters_are_plain():
    class Power(vk.ContactLaw):
        stiffness: float = vk.parameter("k", "s^-2")
        exponent: float = vk.parameter("n", "", structural=True)

        def force(self, depth, rate):
            return self.stiffness * depth**self.exponent

    assert type(Power(1.0, "150 %").exponent) is float
    assert type(Power(1.0, 1.5).exponent) is float


def test_no_unit_no_pint():
    code = (
        "import sys, vibrokit as vk\n"
        "osc = vk.load_scene('hertz-0.570').replace(damping_ratio=0.02, mass=2.0)\n"
        "assert len(osc.model.drift) == 2\n"
        "assert 'pint' not in sys.modules\n"
        "vk.Harmonic('1 N', 1.0)\n"
        "assert 'pint' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_motion_is_that_of_plain_numbers(tube):
    plain = TUBE.replace(natural_frequency=None, stiffness=22e3 / 0.35)
    assert tube == plain
    assert isinstance(tube.excitations[0].amplitude, Quantity)
    assert (tube.section_map([[1e-4, 0.01]]) == plain.section_map([[1e-4, 0.01]])).all()


def test_levels_of_spectra():
    """0.04 g²/Hz are D = 0.02 g²."""
    expected = vk.WhiteNoise(0.02 * 9.80665**2)
    for noise in (vk.WhiteNoise.from_psd("0.04 g_n^2/Hz"), vk.WhiteNoise("0.04 g_n^2/Hz")):
        assert noise.intensity == pytest.approx(expected.intensity, rel=1e-15)
    assert vk.WhiteNoise.from_psd("1e-3 N^2/Hz", of="force", mass="500 g").intensity == 2e-3
    with pytest.raises(ParameterError, match=r"^WhiteNoise\.from_psd: level is 1e-3 N\^2/Hz and is computed with"):
        vk.WhiteNoise.from_psd("1e-3 N^2/Hz")


def test_the_acceleration_of_a_support_is_not_divided_by_the_mass():
    assert vk.SupportAcceleration("2 g_n", "50 Hz").amplitude == 2 * 9.80665
    with pytest.raises(ParameterError, match=r"amplitude must be in m s\^-2, got '2 N', which is in kg m s\^-2"):
        vk.SupportAcceleration("2 N", "50 Hz")


def test_every_number_of_a_periodic_force_may_have_a_unit():
    """Fourier coefficients are constants of the part, not fields."""
    force = vk.Periodic("65 Hz", "1 N", c_1="6 N", s_3="500 mN", s_1=0.25)
    scene = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=[force], mass="0.5 kg")
    assert scene.excitations[0] == vk.Periodic(130 * math.pi, 2.0, c_1=12.0, s_3=1.0, s_1=0.25)
    assert scene.replace(mass=1.0).excitations[0] == vk.Periodic(130 * math.pi, 1.0, c_1=6.0, s_3=0.5, s_1=0.25)


@pytest.mark.parametrize(
    ("part", "plain"),
    [
        (vk.Chirp("6 N", "10 Hz", "20 Hz", "2 ms"), vk.Chirp(12.0, 20 * math.pi, 40 * math.pi, 0.002)),
        (vk.PulseTrain("3 N s", "1 s", "10 ms"), vk.PulseTrain(6.0, 1.0, 0.01)),
        (vk.ParametricStiffness("2 N/m", "5 Hz"), vk.ParametricStiffness(4.0, 10 * math.pi)),
    ],
)
def test_excitations_in_the_units_of_a_drawing(part, plain):
    scene = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, excitations=[part], mass="0.5 kg")
    assert scene.excitations == (plain,)


def test_a_dash_pot_and_a_corner_frequency():
    law = vk.KelvinVoigt("2 N/m", "3 N s/m")
    scene = vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.1, barriers=[vk.Barrier(law, "1 mm", "right")], mass="0.5 kg",
        noise=vk.ColouredNoise("1e-3 N^2/Hz", "5 Hz"),
    )  # fmt: skip
    assert scene.barriers[0].law == vk.KelvinVoigt(4.0, 6.0)
    assert scene.noise == vk.ColouredNoise(1e-3 / 0.5**2 / 2, 10 * math.pi)


def test_a_restitution_is_not_computed_from_a_force_without_a_mass():
    with pytest.raises(ParameterError, match="stiffness is 2 kN/m and is computed with before a scene gives the mass"):
        vk.KelvinVoigt.from_restitution(0.5, "2 kN/m")
    assert vk.KelvinVoigt.from_restitution(0.5, "4 1/s^2") == vk.KelvinVoigt.from_restitution(0.5, 4.0)


def test_an_exponent_of_the_law_is_one_of_its_unit():
    class Power(vk.ContactLaw):
        stiffness: float = vk.parameter("k", "m^(1-n) s^-2")
        exponent: float = vk.parameter("n", "", structural=True)

        def force(self, depth, rate):
            return self.stiffness * depth**self.exponent

    for exponent, unit, declared in ((1.5, "GN/m^1.5", "m^(-1/2) s^-2"), (4 / 3, "GN/m^(4/3)", "m^(-1/3) s^-2")):
        law = Power(f"3 {unit}", exponent)
        assert law.of_mass(2.0).stiffness == 1.5e9
        assert law.declared()[0].unit == declared
    with pytest.raises(ParameterError, match=r"^Power: stiffness must be in m\^\(-1\) s\^-2, or kg m\^-1 s\^-2 with"):
        Power("3 GN/m^1.5", 2.0)


def test_reports_show_what_was_given(tube):
    rows = {row[0]: row[1:] for row in input_table(tube).rows}
    assert rows["excitations.0.amplitude"] == ("f", "17.14285714", "m s⁻²", "6 N")
    assert rows["stiffness"][-1] == "22 kN/m"
    assert rows["mass"] == ("", "0.35", "kg", "0.35 kg")
    drawing = scene_picture(tube).svg
    for text in ("22 kN/m", "2 MN/m", "0.25 mm", "6 N", "65 Hz", "1e-3 N^2/Hz"):
        assert text in drawing


def test_a_saved_record_keeps_what_was_given(tube, tmp_path):
    record = dataclasses.replace(full_structure(), scene=scene_data(tube))
    record.save(tmp_path / "tube.nc")
    found = vk.load_result(tmp_path / "tube.nc").oscillator
    assert found == tube
    assert found.replace(mass=0.7).parameters == tube.replace(mass=0.7).parameters
    assert found.replace(mass=0.7).stiffness == 22e3 / 0.7


def test_records_of_one_motion_are_of_one_scene_whatever_units_it_was_given_in(tube):
    by_hand = scene_data(TUBE.replace(natural_frequency=None, stiffness=22e3 / 0.35))
    check_scene("a record", dataclasses.replace(full_structure(), scene=scene_data(tube)), by_hand)
    with pytest.raises(StructureError, match="is of another scene: "):
        check_scene(
            "a record", dataclasses.replace(full_structure(), scene=scene_data(tube.replace(mass=0.7))), by_hand
        )


def test_a_number_that_shapes_the_equations_does_not_wait_for_the_mass():
    class Shaped(vk.Spring):
        stiffness: float = vk.parameter("k", "s^-2", structural=True)

        def force(self, x, v):
            return self.stiffness * x

    assert Shaped("4 1/s^2").stiffness == 4.0
    with pytest.raises(
        ParameterError, match=r"Shaped: stiffness shapes the equations.*per unit mass, in s\^-2, got 4 N/m"
    ):
        Shaped("4 N/m")


@pytest.mark.parametrize(
    "asked",
    [
        lambda: vk.KelvinVoigt("2 MN/m", "12 N s/m").rebound(),
        lambda: vk.WhiteNoise("1e-3 N^2/Hz").psd,
        lambda: vk.WhiteNoise("1e-3 N^2/Hz").density(1.0),
    ],
)
def test_nothing_is_computed_before_the_mass_is_known(asked):
    with pytest.raises(ParameterError, match="there is no mass yet; ask the part of a scene that has one"):
        asked()


@pytest.mark.parametrize("mass", [1e-320, 1e-200])
def test_a_mass_by_which_a_number_becomes_infinite(mass):
    with pytest.raises(ParameterError, match="stiffness must be a finite number"):
        vk.Oscillator(mass=mass, stiffness="6e200 N/m", damping_ratio=0.1)
    with pytest.raises(ParameterError, match="intensity must be a finite number"):
        vk.Oscillator(mass=mass, natural_frequency=1.0, damping_ratio=0.1, noise=vk.WhiteNoise("1 N^2/Hz"))


@pytest.mark.parametrize(
    ("path", "unit"),
    [("amplitude", "N"), ("frequency", "N s/m"), ("frequency", "2 Hz"), ("frequency", pint.Unit("Hz"))],
)
def test_units_of_a_sweep_are_those_that_the_parameter_takes(path, unit):
    shaken = vk.Oscillator(
        mass=0.35, natural_frequency=1.0, damping_ratio=0.1, excitations=[vk.SupportAcceleration(1.0, 0.5)]
    )
    with pytest.raises(ParameterError, match="unit"):
        vk.sweep(shaken, path, [1.0, 2.0], unit=unit, energies=False)


def test_arrays_with_units_are_not_taken_for_their_numbers():
    units, osc = pint.UnitRegistry(), vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1)
    times = np.linspace(0, 10, 1024)
    for asked in (
        lambda: osc.trajectory(units.Quantity(np.array([1.0, 0.0]), "mm"), duration=1.0),
        lambda: vk.WhiteNoise.from_record(units.Quantity(times, "ms"), np.sin(times)),
        lambda: vk.Periodic.from_samples(times, units.Quantity(np.sin(times), "N")),
        lambda: vk.WhiteNoise.from_record(times, np.ma.masked_less(np.sin(times), 0)),
        lambda: vk.WhiteNoise.from_record(times, np.sin(times) + 0j),
    ):
        with pytest.raises(ParameterError, match=r"with units; give its numbers|masked|of type complex"):
            asked()

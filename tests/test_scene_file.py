"""Scene files: what is saved comes back whole, and a file is written whole or not at all."""

import os
import stat

import pytest

import vibrokit as vk
from vibrokit.errors import FileError, SceneError
from vibrokit.parts.single_parts import SINGLE_PARTS
from vibrokit.registry import BUILT_IN, Group, load, names
from vibrokit.results import atomic
from vibrokit.scene_file import bundled_scenes, scene_data, scene_from_data
from vibrokit.testing import KINDS


def everything():
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.1,
        spring=vk.CustomSpring("a*x + b*x**3", a=1.0, b=1e-300),
        friction=vk.StribeckFriction(magnitude=0.1, static=0.2, decay=0.3, width=1e-3),
        barriers=(
            vk.Barrier(vk.CustomLaw("k*depth**1.5*(1 + c*rate)", k=50.0, c=1 / 3), 0.5, "right", adhesive=True),
            vk.Barrier(vk.Linear(1e22), -0.1, "left"),
        ),
        excitations=(vk.Harmonic(0.1, 2 / 3, 0.3), vk.Constant(-0.2), vk.Harmonic(1e-17, 4 / 3)),
        noise=vk.StateDependentNoise(5e-324, "1 + c*x**2", c=-0.5),
    )


class TestRoundTrip:
    def test_everything(self, tmp_path):
        vk.save_scene(everything(), tmp_path / "all.toml")
        assert vk.load_scene(tmp_path / "all.toml") == everything()
        assert vk.load_scene(str(tmp_path / "all.toml")) == everything()

    @pytest.mark.parametrize("name", bundled_scenes())
    def test_bundled(self, tmp_path, name):
        osc = vk.load_scene(name)
        vk.save_scene(osc, tmp_path / "copy.toml")
        assert vk.load_scene(tmp_path / "copy.toml") == osc

    def test_plain_data(self):
        assert scene_from_data(scene_data(everything())) == everything()
        assert set(SINGLE_PARTS) < set(scene_data(everything()))

    def test_least(self, tmp_path):
        osc = vk.Oscillator(natural_frequency=1, damping_ratio=0)
        vk.save_scene(osc, tmp_path / "least.toml")
        assert (tmp_path / "least.toml").read_text() == "natural_frequency = 1.0\ndamping_ratio = 0.0\n"
        assert vk.load_scene(tmp_path / "least.toml") == osc

    def test_a_file_of_ones_own_beats_a_bundled_scene_of_that_name(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        vk.save_scene(everything(), "hertz-0.570")
        assert vk.load_scene("hertz-0.570") == everything()


def built_in_parts():
    """Every registered part of the toolkit, with the checks that put it into a scene."""
    return [
        pytest.param(checks, load(checks.group, name), id=f"{checks.group.noun}-{name}")
        for checks in KINDS
        for name, distribution in names(checks.group)
        if distribution == BUILT_IN
    ]


class TestEveryBuiltInPart:
    def test_every_kind_is_here(self):
        no_parts = {Group.ANALYZERS, Group.EXITS, Group.RECORDS}
        assert {checks.group for checks in KINDS} == set(Group) - no_parts

    @pytest.mark.parametrize(("checks", "part"), built_in_parts())
    def test_a_file_keeps_it(self, tmp_path, checks, part):
        """With its default values where it has some, and with random ones."""
        of_part = checks(part, rng=3)
        for sample in of_part.samples:
            osc = of_part.scene(sample)
            vk.save_scene(osc, tmp_path / "scene.toml")
            again = vk.load_scene(tmp_path / "scene.toml")
            assert again == osc
            assert again.parameters == osc.parameters


class TestSaving:
    def keep(self, path):
        path.write_text("old")
        return path

    def test_an_unregistered_part_is_refused_before_anything_is_written(self, tmp_path):
        class Mine(vk.ContactLaw):
            stiffness: float = vk.parameter("k", "s^-2")

            def force(self, depth, rate):
                return self.stiffness * depth

        osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, barriers=[vk.Barrier(Mine(1.0), 0.5, "right")])
        path = self.keep(tmp_path / "scene.toml")
        with pytest.raises(SceneError, match=r"Mine is not registered.*entry-point group 'vibrokit\.contact_laws'\.$"):
            vk.save_scene(osc, path)
        assert path.read_text() == "old"
        assert os.listdir(tmp_path) == ["scene.toml"]

    @pytest.mark.parametrize("fails", ["replace", "chmod"])
    def test_a_failure_on_the_way_leaves_the_old_file(self, tmp_path, monkeypatch, fails):
        path = self.keep(tmp_path / "scene.toml")

        def full(*args):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(atomic.os, fails, full)
        with pytest.raises(FileError, match=r"scene\.toml cannot be written \(No space left on device\); give .*\.$"):
            vk.save_scene(everything(), path)
        assert path.read_text() == "old"
        assert os.listdir(tmp_path) == ["scene.toml"]

    @pytest.mark.parametrize("place", ["missing/scene.toml", "file/scene.toml", ""])
    def test_places_that_cannot_be_written(self, tmp_path, place):
        (tmp_path / "file").write_text("")
        with pytest.raises(FileError, match=r"is no folder; make it first\.$|is a folder; add the name of a file\.$"):
            vk.save_scene(everything(), tmp_path / place)
        assert os.listdir(tmp_path) == ["file"]

    def test_the_file_is_as_open_as_any_other(self, tmp_path):
        vk.save_scene(everything(), tmp_path / "scene.toml")
        (tmp_path / "plain").write_text("")
        modes = {stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("scene.toml", "plain")}
        assert len(modes) == 1

    @pytest.mark.parametrize("thing", [None, "hertz-0.570", {}, vk.Hertz(1.0)])
    def test_what_is_no_scene(self, tmp_path, thing):
        with pytest.raises(SceneError, match=r"^save_scene: scene must be an Oscillator, got .*\.$"):
            vk.save_scene(thing, tmp_path / "scene.toml")
        assert not os.listdir(tmp_path)

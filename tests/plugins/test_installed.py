"""Plug-ins as they are installed: distributions found by their metadata, whole or broken."""

import importlib.metadata
import subprocess
import sys
import warnings

import pytest

import vibrokit as vk
from vibrokit import registry
from vibrokit.errors import UnknownNameError
from vibrokit.parts.contact import ContactLaw
from vibrokit.registry import Group, Registered

pytestmark = pytest.mark.slow

SCENE = """
natural_frequency = 1.0
damping_ratio = 0.01
[[barriers]]
law = {{ name = "{name}", stiffness = 50.0, dissipation = 0.2 }}
position = 0.5
side = "right"
"""


def write_distribution(folder, name, entry, **modules):
    """Lay out an installed distribution: metadata with one contact law, and modules."""
    info = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[vibrokit.contact_laws]\n{entry}\n")
    for module, text in modules.items():
        (folder / f"{module}.py").write_text(text)


@pytest.fixture
def site(tmp_path, monkeypatch):
    """A folder that distributions may be put in, on the path."""
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_the_distribution_is_installed():
    distribution = importlib.metadata.distribution("vibrokit-hunt-crossley")
    (entry,) = distribution.entry_points.select(group="vibrokit.contact_laws")
    assert entry.name == "hunt-crossley"
    assert distribution.version == "0.1.0"
    assert any(requirement.startswith("vibrokit") for requirement in distribution.requires)


def test_it_is_listed_with_its_distribution():
    assert Registered("hunt-crossley", "vibrokit-hunt-crossley") in registry.names(Group.CONTACT_LAWS)
    law = registry.load(Group.CONTACT_LAWS, "hunt-crossley", ContactLaw)
    assert registry.name_of(Group.CONTACT_LAWS, law) == "hunt-crossley"


def test_a_scene_file_may_name_it(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.format(name="hunt-crossley"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        osc = vk.load_scene(path)
    assert repr(osc.barriers[0].law) == "HuntCrossley(stiffness=50.0, dissipation=0.2, exponent=1.5)"
    path.write_text(SCENE.format(name="hunt-crosley"))
    with pytest.raises(UnknownNameError, match=r"'hunt-crosley'.*'hunt-crossley'"):
        vk.load_scene(path)


def test_a_broken_plugin_is_not_even_imported_by_scenes_that_do_not_name_it(site, tmp_path):
    write_distribution(site, "broken-laws", "broken = broken_laws:Law", broken_laws="raise SystemExit(3)\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        vk.load_scene("hertz-0.570")
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.format(name="broken"))
    with pytest.warns(UserWarning, match="broken-laws"), pytest.raises(UnknownNameError, match="broken-laws"):
        vk.load_scene(path)


def test_a_plugin_written_today_works_at_once(site, tmp_path):
    code = (
        "import vibrokit as vk\n"
        "class Soft(vk.ContactLaw):\n"
        "    stiffness: float = vk.parameter('k', 's^-2', minimum=0)\n"
        "    dissipation: float = vk.parameter('c', 's m^-1', minimum=0)\n"
        "    def force(self, depth, rate):\n"
        "        return self.stiffness * depth**2 * (1 + self.dissipation * rate)\n"
    )
    write_distribution(site, "soft-laws", "soft = soft_laws:Soft", soft_laws=code)
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.format(name="soft"))
    osc = vk.load_scene(path)
    assert type(osc.barriers[0].law).__name__ == "Soft"
    vk.save_scene(osc, tmp_path / "again.toml")
    assert vk.load_scene(tmp_path / "again.toml") == osc


def test_importing_vibrokit_imports_no_plugin():
    code = (
        "import sys, vibrokit, vibrokit.registry as r; r.names(r.Group.CONTACT_LAWS); "
        "print('vibrokit_hunt_crossley' in sys.modules)"
    )
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout.strip() == "False"

"""The oldest and newest numpy, scipy, sympy and numba that are allowed, and a Numba that was not tested."""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numba import version_info

from vibrokit.kernels.options import TESTED

ROOT = Path(__file__).parents[2]
REQUIRED = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
LIBRARIES = ("numpy", "scipy", "sympy", "numba")
SCENE = """
import json
CHANGE
import vibrokit as vk
stops = [vk.Barrier(vk.Hertz(50.0), 0.5, "right"), vk.Barrier(vk.Hertz(50.0), -0.5, "left")]
osc = vk.Oscillator(
    natural_frequency=1.0, damping_ratio=0.01, barriers=stops, excitations=[vk.Harmonic(0.18, 0.57), vk.Constant(0.2)],
    noise=vk.WhiteNoise(2e-5),
)
starts = [[0.45, 0.0], [0.0, 0.0], [-0.3, 0.2]]
steppers = vk.RK4(256), vk.Order8(1e-8), vk.FreeFlight(1e-10)
ends = [osc.section_map(starts, periods=2, stepper=stepper).tolist() for stepper in steppers]
print(json.dumps([*ends, osc.section_map(starts, periods=2, rng=1).tolist()]))
"""
UNTESTED = "import numba; numba.version_info = numba.version_info._replace(short=(9, 9), string='9.9')"


def ends(python, cache, change=""):
    """Where trajectories of a small scene end in a process of its own, and its warnings."""
    environment = os.environ | {"VIBROKIT_CACHE": str(cache), "PYTHONPATH": str(ROOT)}
    command = [str(python), "-c", SCENE.replace("CHANGE", change)]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return np.array(json.loads(run.stdout)), run.stderr


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    return ends(sys.executable, tmp_path_factory.mktemp("kernels"))[0]


def test_the_bounds_are_those_that_the_package_declares():
    (required,) = (requirement for requirement in REQUIRED if requirement.startswith("numba"))
    assert required == "numba>={},<{}".format(*(".".join(map(str, version)) for version in TESTED))
    assert TESTED[0] <= version_info.short < TESTED[1]


@pytest.mark.long
def test_under_a_numba_that_was_not_tested_kernels_compile_by_public_interfaces(here, tmp_path):
    found, warned = ends(sys.executable, tmp_path, UNTESTED)
    assert "vibrokit was tested with Numba from 0.62 to below" in warned
    np.testing.assert_allclose(found, here, rtol=1e-10, atol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("bound", ["oldest", "newest"])
def test_a_scene_runs_under(bound, here, tmp_path):
    wanted = [requirement.split(",")[0] if bound == "oldest" else requirement for requirement in REQUIRED]
    if bound == "oldest":
        wanted = [w.replace(">=", "==") if re.match(r"[a-z]+", w)[0] in LIBRARIES else w for w in wanted]
    python = tmp_path / "venv" / "bin" / "python"
    for command in (
        [sys.executable, "-m", "venv", str(tmp_path / "venv")],
        [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *wanted],
    ):
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if run.returncode:
            pytest.skip(f"not tested, because {' '.join(command[:4])} failed: {run.stderr[-300:]}")
    found, _ = ends(python, tmp_path / "kernels")
    np.testing.assert_allclose(found, here, rtol=1e-9, atol=1e-11)

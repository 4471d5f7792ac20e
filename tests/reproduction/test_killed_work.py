"""Work that was killed goes on with the same bits.

These are all arrays, energies and findings of all records, and all pictures. Times in seconds differ, and with them the
files and the table of work.
"""

import contextlib
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.analyzers.least_action import LeastAction
from vibrokit.analyzers.mean_exit_times import MFET
from vibrokit.analyzers.sgcm_wkb import SGCM
from vibrokit.reproduction.steps import Step

STEPS = (
    Step("double-well", "structure"),
    Step("double-well", "least-action", LeastAction(source=0, shooting=None)),
    Step("double-well", "density", SGCM(source=0, intensities=(2e-2,), nodes=(60, 60))),
    Step("double-well", "exit-times", MFET(source=0, intensities=(4e-2, 3e-2), target_error=0.2)),
)
KILLS = 10

# Begins when it has said so; kills itself at one of its renames of a finished record, if it is told to.
CHILD = """
import os, signal, sys
from vibrokit.reproduction import reproduce as reproduction
from tests.reproduction.test_killed_work import STEPS

folder, fatal = sys.argv[1], int(sys.argv[2])
rename, renames = os.replace, []

def replace(source, target):
    if str(target).endswith(".nc"):
        renames.append(target)
        if len(renames) == fatal:
            os.kill(os.getpid(), signal.SIGKILL)
    rename(source, target)

os.replace = replace
reproduction.steps = lambda quick: STEPS
print("begun", flush=True)
reproduction.reproduce(folder)
"""


def run(folder, seconds=None, fatal=0):
    """Start the work; kill it after some seconds. Return its exit status."""
    command = [sys.executable, "-c", CHILD, str(folder), str(fatal)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2]) as process:
        process.stdout.readline()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        process.kill()
    return process.returncode


def contents(folder):
    """The arrays of all records; and their findings, their energies and the pictures."""
    records = [vk.load_result(folder / step.file) for step in STEPS]
    energies = [(one.value, one.lower, one.upper) for record in records[1:] for one in record.energies]
    pictures = {file.name: file.read_bytes() for file in folder.glob("*.png")}
    assert len(pictures) == 2
    return [one.to_dataset().drop_attrs() for one in records], ([one.findings for one in records], energies, pictures)


@pytest.mark.long
def test_work_that_was_killed_goes_on_with_the_same_bits(tmp_path):
    whole, again, rng = tmp_path / "whole", tmp_path / "again", np.random.default_rng(1)
    assert run(whole) == 0  # compiles what is missing
    written = [vk.load_result(whole / step.file).seconds for step in STEPS]
    assert run(again, fatal=1) == -signal.SIGKILL  # a whole temporary file, and no record
    assert not list(again.glob("*.nc"))
    ended = [run(again, seconds) for seconds in rng.uniform(0, sum(written) / 2, KILLS)]
    assert -signal.SIGKILL in ended
    assert run(again) == 0
    (arrays, others), (known, rest) = contents(again), contents(whole)
    assert all(one.identical(other) for one, other in zip(arrays, known, strict=True))
    assert others == rest

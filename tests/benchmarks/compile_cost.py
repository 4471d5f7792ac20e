"""Processor seconds until a kernel runs: of the first scene of a form, of another of the form, and loaded from disk.

Each is a process of its own; the first begins with an empty folder of kernels. Two scenes are of the same form if they
have as many stops and the same stepper and flow: their drivers are the same, and only the code of the scene is new.

    python -m tests.benchmarks.compile_cost [--csv FILE]
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time

import numpy as np

import vibrokit as vk
from tests.benchmarks import table_file
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.kernel import kernel_for
from vibrokit.symbolic.flow_kind import Flow

STEPPERS = {"RK4": vk.RK4(), "Order8": vk.Order8(), "FreeFlight": vk.FreeFlight()}
FLOWS = (Flow.STATE, Flow.STATE_VARIATIONAL, Flow.HAMILTONIAN, Flow.HAMILTONIAN_VARIATIONAL)


def scene(stepper: str, power: int) -> vk.Oscillator:
    """A scene of its own for each power, with a stop."""
    stops = (vk.Barrier(vk.CustomLaw(f"k*depth**{power}", k=20.0), 1.6, "right"),)
    spring = vk.LinearSpring(1.0) if stepper == "FreeFlight" else vk.CustomSpring(f"x + b*x**{power + 1}", b=0.3)
    return vk.Oscillator(
        natural_frequency=1.0, damping_ratio=0.05, spring=spring, barriers=stops,
        excitations=(vk.Harmonic(0.4, 1.4),), noise=vk.WhiteNoise(1e-4),
    )  # fmt: skip


def timed(power: int) -> list[float]:
    """Seconds of each first call, in this process; what all kernels share is loaded before."""
    run_ensemble(vk.load_scene("hertz-0.570"), Flow.STATE, vk.RK4(), np.zeros((1, 2)))
    seconds = []
    for name, stepper in STEPPERS.items():
        for flow in FLOWS:
            osc = scene(name, power)
            began = time.process_time()
            equations = kernel_for(osc, flow, stepper).module.EQUATIONS
            run_ensemble(osc, flow, stepper, np.full((1, equations), 0.1))
            seconds.append(time.process_time() - began)
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--power", type=int, help=argparse.SUPPRESS)
    table_file.add_option(parser)
    given = parser.parse_args()
    power = given.power
    if power is not None:
        print(json.dumps(timed(power)))
        return
    with tempfile.TemporaryDirectory() as folder:
        columns = []
        for number in (2, 4, 4):
            command = [sys.executable, "-m", "tests.benchmarks.compile_cost", "--power", str(number)]
            run = subprocess.run(
                command, env=os.environ | {"VIBROKIT_CACHE": folder}, capture_output=True, text=True, check=True
            )
            columns.append(json.loads(run.stdout))
    print(f"{'stepper':12}{'flow':26}{'first':>8}{'another':>9}{'loaded':>8}   seconds")
    rows = [(name, flow.value) for name in STEPPERS for flow in FLOWS]
    for (name, flow), first, another, loaded in zip(rows, *columns, strict=True):
        print(f"{name:12}{flow:26}{first:8.1f}{another:9.1f}{loaded:8.2f}")
    titles = ("stepper", "flow", "first", "another", "loaded")
    table_file.write(given.csv, [
        dict(zip(titles, (name, flow, f"{first:.2f}", f"{another:.2f}", f"{loaded:.3f}"), strict=True))
        for (name, flow), first, another, loaded in zip(rows, *columns, strict=True)
    ])  # fmt: skip


if __name__ == "__main__":
    main()

"""A trajectory has the same bits whoever compiled its kernel."""

import json
import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow

DIGESTS = """
import hashlib, json
import numpy as np
import vibrokit as vk
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.kernel import kernel_for
from vibrokit.kernels.single import record
from vibrokit.symbolic.flow_kind import Flow


def scene(left):
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.01,
        barriers=(vk.Barrier(vk.Hertz(50.0), 0.5, "right"), vk.Barrier(left, -0.5, "left")),
        excitations=(vk.Harmonic(0.18, 0.57), vk.Harmonic(0.02, 1.14), vk.Constant(0.2)),
        noise=vk.WhiteNoise(intensity=1e-4),
    )


smooth, jumping = scene(vk.Hertz(50.0)), scene(vk.CustomLaw("k*depth + c*rate", k=80.0, c=0.3))
widest = Flow.HAMILTONIAN_VARIATIONAL  # for one of each kind of driver
cases = [(smooth, vk.RK4(128), [Flow.NOISY])]
cases += [(jumping, vk.Order8(1e-8), [widest, Flow.COVARIANCE_REVERSED]), (jumping, vk.FreeFlight(1e-8), [Flow.STATE])]
digests = {}
for osc, stepper, flows in cases:
    for flow in flows:
        generator = np.random.default_rng(0)
        starts = np.zeros((40, kernel_for(osc, flow, stepper).module.EQUATIONS))
        starts[:, :2] = generator.uniform(-0.6, 0.6, (40, 2))
        starts[:, 2:4] = generator.normal(0.0, 1e-3, starts[:, 2:4].shape)
        streams = generator.integers(1, 2**60, (40, 4)).astype(np.uint64) if flow is Flow.NOISY else None
        ended = run_ensemble(osc, flow, stepper, starts, 3, streams=streams)
        digests[f"{stepper.name} {flow.value}"] = hashlib.sha256(ended.states.tobytes()).hexdigest()

# At a stop this stiff, a difference in the last bit of a trajectory grows to one in the seventh digit in ten periods.
stiff = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, barriers=(vk.Barrier(vk.Linear(1e12), 0.3, "right"),))
for stepper in (vk.Order8(1e-12), vk.FreeFlight(1e-12)):
    states = record(stiff, Flow.STATE, stepper, np.array([0.0, 0.6]), 0.0, 4.1887933463778895, 10)
    digests[f"{stepper.name} alone"] = states.tolist()
print(json.dumps(digests))
"""


@pytest.mark.long
def test_compiled_and_loaded_kernels_give_the_same_bits(tmp_path):
    """In a process that compiles its kernels, and in one that loads them."""
    environment = {**os.environ, "VIBROKIT_CACHE": str(tmp_path)}
    command = [sys.executable, "-c", DIGESTS]
    compiled, loaded = (
        json.loads(subprocess.run(command, env=environment, capture_output=True, check=True).stdout) for _ in range(2)
    )
    assert len(compiled) == 6
    assert compiled == loaded

"""Integrates scenes in another process.

It starts a new interpreter, because a worker of multiprocessing would run the script of the caller again.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
import warnings
from typing import Any

import numpy as np

from vibrokit.kernels.choice import CoarseStepsWarning
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.fixed_steps import RK4
from vibrokit.kernels.kernel import write_sources
from vibrokit.kernels.streams import streams_of
from vibrokit.oscillator import Oscillator
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.testing.report import ConformanceError

_SECONDS = 300
_ADVICE = "define the class at the top level of a module that can be imported."
_MAIN = (
    "import sys, pickle; paths, work = pickle.load(sys.stdin.buffer); sys.path[:] = paths; "
    "from vibrokit.testing.other_process import serve; serve(work)"
)


def outcome(scene: Oscillator) -> tuple[str, bytes]:
    """Return the newly generated code of a scene, and the images of a few states."""
    flow = Flow.STATE if scene.noise is None else Flow.NOISY
    stepper = RK4(steps=max(1, round(64 * scene.time_unit)))
    extra = 0 if scene.noise is None else len(scene.noise.extra_states)
    starts = np.array([[0.3, 0.4], [-0.2, 0.9], [0.15, 0.0], [0.05, -0.6]])
    starts = np.hstack([starts, np.full((len(starts), extra), 0.1)])
    streams = None if scene.noise is None else streams_of(7, np.arange(len(starts)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseStepsWarning)  # the bits count, not their accuracy
        ended = run_ensemble(scene, flow, stepper, starts, 1, interval=1.0, streams=streams)
    return write_sources(scene, flow, stepper).scene, ended.states.tobytes()


def outcomes_in_other_process(scenes: list[Oscillator]) -> list[tuple[str, bytes]]:
    """Return the outcomes of scenes as computed by another process."""
    try:
        work = pickle.dumps((sys.path, pickle.dumps(scenes)))
        process = subprocess.run(
            [sys.executable, "-c", _MAIN], input=work, capture_output=True, timeout=_SECONDS, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise ConformanceError(f"Another process did not finish within {_SECONDS} s.") from error
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise ConformanceError(f"The part cannot be sent to another process ({error}); {_ADVICE}") from error
    if process.returncode:
        last = process.stderr.decode(errors="replace").strip().splitlines()[-1:]
        raise ConformanceError(f"Another process failed ({''.join(last)}); {_ADVICE}")
    found: Any = pickle.loads(process.stdout)
    return list(found)


def serve(work: bytes) -> None:
    """Compute the outcomes of pickled scenes and write them to standard output."""
    answer = pickle.dumps([outcome(scene) for scene in pickle.loads(work)])
    sys.stdout.buffer.write(answer)

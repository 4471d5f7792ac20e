"""How fast excitations change: a step that is longer than a pulse may jump it, and nothing shows that it did."""

from __future__ import annotations

import bisect
import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import grey_closing, grey_opening

from vibrokit.kernels.vector_field import VectorField
from vibrokit.parts.excitation import Constant, Excitation, Harmonic
from vibrokit.parts.scene import Scene

_SAMPLES = 2**16  # of a period; the narrowest pulse that is seen lasts two of them
_TURNS = 128  # free oscillations from t = 0 in which an excitation that never repeats is sampled
_WIDTHS = tuple(dict.fromkeys(int(2 ** (step / 2)) for step in range(2, 29)))  # of pulses, up to a quarter of a period
_LEAST = 0.01  # of its range: pulses lower than this are left out


class Changes(NamedTuple):
    """The shortest times (s) in which excitations change; infinite for sinusoids, which every stepper resolves."""

    pulse: float  # for which the force is larger, or smaller, than before and after
    rise: float  # in which the force would cross its range at its greatest slope


def changes_of(scene: Scene) -> Changes:
    """Return the shortest times in which the excitations of a scene change."""
    own = [part for part in scene.excitations if not isinstance(part, Constant | Harmonic)]
    turns = _TURNS * 2 * math.pi / scene.natural_frequency
    found = [_changes(part, turns if math.isinf(part.period or math.inf) else math.inf) for part in own]
    return Changes(*(min(times) for times in zip(*found, strict=True))) if found else Changes(math.inf, math.inf)


@functools.lru_cache(maxsize=64)
def _changes(part: Excitation, longest: float) -> Changes:
    """Measure one excitation over its period: a pulse is what an opening or a closing of its width removes."""
    repeats, window = math.isinf(longest), min(part.period or math.inf, longest)
    field = VectorField(Scene(natural_frequency=1.0, damping_ratio=0.0, excitations=(part,)))
    spacing = window / _SAMPLES
    force = np.nan_to_num([field.excitation(0, spacing * sample) for sample in range(_SAMPLES)])
    size = float(np.ptp(force))
    if not size > 0.0:
        return Changes(math.inf, math.inf)
    steepest = np.abs(np.diff(force, append=force[0] if repeats else force[-1])).max()
    width = bisect.bisect_left(_WIDTHS, True, key=lambda width: _removes(width, force, _LEAST * size, repeats))
    pulse = _WIDTHS[width] * spacing if width < len(_WIDTHS) else math.inf
    return Changes(pulse, float(size / steepest) * spacing)


def _removes(width: int, force: NDArray[np.float64], least: float, repeats: bool) -> bool:
    """Whether pulses are narrower than some samples: whether an opening or a closing of that width changes the force.

    At the ends of a force that does not repeat nothing is known of it.
    """
    peaks, dips = force - grey_opening(force, width, mode="wrap"), grey_closing(force, width, mode="wrap") - force
    changed = np.maximum(peaks, dips)
    return bool((changed if repeats else changed[width:-width]).max() > least)

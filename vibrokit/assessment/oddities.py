"""Oddities: unusual numbers of a scene, as codes with values. All sentences are defined here."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from vibrokit.results.codes import Sentenced


class OddityCode(Sentenced):
    """Kinds of oddities. Each code has a sentence, a template of the oddity's values."""

    NATURAL_FREQUENCY_IN_HZ = (
        "natural-frequency-in-hz",
        "The forcing is at {ratio:.3g} times the natural frequency, and at {other:.3g} times it if that was given in "
        "Hz: frequencies are in rad/s, 2π times those in Hz.",
    )
    FORCING_IN_HZ = (
        "forcing-in-hz",
        "The forcing is at {ratio:.3g} times the natural frequency, and at {other:.3g} times it if the forcing was "
        "given in Hz: frequencies are in rad/s, 2π times those in Hz.",
    )
    FREQUENCY_FAR = (
        "frequency-far", "The forcing is at {ratio:.3g} times the natural frequency: check the units of both.",
    )  # fmt: skip
    HEAVY_DAMPING = (
        "heavy-damping",
        "The damping ratio is {ratio:.3g}: it is a fraction of critical damping, so that 2 % is 0.02.",
    )
    AMPLITUDE_SMALL = (
        "amplitude-small",
        "The forced amplitude is {ratio:.2g} of the gap to the {side} stop: lengths are in m, and forces are divided "
        "by the mass.",
    )
    AMPLITUDE_LARGE = (
        "amplitude-large",
        "The forced amplitude is {ratio:.3g} times the gap to the {side} stop: lengths are in m, and forces are "
        "divided by the mass.",
    )
    MISSING_SIGN = (
        "missing-sign",
        "The mass rests {depth:.3g} m inside the {side} stop, at {position:.4g} m; at {mirrored:.4g} m it would clear "
        "it: positions of stops on either side of x = 0 have opposite signs.",
    )
    PRELOADED = (
        "preloaded", "The mass rests {depth:.3g} m inside the {side} stop, at {position:.4g} m: the stop is preloaded.",
    )  # fmt: skip
    STOP_SOFT = (
        "stop-soft",
        "A contact with the {side} stop lasts {ratio:.3g} half periods of the free oscillation: the stop is softer "
        "than the spring. Its stiffness is divided by the mass, in SI units.",
    )
    CONTACT_BRIEF = (
        "contact-brief",
        "A contact with the {side} stop lasts {ratio:.2g} of a period: integration needs very short steps. Check the "
        "unit of its stiffness.",
    )
    NO_CLEAR_STATE = (
        "no-clear-state",
        "Without contact the forced motion would be {ratio:.4g} times the gap to the {side} stop: no steady state runs "
        "clear of the stops, whatever the noise. The force or the clearance decides this.",
    )
    NOISE_STRONG = (
        "noise-strong",
        "The noise alone moves the mass by {ratio:.3g} times the gap to the {side} stop (rms): no state lasts. D is in "
        "m² s⁻³, half of the one-sided spectral density of the acceleration.",
    )
    NOISE_WEAK = (
        "noise-weak",
        "ΔU/D of the first contact with the {side} stop is {ratio:.3g}: noise never leads to it. D is in m² s⁻³, half "
        "of the one-sided spectral density of the acceleration.",
    )


@dataclasses.dataclass(frozen=True)
class Oddity:
    """One odd number of a scene; ``str(oddity)`` is its sentence."""

    code: OddityCode
    values: Mapping[str, float | str]

    def __str__(self) -> str:
        return self.code.sentence.format(**self.values)

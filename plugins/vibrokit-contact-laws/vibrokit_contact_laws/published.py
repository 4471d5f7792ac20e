"""Published laws of hysteresis damping: a factor of the nominal restitution e each.

The factors are as reviews and public programs quote them, among them programs after M. Machado, P. Moreira, P. Flores
and H. M. Lankarani, "Compliant contact force models in multibody dynamics: evolution of the Hertz contact theory",
*Mechanism and Machine Theory* 53 (2012) 99–121. None of the papers cited here was read in the original. What each law
rebounds with was computed here.
"""

from __future__ import annotations

from typing import Any

from vibrokit.parts.functions import exp
from vibrokit_contact_laws.hysteresis import HysteresisLaw


class HerbertMcWhannell(HysteresisLaw):
    """Herbert and McWhannell's law: k δ^n (1 + a δ′/v), a = 6 (1 − e)/((2e − 1)² + 3).

    The nominal e = 0.9, 0.7, 0.5, 0.3 rebound with 0.901, 0.723, 0.594, 0.520; none with less than 0.488.
    Parameters and methods: `HysteresisLaw`.

    References
    ----------
    R. G. Herbert and D. C. McWhannell, "Shape and frequency composition of pulses from an impact pair", *Journal of
    Engineering for Industry* 99 (1977) 513–518; not read in the original.
    """

    @staticmethod
    def factor(e: Any) -> Any:
        """6 (1 − e)/((2e − 1)² + 3)."""
        return 6 * (1 - e) / ((2 * e - 1) ** 2 + 3)


class LeeWang(HysteresisLaw):
    """Lee and Wang's law: k δ^n (1 + a δ′/v), a = 3/4 (1 − e).

    The nominal e = 0.9, 0.7, 0.5, 0.3 rebound with 0.952, 0.869, 0.799, 0.739; none with less than 0.663. Even for e
    near 1 it loses half of what it should.
    Parameters and methods: `HysteresisLaw`.

    References
    ----------
    T. W. Lee and A. C. Wang, "On the dynamics of intermittent-motion mechanisms. Part 1: Dynamic model and response",
    *Journal of Mechanisms, Transmissions, and Automation in Design* 105 (1983) 534–540; not read in the original.
    """

    @staticmethod
    def factor(e: Any) -> Any:
        """3/4 (1 − e)."""
        return 3 * (1 - e) / 4


class LankaraniNikravesh(HysteresisLaw):
    """Lankarani and Nikravesh's law: k δ^n (1 + a δ′/v), a = 3/4 (1 − e²).

    The nominal e = 0.9, 0.7, 0.5, 0.3 rebound with 0.913, 0.796, 0.725, 0.684; none with less than 0.663.
    Parameters and methods: `HysteresisLaw`.

    References
    ----------
    H. M. Lankarani and P. E. Nikravesh, "A contact force model with hysteresis damping for impact analysis of
    multibody systems", *Journal of Mechanical Design* 112 (1990) 369–376; not read in the original.
    """

    @staticmethod
    def factor(e: Any) -> Any:
        """3/4 (1 − e²)."""
        return 3 * (1 - e**2) / 4


class Gonthier(HysteresisLaw):
    """The law of Gonthier, McPhee, Lange and Piedbœuf: k δ^n (1 + a δ′/v), a ≈ (1 − e²)/e.

    The nominal e = 0.9, 0.7, 0.5, 0.3 rebound with 0.876, 0.670, 0.488, 0.304. For e near 1 it loses 4/3 of what it
    should. This explicit factor approximates the a of (1 + a)/(1 − a e) = exp(a (1 + e)), which `from_restitution`
    solves.
    Parameters and methods: `HysteresisLaw`.

    References
    ----------
    Y. Gonthier, J. McPhee, C. Lange and J.-C. Piedbœuf, "A regularized contact model with asymmetric damping and
    dwell-time dependent friction", *Multibody System Dynamics* 11 (2004) 209–233; not read in the original.
    """

    @staticmethod
    def factor(e: Any) -> Any:
        """(1 − e²)/e."""
        return (1 - e**2) / e


class ZhiyingQishao(HysteresisLaw):
    """The law of Qin Zhiying and Lu Qishao: k δ^n (1 + a δ′/v), a = 3/4 (1 − e²) exp(2 (1 − e)).

    The nominal e = 0.9, 0.7, 0.5, 0.3 rebound with 0.896, 0.680, 0.483, 0.327; none with less than 0.179.
    Parameters and methods: `HysteresisLaw`.

    References
    ----------
    Z. Qin and Q. Lu, "Analysis of impact process model based on restitution coefficient", *Journal of Dynamics and
    Control* 4 (2006) 294–298, in Chinese; not read in the original.
    """

    @staticmethod
    def factor(e: Any) -> Any:
        """3/4 (1 − e²) exp(2 (1 − e))."""
        return 3 * (1 - e**2) * exp(2 * (1 - e)) / 4


class Flores(HysteresisLaw):
    """The law of Flores, Machado, Silva and Martins: k δ^n (1 + a δ′/v), a = 8/5 (1 − e)/e.

    The nominal e = 0.9, 0.7, 0.5, 0.3 rebound with 0.894, 0.683, 0.470, 0.256.
    Parameters and methods: `HysteresisLaw`.

    References
    ----------
    P. Flores, M. Machado, M. T. Silva and J. M. Martins, "On the continuous contact force models for soft materials in
    multibody dynamics", *Multibody System Dynamics* 25 (2011) 357–375; not read in the original.
    """

    @staticmethod
    def factor(e: Any) -> Any:
        """8/5 (1 − e)/e."""
        return 8 * (1 - e) / (5 * e)


class HuGuo(HysteresisLaw):
    """Hu and Guo's law: k δ^n (1 + a δ′/v), a = 3/2 (1 − e)/e.

    The nominal e = 0.9, 0.7, 0.5, 0.3 rebound with 0.900, 0.697, 0.488, 0.271. Public programs differ in the factor:
    some have half of it, 3/4 (1 − e)/e, which would rebound with 0.947, 0.823, 0.663, 0.446. Of the two, only the one
    here loses what it should for e near 1.
    Parameters and methods: `HysteresisLaw`.

    References
    ----------
    S. Hu and X. Guo, "A dissipative contact force model for impact analysis in multibody dynamics", *Multibody System
    Dynamics* 35 (2015) 131–151; not read in the original.
    """

    @staticmethod
    def factor(e: Any) -> Any:
        """3/2 (1 − e)/e."""
        return 3 * (1 - e) / (2 * e)

"""Verdicts: whether two methods agree on one exit, or on one state's share of time, as codes with numbers."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Annotated

from vibrokit.comparison.quantities import Kind
from vibrokit.documented import documented
from vibrokit.results.codes import Sentenced
from vibrokit.results.labels import exit_between
from vibrokit.results.rated import HELD, METASTABLE


class Agreement(Sentenced):
    """Codes of verdicts, the serious ones last; each has a template of its sentence."""

    AGREE = "agree", "{one} and {other} agree in {what}: {tested}. The least combined error is {error:.2g}{unit}."
    """The differences are explained by the stated errors."""
    ARRHENIUS_NOT_REACHED = (
        "arrhenius-not-reached",
        "The slopes of {other} still drift, from {first:.4g} to {last:.4g} m² s⁻³ as D falls, towards the ΔU = "
        "{energy:.5g} of {one}. Its limit for D → 0 misses that by {deviation:.1f} errors and is not ΔU yet: {remedy}. "
        "Its mean times are not affected.",
    )
    """The limit of rates misses the energy, and the slopes drift towards it as D falls, far enough to explain that."""
    NOT_METASTABLE = (
        "not-metastable",
        "{one} and {other} cannot be compared in {what}, since source or target is no state of its own at these noise "
        "intensities: {reason}. Rates describe exits from metastable states only, which need a lower noise intensity.",
    )
    """At no common noise intensity are source and target both metastable."""
    EVENTS_DIFFER = (
        "events-differ",
        "{one} and {other} count different events ({event_one}; {event_other}), so that their numbers differ by "
        "definition: give both the same exit.",
    )
    """The methods count different events, so that their numbers cannot be compared."""
    UNDER_RESOLVED = (
        "under-resolved",
        "{reason}, so that {one} and {other} cannot be compared in {what}: {remedy} of {less_certain}.",
    )
    """A method has no number with bounds, or the errors are as large as the number itself."""
    DISAGREE = (
        "disagree",
        "{one} and {other} disagree in {what}: {tested}. {less_certain} has the larger error: {remedy} there first.",
    )
    """The differences are too large for the stated errors."""


@documented
@dataclasses.dataclass(frozen=True)
class Verdict:
    """Whether two methods agree on one exit, or on the share of one state; NaN or empty where nothing applies."""

    code: Annotated[Agreement, "verdict"]
    kind: Annotated[Kind, "what was compared: mean times at common intensities, energies or shares"]
    source: Annotated[int, "label of the attractor that is left, or whose share it is"]
    target: Annotated[int | None, "label of what is reached, as in `Quantity`"]
    one: Annotated[str, "one method"]
    other: Annotated[str, "other method"]
    statistic: Annotated[float, "sum of squared differences over combined errors"] = math.nan
    terms: Annotated[int, "number of its terms: common intensities, or 1"] = 0
    p_value: Annotated[float, "probability of a larger sum, if all errors are normal and independent"] = math.nan
    deviation: Annotated[float, "largest difference, one less other, in combined errors"] = math.nan
    intensity: Annotated[float, "noise intensity D of the largest difference; NaN for an energy", "m2 s-3"] = math.nan
    error: Annotated[float, "least combined standard error of ΔU, of ln τ, or of ln of the odds", ""] = math.nan
    less_certain: Annotated[str, "method with the larger error, or without a number"] = ""
    remedy: Annotated[str, "setting of that method to change first"] = ""
    first: Annotated[float, "where slopes drift, the first one, D descending", "m2 s-3"] = math.nan
    last: Annotated[float, "where slopes drift, the last one", "m2 s-3"] = math.nan
    energy: Annotated[float, "energy that the slopes tend to", "m2 s-3"] = math.nan
    relaxations: Annotated[float, "where a state is not metastable, its mean time in relaxation times"] = math.nan
    core_share: Annotated[float, "where a state is not metastable, the share of its core in its basin"] = math.nan
    event_one: Annotated[str, "what counts as an exit for one method, where they differ"] = ""
    event_other: Annotated[str, "what counts as an exit for the other method"] = ""

    def about(self, names: Sequence[str]) -> str:
        """Return what the verdict is about: an exit, or the share of a state."""
        if self.kind is Kind.OCCUPANCY:
            return f"share of {names[self.source]}"
        return exit_name(names, self.source, self.target)

    def sentence(self) -> str:
        """Return the verdict as a sentence."""
        words = {
            **dataclasses.asdict(self),
            "what": _NOUNS[self.kind],
            "tested": self._tested,
            "unit": _UNITS[self.kind],
            "reason": self._reason,
        }
        return self.code.sentence.format(**{**words, "deviation": abs(self.deviation)})

    @property
    def _tested(self) -> str:
        if self.terms == 1:
            at = "" if math.isnan(self.intensity) else f" at D = {self.intensity:g}"
            return f"they differ by {abs(self.deviation):.1f} combined errors{at} (p = {self.p_value:.2g})"
        return (
            f"at {self.terms} noise intensities they differ by at most {abs(self.deviation):.1f} combined errors, at "
            f"D = {self.intensity:g} (χ² = {self.statistic:.3g}, p = {self.p_value:.2g})"
        )

    @property
    def _reason(self) -> str:
        if self.code is Agreement.UNDER_RESOLVED and self.terms:
            return "The errors are as large as the number"
        if self.code is Agreement.UNDER_RESOLVED:
            return f"{self.less_certain} has no number with bounds"
        parts = []
        if self.relaxations < METASTABLE:
            parts.append(f"it is left after {self.relaxations:.2g} relaxation times, below {METASTABLE:g}")
        if self.core_share < HELD:
            ellipse = "of the ellipse of one standard deviation about it lies in its own basin"
            parts.append(f"{self.core_share:.0%} {ellipse}, below {HELD:.0%}")
        return " and ".join(parts) or "too few intensities are left"


_UNITS = {Kind.ENERGY: " m² s⁻³", Kind.LOG_TIME: " in ln τ", Kind.OCCUPANCY: " in ln of the odds"}
_NOUNS = {Kind.ENERGY: "ΔU", Kind.LOG_TIME: "mean times", Kind.OCCUPANCY: "the share of time"}


def exit_name(names: Sequence[str], source: int, target: int | None) -> str:
    """Return the name of an exit; of leaving at all if the target is None."""
    return f"{names[source]} → any" if target is None else exit_between(names, source, target)

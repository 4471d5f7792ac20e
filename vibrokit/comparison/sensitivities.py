"""Effect of 1 % of each parameter on an activation energy and on the mean time."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Annotated

from vibrokit.arguments import members
from vibrokit.documented import documented
from vibrokit.errors import ParameterError, StructureError, nearest, shown
from vibrokit.results.energy import ActivationEnergy
from vibrokit.text_table import number_text, text_table

_INTENSITY = "noise.intensity"


@documented
@dataclasses.dataclass(frozen=True)
class Sensitivity:
    """The effect of 1 % more of one parameter, or of several parameters together.

    The mean time changes by the factor exp(ΔU/D) at the noise intensity D; the change of its prefactor is neglected.
    """

    parameter: Annotated[str, "its path, or a name for several"]
    energy: Annotated[float, "change of ΔU (%), to first order: the exponent of the power with which ΔU grows"]
    energy_error: Annotated[float, "error of that change"]
    time: Annotated[float, "change of the mean time (%); NaN without an intensity"]
    time_error: Annotated[float, "error of that change"]


def sensitivities(
    energy: ActivationEnergy,
    parameters: Mapping[str, object],
    intensity: float | None = None,
    tied: Mapping[str, Sequence[str]] | None = None,
) -> tuple[Sensitivity, ...]:
    """Return the effect of 1 % more of each parameter, and of `twins` together, the largest first.

    Parameters
    ----------
    energy : ActivationEnergy
        Of a polished path.
    parameters : mapping of str to value
        As ``osc.parameters``.
    intensity : float, optional
        D (m² s⁻³), at which mean times are compared.
    tied : mapping of str to sequence of str, optional
        Parameters that change together, by a name for them: ``{"gaps": ("barriers.0.position",
        "barriers.1.position")}``.

    Raises
    ------
    ParameterError
        `tied` is not such a mapping.
    StructureError
        The energy has no sensitivities or is 0, or a name in `tied` is not one of its parameters.
    """
    if not energy.sensitivity or not energy.value > 0:
        raise StructureError("the energy has no sensitivities; those of LeastAction with a polished path have them.")
    groups: dict[str, tuple[str, ...]] = {name: (name,) for name in energy.sensitivity}
    if not isinstance(tied, Mapping | None):
        raise ParameterError(f"tied must be a mapping of a name to names of parameters, got {shown(tied)}.")
    given = {frozenset(each) for each in (tied or {}).values() if members(each)}
    of_energy = {name: parameters[name] for name in energy.sensitivity if name in parameters}
    groups |= {name: each for name, each in twins(of_energy).items() if frozenset(each) not in given}
    for name, each in (tied or {}).items():
        own = members(each)
        if not own:
            raise ParameterError(f"tied: {shown(name)} must be a sequence of names of parameters, got {shown(each)}.")
        groups[name] = own
    for name in {one for each in groups.values() for one in each}:
        if name not in energy.sensitivity or name not in parameters:
            raise StructureError(f"the energy has no sensitivity in {name!r}{nearest(name, energy.sensitivity)}")
    depth = energy.value / intensity if intensity else math.nan
    found = []
    for name, listed in groups.items():
        power = sum(_scaled(energy.sensitivity, parameters, one) for one in listed) / energy.value
        error = sum(abs(_scaled(energy.sensitivity_error, parameters, one)) for one in listed) / energy.value
        per_cent = 0.01 * power - (1 - 1 / 1.01 if _INTENSITY in listed else 0.0)
        time = _growth(depth * per_cent)
        time_error = (100 + time) * abs(depth) * 0.01 * error
        if power or _INTENSITY in listed:
            found.append(Sensitivity(name, power, error, time, time_error))
    return tuple(sorted(found, key=lambda one: -abs(one.energy)))


def twins(parameters: Mapping[str, object]) -> dict[str, tuple[str, ...]]:
    """Return the parameters that several parts share, such as the gaps of two stops, by a name with ``*``.

    Their paths differ in the number of the part, and their values at most in sign: ``"barriers.*.position"``.
    """
    alike: dict[tuple[str, float], list[str]] = {}
    for path, value in parameters.items():
        name = ".".join("*" if word.isdigit() else word for word in path.split("."))
        if name != path and isinstance(value, int | float) and value:
            alike.setdefault((name, abs(value)), []).append(path)
    return {name: tuple(paths) for (name, _), paths in alike.items() if len(paths) > 1}


def numbers_in(data: object, path: str = "") -> dict[str, float]:
    """Return every number of a scene as plain data by its path, as ``osc.parameters`` has it."""
    if isinstance(data, bool | str) or not isinstance(data, int | float | Mapping | Sequence):
        return {}
    if isinstance(data, int | float):
        return {path: float(data)}
    named = data.items() if isinstance(data, Mapping) else enumerate(data)
    return {
        place: number
        for name, part in named
        for place, number in numbers_in(part, f"{path}.{name}" if path else str(name)).items()
    }


def sensitivities_text(found: Sequence[Sensitivity]) -> str:
    """Return a table, a line for each parameter."""
    rows = [("1 % more of", "changes ΔU by (%)", "error", "the mean time by (%)", "error")]
    rows += [
        (one.parameter, f"{one.energy:+.3g}", f"{one.energy_error:.1g}", number_text(one.time, "+.3g"),
         number_text(one.time_error, ".1g"))
        for one in found
    ]  # fmt: skip
    return "\n".join(text_table(rows))


def _scaled(derivatives: Mapping[str, float], parameters: Mapping[str, object], name: str) -> float:
    value = parameters[name]
    return derivatives.get(name, math.nan) * value if isinstance(value, int | float) else 0.0


def _growth(exponent: float) -> float:
    """exp − 1 in per cent; infinite beyond the largest float."""
    return math.inf if exponent > 700 else 100 * math.expm1(exponent)

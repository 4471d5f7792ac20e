"""Attractors in a dataset, each with the evidence that it lasts: what structures and continuations have in common."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from vibrokit.errors import ResultFileError
from vibrokit.results.arrays import Arrays
from vibrokit.results.attractor import Attractor
from vibrokit.results.fields import (
    PLANE,
    STATE,
    BySide,
    Field,
    Length,
    Number,
    Series,
    Spectrum,
    Variable,
    Vectors,
    Whole,
    Word,
)
from vibrokit.results.survival import Survival
from vibrokit.results.table import Table

ATTRACTOR_FIELDS: Mapping[str, Field] = {
    "label": Whole("label of the attractor"),
    "name": Word("name of the attractor"),
    "kind": Word("kind of the attractor", known=("periodic", "quasiperiodic", "chaotic", "equilibrium", "limit cycle")),
    "period": Whole("period in forcing periods; 0 for motion that never repeats"),
    "duration": Number("time after which the motion repeats; NaN for motion that never repeats", "s"),
    "points": Vectors(Length("visit", "points on the section"), STATE),
    "orbit": Vectors(Length("orbit_sample", "samples of the orbit"), PLANE),
    "multipliers": Spectrum(Length("multiplier", "multipliers"), "multiplier of the section map over one orbit"),
    "exponents": Spectrum(  # −∞ where a multiplier is 0
        Length("exponent", "exponents"), "rate at which deviations grow", "s-1", finite=False
    ),
    "exponent_error": Number("standard error of a Lyapunov exponent", "s-1"),
    "hits": BySide("hits of each stop per orbit; per forcing period for motion that never repeats"),
    "peak_depth": BySide("largest depth past each stop", "m"),
    "peak_force": BySide("largest push of each stop", "m s-2"),
    "basin_fraction": Number("share of the region's cells that lead to the attractor", "1", 0.0, 1.0),
    "basin_fraction_error": Number("standard error of the share", "1", 0.0, 1.0),
    "residual": Number("distance between the first point and its image after one orbit"),
    "error": Number("change of the first point when the integration is tightened"),
}
SURVIVALS = Table(
    "survival",
    {
        "attractor": Whole("place of the attractor that it belongs to; -1 for the whole scene", low=-1),
        "stepper": Word("stepper of the integration"),
        "starts": Whole("number of starts"),
        "periods": Whole("forcing periods for which starts were followed"),
        "survivors": Whole("starts that had not settled by then"),
        "lifetime": Number("mean time until a start settles, in forcing periods"),
        "lifetime_error": Number("standard error of the lifetime, in forcing periods"),
        "settled_after": Series(
            Length("start", "starts"), "forcing periods until the start settled; -1 if it did not", whole=True, low=-1
        ),
    },
)


def attractor_variables(
    table: Table, attractors: Sequence[Attractor], others: Sequence[Survival] = ()
) -> dict[str, Variable]:
    """Return the arrays that hold attractors with their survivals, and other survivals that belong to none of them."""
    owned = [(place, one) for place, attractor in enumerate(attractors) for one in attractor.survival]
    owned += [(-1, one) for one in others]
    survivals = SURVIVALS.variables([one for _, one in owned], attractor=[place for place, _ in owned])
    return table.variables(attractors) | survivals


def read_attractors(arrays: Arrays, table: Table) -> tuple[tuple[Attractor, ...], tuple[Survival, ...]]:
    """Return attractors, each with its survivals, and the survivals that belong to none of them.

    Raises
    ------
    ResultFileError
        Something is missing, of another shape or kind, or contradicts the rest.
    """
    attractors = [Attractor(**values) for values in table.read(arrays)]
    owned: dict[int, list[Survival]] = {}
    for values in SURVIVALS.read(arrays):
        owner, survival = values.pop("attractor"), Survival(**values)
        if not (survival.survivors <= survival.starts == len(survival.settled_after)):
            raise ResultFileError(
                f"a survival has {survival.starts} starts, {survival.survivors} survivors and "
                f"{len(survival.settled_after)} times, which contradict one another"
            )
        if owner >= len(attractors):
            raise ResultFileError(f"a survival belongs to attractor {owner}, and there are {len(attractors)}")
        owned.setdefault(owner, []).append(survival)
    for attractor in attractors:
        count = len(attractor.points)
        if count == 0 or (attractor.kind == "periodic" and count != attractor.period):
            raise ResultFileError(f"a {attractor.kind} attractor of period {attractor.period} has {count} points")
    return (
        tuple(dataclasses.replace(one, survival=tuple(owned.get(k, ()))) for k, one in enumerate(attractors)),
        tuple(owned.get(-1, ())),
    )

"""Attractors in a file, each with the evidence that it lasts: what structures and continuations keep alike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from vibrokit.results.attractor import Attractor
from vibrokit.results.columns import BySide, Column, Draft, Number, Rows, Spectrum, Table, Whole, Wholes, Word
from vibrokit.results.content import Content, ResultFileError
from vibrokit.results.survival import Survival

ATTRACTOR_KINDS = ("periodic", "quasiperiodic", "chaotic", "equilibrium", "limit cycle")
ATTRACTOR_COLUMNS: Mapping[str, Column] = {
    "label": Whole(),
    "kind": Word(ATTRACTOR_KINDS),
    "period": Whole(),
    "duration": Number(),
    "points": Rows(),
    "orbit": Rows(2),
    "multipliers": Spectrum(finite=True),
    "exponents": Spectrum(finite=False),  # −∞ where a multiplier is 0
    "exponent_error": Number(),
    "hits": BySide(),
    "peak_depth": BySide(),
    "peak_force": BySide(),
    "basin_fraction": Number(0.0, 1.0),
    "basin_fraction_error": Number(0.0, 1.0),
    "residual": Number(),
    "error": Number(),
}
_SURVIVALS = Table(
    "survival",
    {
        "stepper": Word(),
        "starts": Whole(),
        "periods": Whole(),
        "survivors": Whole(),
        "lifetime": Number(),
        "lifetime_error": Number(),
        "settled_after": Wholes(-1),
    },
)
_PROOFS = "attractor_survival_count"  # survivals stand attractor by attractor, those that are of none of them last


def write_attractors(
    draft: Draft, table: Table, attractors: Sequence[Attractor], others: Iterable[Survival] = ()
) -> None:
    """Put attractors into a draft, with their survivals and others that belong to none of them."""
    table.write(draft, attractors)
    _SURVIVALS.write(draft, [*(some for attractor in attractors for some in attractor.survival), *others])
    draft.put(_PROOFS, ("attractor",), np.array([len(attractor.survival) for attractor in attractors], dtype=np.int64))


def read_attractors(content: Content, table: Table) -> tuple[tuple[Attractor, ...], tuple[Survival, ...]]:
    """Return attractors, each with its survivals, and the survivals that belong to none of them.

    Raises
    ------
    ResultFileError
        Something is missing, of another shape or kind, or contradicts the rest.
    """
    records = list(table.read(content))
    survivals = [Survival(**values) for values in _SURVIVALS.read(content)]
    for survival in survivals:
        if not (survival.survivors <= survival.starts == len(survival.settled_after)):
            raise ResultFileError(
                f"a survival has {survival.starts} starts, {survival.survivors} survivors and "
                f"{len(survival.settled_after)} times, which do not go together"
            )
    counts = content.wholes(_PROOFS, (len(records),), 0, len(survivals)) if records else np.empty(0, dtype=np.int64)
    cuts = np.cumsum(counts).tolist()
    if cuts and cuts[-1] > len(survivals):
        raise ResultFileError(f"its attractors claim {cuts[-1]} survivals; there are {len(survivals)}")
    own = [tuple(survivals[start:end]) for start, end in zip([0, *cuts], cuts, strict=False)]
    attractors = tuple(Attractor(**values, survival=some) for values, some in zip(records, own, strict=True))
    return attractors, tuple(survivals[cuts[-1] if cuts else 0 :])

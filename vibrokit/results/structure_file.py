"""Saves and opens structures."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vibrokit.errors import StructureError, shown
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import NOT_FOLLOWED, Basins
from vibrokit.results.columns import BySide, Column, Draft, Flag, Number, Rows, Spectrum, Table, Whole, Wholes, Word
from vibrokit.results.content import Content, ResultFileError, seed_of, taken, versions_of
from vibrokit.results.manifold import Manifold
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.results.structure import Structure
from vibrokit.results.survival import Survival
from vibrokit.results.writing import write_content

KIND = "structure"
ATTRACTOR_KINDS = ("periodic", "quasiperiodic", "chaotic", "equilibrium", "limit cycle")
SADDLE_KINDS = ("saddle", "flip saddle", "repeller", "chaotic")
_OF_STRUCTURE = -1  # in place of an attractor, where a survival is the structure's own

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
_ATTRACTORS = Table("attractor", ATTRACTOR_COLUMNS)
_SADDLES = Table(
    "saddle",
    {
        "kind": Word(SADDLE_KINDS),
        "period": Whole(),
        "duration": Number(),
        "points": Rows(),
        "multipliers": Spectrum(finite=True),
        "exponents": Spectrum(finite=False),
        "leads_to": Wholes(NOT_FOLLOWED),
        "residual": Number(),
        "error": Number(),
    },
)
_MANIFOLDS = Table(
    "manifold",
    {"saddle": Whole(), "point": Whole(), "stable": Flag(), "side": Whole(-1, 1), "curve": Rows(2), "status": Word()},
)
SURVIVALS = Table(
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
_PROOFS = "attractor_survival_count"  # survivals stand attractor by attractor, those of the structure itself last


def save_structure(structure: Structure, path: str | os.PathLike[str]) -> None:
    """Write a structure to a netCDF file, whole or not at all; `vibrokit.load_result` opens it."""
    draft = Draft()
    _ATTRACTORS.write(draft, structure.attractors)
    _SADDLES.write(draft, structure.saddles)
    _MANIFOLDS.write(draft, structure.manifolds)
    proofs = [attractor.survival for attractor in structure.attractors]
    SURVIVALS.write(draft, [survival for some in (*proofs, structure.survival) for survival in some])
    draft.put(_PROOFS, ("attractor",), np.array([len(some) for some in proofs]))
    draft.put("region", ("axis", "bound"), structure.basins.region.bounds)
    draft.put("basin", ("cell_x", "cell_v"), structure.basins.labels)
    draft.header.update(
        kind=KIND,
        settling=float(structure.settling),
        budget=int(structure.budget),
        stepper=structure.stepper,
        complete=bool(structure.complete),
        status=structure.status,
        scene=dict(structure.scene),
        seed=None if structure.seed is None else str(structure.seed),
        seconds=float(structure.seconds),
        versions=dict(structure.versions),
    )
    write_content(Path(path), draft.arrays, draft.header)


def read_structure(content: Content) -> Structure:
    """Make a structure of the content of a file.

    Raises
    ------
    ResultFileError
        Something is missing, of another shape or kind, or contradicts the rest.
    """
    header = content.header
    attractors, survival = _attractors(content)
    saddles = tuple(Saddle(**values) for values in _SADDLES.read(content))
    saddles = tuple(dataclasses.replace(saddle, leads_to=tuple(map(int, saddle.leads_to))) for saddle in saddles)
    for saddle in saddles:
        if any(label >= len(attractors) for label in saddle.leads_to):
            raise ResultFileError(f"a saddle leads to {saddle.leads_to}, and there are {len(attractors)} attractors")
    _check_points(attractors, saddles)
    return Structure(
        attractors=attractors,
        saddles=saddles,
        manifolds=_manifolds(content, saddles),
        basins=_basins(content, len(attractors)),
        survival=survival,
        settling=taken(header, "settling", float),
        budget=taken(header, "budget", int),
        stepper=taken(header, "stepper", str),
        complete=taken(header, "complete", bool),
        status=taken(header, "status", str),
        scene=_scene(header),
        seed=seed_of(header),
        seconds=taken(header, "seconds", float),
        versions=versions_of(header),
    )


def _attractors(content: Content) -> tuple[tuple[Attractor, ...], tuple[Survival, ...]]:
    """Attractors, each with its evidence, and the evidence that is the structure's own."""
    records = list(_ATTRACTORS.read(content))
    survivals = [Survival(**values) for values in SURVIVALS.read(content)]
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
    for place, attractor in enumerate(attractors):
        if attractor.label != place:
            raise ResultFileError(f"attractor {place} has label {attractor.label}; the two must be the same")
    return attractors, tuple(survivals[cuts[-1] if cuts else 0 :])


def _check_points(attractors: Sequence[Attractor], saddles: Sequence[Saddle]) -> None:
    orbits: tuple[Attractor | Saddle, ...] = (*attractors, *saddles)
    for orbit in orbits:
        count, width = orbit.points.shape
        if count == 0 or width < 2:
            raise ResultFileError(f"a {orbit.kind} state has points of shape {orbit.points.shape}")
        if orbit.kind == "periodic" and count != orbit.period:
            raise ResultFileError(f"an orbit of period {orbit.period} has {count} points")


def _manifolds(content: Content, saddles: Sequence[Saddle]) -> tuple[Manifold, ...]:
    manifolds = tuple(Manifold(**values) for values in _MANIFOLDS.read(content))
    for manifold in manifolds:
        known = manifold.saddle < len(saddles) and manifold.point < len(saddles[manifold.saddle].points)
        if not known or manifold.side == 0:
            raise ResultFileError(
                f"a manifold is said to start on side {manifold.side} of point {manifold.point} of saddle "
                f"{manifold.saddle}, which is not there"
            )
    return manifolds


def _basins(content: Content, attractors: int) -> Basins:
    low, high = content.numbers("region", (2, 2)).T.tolist()
    try:
        region = Region((low[0], high[0]), (low[1], high[1]))
    except StructureError as error:
        raise ResultFileError(f"its {error}") from error
    highest = min(attractors - 1, np.iinfo(np.int16).max)
    labels = content.wholes("basin", (None, None), NOT_FOLLOWED, highest, dtype=np.int16)
    return Basins(region, labels.astype(np.int16, copy=False))


def _scene(header: Mapping[str, Any]) -> dict[str, Any]:
    """The scene; its stops are looked at, for pictures show them."""
    scene = taken(header, "scene", dict)
    for barrier in taken(scene, "barriers", list) if "barriers" in scene else ():
        taken(barrier, "position", float)
        if taken(barrier, "side", str) not in ("left", "right"):
            raise ResultFileError(f"its scene has a stop on side {shown(barrier['side'])}")
    return scene

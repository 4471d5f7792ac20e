"""Saves and opens structures."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vibrokit.errors import shown
from vibrokit.results.attractor import Attractor
from vibrokit.results.attractor_file import ATTRACTOR_COLUMNS, read_attractors, write_attractors
from vibrokit.results.basins import NOT_FOLLOWED, Basins
from vibrokit.results.columns import Draft, Flag, Number, Rows, Spectrum, Table, Whole, Wholes, Word
from vibrokit.results.content import Content, ResultFileError, region_of, seed_of, taken, versions_of
from vibrokit.results.manifold import Manifold
from vibrokit.results.saddle import Saddle
from vibrokit.results.structure import Structure
from vibrokit.results.writing import write_content

KIND = "structure"
SADDLE_KINDS = ("saddle", "flip saddle", "repeller", "chaotic")
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


def save_structure(structure: Structure, path: str | os.PathLike[str]) -> None:
    """Write a structure to a netCDF file, whole or not at all; `vibrokit.load_result` opens it."""
    draft = Draft()
    write_attractors(draft, _ATTRACTORS, structure.attractors, structure.survival)
    _SADDLES.write(draft, structure.saddles)
    _MANIFOLDS.write(draft, structure.manifolds)
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
    attractors, survival = read_attractors(content, _ATTRACTORS)
    for place, attractor in enumerate(attractors):
        if attractor.label != place:
            raise ResultFileError(f"attractor {place} has label {attractor.label}; the two must be the same")
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
    highest = min(attractors - 1, np.iinfo(np.int16).max)
    labels = content.wholes("basin", (None, None), NOT_FOLLOWED, highest, dtype=np.int16)
    return Basins(region_of(content), labels.astype(np.int16, copy=False))


def _scene(header: Mapping[str, Any]) -> dict[str, Any]:
    """The scene; its stops are looked at, for pictures show them."""
    scene = taken(header, "scene", dict)
    for barrier in taken(scene, "barriers", list) if "barriers" in scene else ():
        taken(barrier, "position", float)
        if taken(barrier, "side", str) not in ("left", "right"):
            raise ResultFileError(f"its scene has a stop on side {shown(barrier['side'])}")
    return scene

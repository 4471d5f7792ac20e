"""Activation energies in a file, with their paths and certificates."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence

import numpy as np

from vibrokit.results.certificate import Certificate
from vibrokit.results.columns import Draft
from vibrokit.results.content import Content, ResultFileError, texts
from vibrokit.results.energy import ActivationEnergy, ExitPath

RESERVED = re.compile(r"(energy|branch|transition)_|path\d+_")
"""How arrays of results begin that are none of their `data`."""

_NUMBERS = ("value", "lower", "upper", "residual")
_EVIDENCE = tuple(field.name for field in dataclasses.fields(Certificate))
_INT32 = np.iinfo(np.int32)


@dataclasses.dataclass(frozen=True)
class EnergyColumns:
    """Names under which a list of activation energies stands in a file.

    Attributes
    ----------
    record : str
        Goes before the name of each array.
    paths : str
        Goes before the number of each path.
    methods : str
        Entry of the header.
    """

    record: str
    paths: str
    methods: str

    def write(self, draft: Draft, energies: Sequence[ActivationEnergy]) -> None:
        """Put energies into a draft."""
        for name in ("source", "target", "saddle"):
            values = np.array([getattr(energy, name) for energy in energies], dtype=np.int64)
            draft.put(f"{self.record}_{name}", (self.record,), values)
        for name in _NUMBERS:
            values = np.array([getattr(energy, name) for energy in energies], dtype=float)
            draft.put(f"{self.record}_{name}", (self.record,), values)
        certified = np.array([energy.certificate is not None for energy in energies], dtype=np.int8)
        draft.put(f"{self.record}_certified", (self.record,), certified)
        for name in _EVIDENCE if certified.any() else ():
            evidence = [np.nan if e.certificate is None else getattr(e.certificate, name) for e in energies]
            draft.put(f"{self.record}_certificate_{name}", (self.record,), np.array(evidence, dtype=float))
        draft.header[self.methods] = [energy.method for energy in energies]
        for index, energy in enumerate(energies):
            if energy.path is not None:
                _write_path(draft, f"{self.paths}{index}_", energy.path)

    def read(self, content: Content) -> tuple[ActivationEnergy, ...]:
        """Return the energies of a file.

        Raises
        ------
        ResultFileError
            Something is missing, of another shape or kind, or contradicts the rest.
        """
        methods = texts(content.header, self.methods)
        if not methods:
            return ()
        shape = (len(methods),)
        source, target = (
            content.wholes(f"{self.record}_{name}", shape, low, _INT32.max).tolist()
            for name, low in (("source", 0), ("target", _INT32.min))
        )
        saddle = self._saddles(content, len(methods))
        value, lower, upper, residual = (
            content.numbers(f"{self.record}_{name}", shape, finite=False).tolist() for name in _NUMBERS
        )
        certificates = self._certificates(content, len(methods))
        return tuple(
            ActivationEnergy(
                source=source[index],
                target=target[index],
                value=value[index],
                lower=lower[index],
                upper=upper[index],
                method=method,
                residual=residual[index],
                path=_read_path(content, f"{self.paths}{index}_"),
                saddle=saddle[index],
                certificate=certificates[index],
            )
            for index, method in enumerate(methods)
        )

    def _saddles(self, content: Content, count: int) -> list[int]:
        name = f"{self.record}_saddle"
        if name not in content.dataset.variables:  # in files from before there were any
            return [-1] * count
        return content.wholes(name, (count,), -1, _INT32.max).tolist()

    def _certificates(self, content: Content, count: int) -> list[Certificate | None]:
        name = f"{self.record}_certified"
        if name not in content.dataset.variables:
            return [None] * count
        certified = content.wholes(name, (count,), 0, 1)
        if not certified.any():
            return [None] * count
        evidence = [
            content.numbers(f"{self.record}_certificate_{name}", (count,), finite=False).tolist() for name in _EVIDENCE
        ]
        rows = zip(certified, zip(*evidence, strict=True), strict=True)
        return [Certificate(*numbers) if flag else None for flag, numbers in rows]


ENERGIES = EnergyColumns("energy", "path", "methods")
BRANCHES = EnergyColumns("branch", "branch_path", "branch_methods")


def _write_path(draft: Draft, prefix: str, path: ExitPath) -> None:
    sample, state, section = f"{prefix}sample", f"{prefix}state", f"{prefix}section"
    draft.put(f"{prefix}t", (sample,), path.t)
    draft.put(f"{prefix}q", (sample, state), path.q)
    draft.put(f"{prefix}p", (sample, state), path.p)
    draft.put(f"{prefix}action", (sample,), path.action)
    draft.put(f"{prefix}on_section", (section,), path.section)


def _read_path(content: Content, prefix: str) -> ExitPath | None:
    if f"{prefix}t" not in content.dataset.variables:
        return None
    t = content.numbers(f"{prefix}t", (None,))
    state = content.numbers(f"{prefix}q", (len(t), None))
    momenta = content.numbers(f"{prefix}p", state.shape)
    if state.shape[1] < 2:
        raise ResultFileError(f"its array {prefix + 'q'!r} has shape {state.shape}, and x and v are needed")
    action = content.numbers(f"{prefix}action", (len(t),))
    if f"{prefix}on_section" not in content.dataset.variables:  # an empty array is left out
        return ExitPath(t, state, momenta, action, np.empty(0, dtype=np.int64))
    section = content.wholes(f"{prefix}on_section", (None,), 0, len(t) - 1)
    return ExitPath(t, state, momenta, action, section.astype(np.int64))

"""Checkpoints: arrays of long work in a file, from which it goes on with the same bits."""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import time
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import CheckpointError, reason
from vibrokit.results.atomic import write_atomically

_PAUSE = 2.0  # seconds between two writes, so that these take a small share of the time
_ABOUT = "about"  # the entry that says what the file belongs to


class Checkpoint:
    """The state of some work, by the names of its parts; kept in a file if there is a path.

    Parameters
    ----------
    path : Path or None
    about : mapping
        What the state belongs to, as plain data: scene, settings, seed, versions.

    Attributes
    ----------
    failure : str
        Why the file could not be written; empty if it could.
    parts : dict of str to dict of str to array
        The arrays of each part, by its name.
    written : float
        When the file was last written, by the monotonic clock (s).

    Raises
    ------
    CheckpointError
        The file is no checkpoint, is damaged, or belongs to other work.
    """

    def __init__(self, path: Path | None, about: Mapping[str, Any]) -> None:
        self.path = path
        self.failure = ""
        self._about = json.dumps(about, sort_keys=True, default=str)
        self.parts = self._read(path) if path is not None and path.exists() else {}
        self.written = time.monotonic()

    def slot(self, *key: object) -> Slot:
        """Return the place of one part."""
        return Slot(self, "/".join(map(str, key)))

    def flush(self) -> None:
        """Write the file, whole or not at all. A failure, as on a full disk, is kept as a text; the work goes on."""
        if self.path is None:
            return
        content = io.BytesIO()
        about = np.frombuffer(self._about.encode(), dtype=np.uint8)
        arrays = {f"{part}/{name}": array for part, some in self.parts.items() for name, array in some.items()}
        np.savez(content, allow_pickle=False, **{_ABOUT: about, **arrays})
        body = content.getvalue()
        try:
            write_atomically(self.path, hashlib.sha256(body).digest() + body)
        except OSError as error:
            self.failure = str(error)
        self.written = time.monotonic()

    def _read(self, path: Path) -> dict[str, dict[str, NDArray[Any]]]:
        try:
            content = path.read_bytes()
        except (OSError, ValueError) as error:
            raise CheckpointError(
                f"the checkpoint {path} cannot be read ({reason(error)}); choose another name."
            ) from error
        digest, body = content[:32], content[32:]
        if hashlib.sha256(body).digest() != digest:
            raise CheckpointError(f"{path} is no checkpoint, or it is damaged; choose another name, or delete it.")
        try:
            with np.load(io.BytesIO(body), allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
        except (ValueError, OSError, KeyError, zipfile.BadZipFile) as error:
            raise CheckpointError(f"{path} is no checkpoint ({error}); choose another name, or delete it.") from error
        found = arrays.pop(_ABOUT, np.empty(0, dtype=np.uint8)).tobytes().decode(errors="replace")
        if found != self._about:
            raise CheckpointError(
                f"the checkpoint {path} belongs to other work: {_difference(found, self._about)}; choose "
                "another name, or delete it."
            )
        parts: dict[str, dict[str, NDArray[Any]]] = {}
        for key, array in arrays.items():
            part, _, name = key.rpartition("/")
            parts.setdefault(part, {})[name] = array
        return parts


@dataclasses.dataclass(frozen=True, eq=False)
class Slot:
    """The place of one part of the work in a checkpoint."""

    checkpoint: Checkpoint
    name: str

    def inner(self, name: str) -> Slot:
        """Return the place of a part of this part."""
        return Slot(self.checkpoint, f"{self.name}/{name}")

    def read(self, names: Sequence[str]) -> dict[str, NDArray[Any]] | None:
        """Return the arrays that were kept; None if there are none with these names."""
        found = self.checkpoint.parts.get(self.name, {})
        return found if set(found) == set(names) else None

    def write(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep arrays in place of those before, and write the file if the last time is long ago."""
        self.checkpoint.parts[self.name] = dict(arrays)
        if time.monotonic() - self.checkpoint.written >= _PAUSE:
            self.checkpoint.flush()


def _difference(found: str, wanted: str) -> str:
    """Name what differs."""
    try:
        one, other = json.loads(found), json.loads(wanted)
        key = next(key for key in other if one.get(key) != other[key])
        if key == "settings":
            names = [name for name in other[key] if one[key].get(name) != other[key][name]]
            return f"the settings {', '.join(names)} differ" if len(names) > 1 else f"the setting {names[0]} differs"
    except (ValueError, AttributeError, KeyError, IndexError, StopIteration):
        return "it does not say which work it belongs to"
    return f"it has another {key}" if key != "versions" else "it was written by other versions"

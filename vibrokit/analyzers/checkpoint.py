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

    Raises
    ------
    CheckpointError
        The file is no checkpoint, is damaged, or belongs to other work.
    """

    def __init__(self, path: Path | None, about: Mapping[str, Any]) -> None:
        self.path = path
        self.failure = ""
        self._about = json.dumps(about, sort_keys=True, default=str)
        self._arrays: dict[str, NDArray[Any]] = {}
        self._written = time.monotonic()
        if path is not None and path.exists():
            self._arrays = self._read(path)

    def slot(self, *key: object) -> Slot:
        """Return the place of one part."""
        return Slot(self, "/".join(map(str, key)))

    def set(self, name: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep the arrays of one part in place of those before, and write the file if the last time is long ago."""
        self._arrays = {key: value for key, value in self._arrays.items() if key.rpartition("/")[0] != name}
        self._arrays |= {f"{name}/{key}": value for key, value in arrays.items()}
        if time.monotonic() - self._written >= _PAUSE:
            self.flush()

    def get(self, name: str) -> dict[str, NDArray[Any]]:
        """Return the arrays of one part; none if it is not known."""
        return {key.rpartition("/")[2]: array for key, array in self._arrays.items() if key.rpartition("/")[0] == name}

    def flush(self) -> None:
        """Write the file, whole or not at all. A failure, as on a full disk, is kept as a text; the work goes on."""
        if self.path is None:
            return
        content = io.BytesIO()
        about = np.frombuffer(self._about.encode(), dtype=np.uint8)
        np.savez(content, allow_pickle=False, **{_ABOUT: about, **self._arrays})
        body = content.getvalue()
        try:
            write_atomically(self.path, hashlib.sha256(body).digest() + body)
        except OSError as error:
            self.failure = str(error)
        self._written = time.monotonic()

    def _read(self, path: Path) -> dict[str, NDArray[Any]]:
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
        return arrays


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
        found = self.checkpoint.get(self.name)
        return found if set(found) == set(names) else None

    def write(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep arrays in place of those before."""
        self.checkpoint.set(self.name, arrays)


def _difference(found: str, wanted: str) -> str:
    """Name what differs."""
    try:
        one, other = json.loads(found), json.loads(wanted)
        for key in other:
            if one.get(key) != other[key] and key == "settings":
                names = [name for name in other[key] if one[key].get(name) != other[key][name]]
                return (
                    f"the settings {', '.join(names)} differ" if len(names) > 1 else f"the setting {names[0]} differs"
                )
            if one.get(key) != other[key]:
                return f"it has another {key}" if key != "versions" else "it was written by other versions"
    except (ValueError, AttributeError, KeyError, IndexError):
        pass
    return "what it was made for is not known"

"""Keeps generated modules on disk, next to what Numba compiled from them."""

from __future__ import annotations

import functools
import importlib.util
import os
import sys
import tempfile
import threading
import types
import warnings
from pathlib import Path

import platformdirs

CACHE_VARIABLE = "VIBROKIT_CACHE"


@functools.cache
def cache_directory() -> Path:
    """Return the folder of generated modules: ``$VIBROKIT_CACHE``, or the user's cache folder."""
    chosen = Path(os.environ.get(CACHE_VARIABLE) or platformdirs.user_cache_dir("vibrokit")) / "kernels"
    try:
        chosen.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=chosen):
            return chosen
    except OSError as error:
        other = Path(tempfile.mkdtemp(prefix="vibrokit-"))
        warnings.warn(
            f"cannot write compiled kernels to {chosen} ({error}); they go to {other}, and the next process compiles "
            f"them again. Set {CACHE_VARIABLE} to a folder that can be written.",
            stacklevel=2,
        )
        return other


def stored(name: str) -> str | None:
    """Return the text of a generated module, or None if it was never written here."""
    try:
        return (cache_directory() / f"{name}.py").read_text(encoding="utf-8")
    except OSError:
        return None


def store(name: str, text: str) -> None:
    """Write a generated module so that another process sees all of it or nothing.

    One that is there with the same text is left alone: Numba would compile a newer file again.
    """
    if stored(name) == text:
        return
    folder = cache_directory()
    with tempfile.NamedTemporaryFile("w", dir=folder, suffix=".tmp", delete=False, encoding="utf-8") as file:
        try:
            file.write(text)
            file.close()
            os.replace(file.name, folder / f"{name}.py")
        except BaseException:
            os.unlink(file.name)
            raise


def load(name: str, text: str) -> types.ModuleType:
    """Import a generated module, writing it first if this machine does not have it."""
    with _LOADING:  # otherwise threads that start together import it twice, and compile it twice
        if (name, text) not in _LOADED:
            _LOADED[name, text] = _imported(name, text)
        return _LOADED[name, text]


_LOADING = threading.Lock()
_LOADED: dict[tuple[str, str], types.ModuleType] = {}


def _imported(name: str, text: str) -> types.ModuleType:
    store(name, text)
    specification = importlib.util.spec_from_file_location(name, cache_directory() / f"{name}.py")
    if specification is None or specification.loader is None:
        raise ImportError(f"cannot import the generated kernel {name} from {cache_directory()}.")
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    return module

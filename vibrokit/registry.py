"""Entry points: parts, analyzers, exits and records by name, both built-in and from plug-ins."""

from __future__ import annotations

import importlib.metadata
import warnings
from collections.abc import Iterable
from enum import StrEnum
from importlib.metadata import EntryPoint
from typing import Any, NamedTuple, TypeVar, overload

from vibrokit.errors import UnknownNameError, nearest

BUILT_IN = "vibrokit"

T = TypeVar("T")


class Group(StrEnum):
    """Kinds of objects that a distribution may register; each value is the name of an entry-point group."""

    CONTACT_LAWS = "vibrokit.contact_laws"
    SPRINGS = "vibrokit.springs"
    FRICTIONS = "vibrokit.frictions"
    EXCITATIONS = "vibrokit.excitations"
    NOISE_MODELS = "vibrokit.noise_models"
    ANALYZERS = "vibrokit.analyzers"
    EXITS = "vibrokit.exits"
    RECORDS = "vibrokit.records"

    @property
    def noun(self) -> str:
        """Singular noun for one member, for messages."""
        return self.value.removeprefix("vibrokit.").removesuffix("s").replace("_", " ")


class Registered(NamedTuple):
    """A name and the distribution that registers it."""

    name: str
    distribution: str


def names(group: Group) -> tuple[Registered, ...]:
    """List the registered names without importing any class.

    If several distributions register one name, the one that `load` tries first is listed and a warning is issued.

    Parameters
    ----------
    group : Group

    Returns
    -------
    tuple of Registered
        Sorted by name.
    """
    return tuple(Registered(name, _origin(found[0])) for name, found in _candidates(group).items())


@overload
def load(group: Group, name: str) -> type: ...
@overload
def load(group: Group, name: str, kind: type[T]) -> type[T]: ...
def load(group: Group, name: str, kind: type = object) -> type:
    """Import the class that is registered under a name.

    If an entry point cannot be imported or is not a subclass of `kind`, a warning is issued and the next
    distribution that registers the name is tried.

    Parameters
    ----------
    group : Group
    name : str
    kind : type, optional
        Base class that the loaded class must have.

    Returns
    -------
    type

    Raises
    ------
    UnknownNameError
        No working class is registered under `name`.
    """
    candidates = _candidates(group, name)
    if name not in candidates:
        raise UnknownNameError(_unknown(group, name))
    loaded: type | None = _first_working(group, candidates[name], kind)
    if loaded is not None:
        return loaded
    origins = " and ".join(_origin(entry) for entry in candidates[name])
    raise UnknownNameError(
        f"The {group.noun} {name!r} of {origins} cannot be loaded; the warning above gives the reason."
    )


def load_all(group: Group, kind: type[T]) -> dict[str, type[T]]:
    """Import every class of a group; a broken entry point is skipped with a warning.

    Parameters
    ----------
    group : Group
    kind : type
        Base class that the loaded classes must have.

    Returns
    -------
    dict of str to type
        Sorted by name.
    """
    working: dict[str, type[T]] = {}
    for name, found in _candidates(group).items():
        loaded = _first_working(group, found, kind)
        if loaded is not None:
            working[name] = loaded
    return working


def name_of(group: Group, cls: type) -> str:
    """Return the registered name of a class, or ``module:Class`` if it is not registered."""
    place = f"{cls.__module__}:{cls.__qualname__}"
    entries = list(_entry_points(group))
    for entry in entries:
        if entry.value == place:
            return entry.name
    top = cls.__module__.partition(".")[0]
    for entry in entries:  # an entry point may name the class by a shorter path
        if entry.value.startswith((f"{top}.", f"{top}:")) and _first_working(group, [entry], cls) is cls:
            return entry.name
    return place


def _entry_points(group: str) -> Iterable[EntryPoint]:
    """Read the entry points of a group from the installation."""
    return importlib.metadata.entry_points(group=group)


def _origin(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist is not None else "an unnamed distribution"


def _candidates(group: Group, only: str | None = None) -> dict[str, list[EntryPoint]]:
    """Entry points by name, in the order in which they are tried; warns if a name has several."""
    found: dict[str, list[EntryPoint]] = {}
    ranked = sorted(_entry_points(group), key=lambda e: (e.name, _origin(e) != BUILT_IN, _origin(e).lower()))
    for entry in ranked:
        if only is None or entry.name == only:
            found.setdefault(entry.name, []).append(entry)
    for name, (first, *others) in found.items():
        if others:
            warnings.warn(
                f"The {group.noun} {name!r} is registered by {_origin(first)} and also by "
                f"{' and '.join(map(_origin, others))}; {_origin(first)} is used.",
                stacklevel=3,
            )
    return found


def _first_working(group: Group, entries: list[EntryPoint], kind: type[T]) -> type[T] | None:
    """Import entries until one is a subclass of `kind`; warns about each one before it."""
    for entry in entries:
        try:
            loaded: Any = entry.load()
        except (Exception, SystemExit) as error:  # a broken plug-in must not stop the others
            flaw = f"importing {entry.value} raised {type(error).__name__}: {error}"
        else:
            if isinstance(loaded, type) and issubclass(loaded, kind):
                return loaded
            flaw = f"{entry.value} must be a subclass of {kind.__name__}, got {loaded!r}"
        warnings.warn(
            f"The {group.noun} {entry.name!r} of the distribution {_origin(entry)} is skipped: {flaw}.",
            stacklevel=3,
        )
    return None


def _unknown(group: Group, name: str) -> str:
    known = {entry.name for entry in _entry_points(group)}
    if not known:
        return (
            f"No {group.noun} is registered, not even a built-in one, so {name!r} is unknown; install vibrokit "
            "(from a checkout: pip install --editable .)."
        )
    return f"There is no {group.noun} {name!r}{nearest(name, known)}"

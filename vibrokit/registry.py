"""Entry points: parts and analyzers by name, the built-in ones and those of plug-ins alike."""

from __future__ import annotations

import difflib
import importlib.metadata
import warnings
from collections.abc import Iterable
from enum import StrEnum
from importlib.metadata import EntryPoint
from typing import Any, NamedTuple, TypeVar, overload

from vibrokit.errors import UnknownNameError

BUILT_IN = "vibrokit"

T = TypeVar("T")


class Group(StrEnum):
    """Kinds of thing that a distribution may register; each value is the name of an entry-point group."""

    CONTACT_LAWS = "vibrokit.contact_laws"
    SPRINGS = "vibrokit.springs"
    EXCITATIONS = "vibrokit.excitations"
    NOISE_MODELS = "vibrokit.noise_models"
    ANALYZERS = "vibrokit.analyzers"

    @property
    def noun(self) -> str:
        """What one member is called in a sentence."""
        return self.value.removeprefix("vibrokit.").removesuffix("s").replace("_", " ")


class Registered(NamedTuple):
    """A name and the distribution that registers it."""

    name: str
    distribution: str


def names(group: Group) -> tuple[Registered, ...]:
    """List what is registered, without importing any of it.

    Of several distributions that register one name the winner is listed, and a warning says so.

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

    A plug-in that cannot be imported, or that offers something else than a subclass of `kind`, gives a
    warning, and the next distribution that registers the name is tried.

    Parameters
    ----------
    group : Group
    name : str
    kind : type, optional
        Class that the loaded one must inherit from.

    Returns
    -------
    type

    Raises
    ------
    UnknownNameError
        If nothing that works is registered under `name`.
    """
    candidates = _candidates(group, name)
    if name not in candidates:
        raise UnknownNameError(_unknown(group, name))
    loaded: type | None = _first_working(group, candidates[name], kind)
    if loaded is not None:
        return loaded
    origins = " and ".join(_origin(entry) for entry in candidates[name])
    raise UnknownNameError(
        f"The {group.noun} {name!r} is registered by {origins} but does not load; the warning before this says why."
    )


def load_all(group: Group, kind: type[T]) -> dict[str, type[T]]:
    """Import everything registered in a group; what is broken gives a warning and is left out.

    Parameters
    ----------
    group : Group
    kind : type
        Class that the loaded ones must inherit from.

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
    """Return the name that a class is registered under, or ``module:Class`` if it is not registered."""
    place = f"{cls.__module__}:{cls.__qualname__}"
    entries = list(_entry_points(group))
    for entry in entries:
        if entry.value == place:
            return entry.name
    top = cls.__module__.partition(".")[0]
    for entry in entries:  # a package may offer a class under a shorter path
        if entry.value.startswith((f"{top}.", f"{top}:")) and _first_working(group, [entry], cls) is cls:
            return entry.name
    return place


def _entry_points(group: str) -> Iterable[EntryPoint]:
    """Read the entry points of a group; the one place that asks the installation."""
    return importlib.metadata.entry_points(group=group)


def _origin(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist is not None else "an unnamed distribution"


def _rank(entry: EntryPoint) -> tuple[bool, str]:
    origin = _origin(entry)
    return origin != BUILT_IN, origin.lower()


def _candidates(group: Group, only: str | None = None) -> dict[str, list[EntryPoint]]:
    """Entry points by name, the winner of each name first; warns where a name has several."""
    found: dict[str, list[EntryPoint]] = {}
    for entry in sorted(_entry_points(group), key=lambda entry: (entry.name, _rank(entry))):
        if only is None or entry.name == only:
            found.setdefault(entry.name, []).append(entry)
    for name, (winner, *others) in found.items():
        if others:
            warnings.warn(
                f"The {group.noun} {name!r} is registered by {_origin(winner)} and also by "
                f"{' and '.join(map(_origin, others))}; the one of {_origin(winner)} is used.",
                stacklevel=3,
            )
    return found


def _first_working(group: Group, entries: list[EntryPoint], kind: type[T]) -> type[T] | None:
    """Import entries until one is sound; warns of each that is not."""
    for entry in entries:
        try:
            loaded: Any = entry.load()
        except (Exception, SystemExit) as error:  # whatever a plug-in does at import, it stops nothing
            flaw = f"importing {entry.value} raised {type(error).__name__}: {error}"
        else:
            if isinstance(loaded, type) and issubclass(loaded, kind):
                return loaded
            flaw = f"{entry.value} is {loaded!r}, which is no subclass of {kind.__name__}"
        warnings.warn(
            f"The {group.noun} {entry.name!r} of the distribution {_origin(entry)} is left out: {flaw}.",
            stacklevel=3,
        )
    return None


def _unknown(group: Group, name: str) -> str:
    known = sorted({entry.name for entry in _entry_points(group)})
    if not known:
        return (
            f"There is no {group.noun} {name!r}, as none is registered at all, not even a built-in one; "
            f"install vibrokit (from a checkout: pip install --editable .)."
        )
    near = difflib.get_close_matches(name, known, n=1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return f"There is no {group.noun} {name!r}.{hint} Registered are {', '.join(known)}."

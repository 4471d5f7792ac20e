"""Construction: what the constructors of parts, scenes, steppers and methods say about arguments they do not take."""

from __future__ import annotations

import inspect
from abc import ABCMeta
from typing import Any, NoReturn

from vibrokit.errors import ArgumentError, counted, listed, nearest

_OPEN = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)


class Constructed(ABCMeta):
    """Metaclass of the classes that users call: wrong arguments are refused with a sentence, by an ArgumentError."""

    def __call__(cls, *values: Any, **named: Any) -> Any:
        """Make an instance."""
        try:
            return super().__call__(*values, **named)
        except ArgumentError:
            raise
        except TypeError:
            if inspect.isabstract(cls):
                _refuse_abstract(cls)
            _check(cls, values, named)
            raise

    @property
    def __signature__(cls) -> inspect.Signature:
        """That of the constructor, for `inspect` and the documentation."""
        own = inspect.signature(cls.__init__)  # type: ignore[misc] # of this very class
        return own.replace(parameters=list(own.parameters.values())[1:], return_annotation=own.empty)


def _refuse_abstract(cls: type) -> NoReturn:
    missing = listed(sorted(getattr(cls, "__abstractmethods__", ())))
    raise ArgumentError(
        f"{cls.__name__} is abstract, because it does not define {missing}; define that in the class, or use a class "
        "that does."
    ) from None


def _check(cls: type, values: tuple[Any, ...], named: dict[str, Any]) -> None:
    """Raise ArgumentError if a constructor does not take these arguments."""
    parameters = inspect.signature(cls).parameters.values()
    names = [one.name for one in parameters if one.kind not in _OPEN]
    places = [one.name for one in parameters if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD)]
    open_ended = {one.kind for one in parameters} & set(_OPEN)
    given = dict(zip(places, values, strict=False))
    for name in named:
        if name not in names and inspect.Parameter.VAR_KEYWORD not in open_ended:
            raise ArgumentError(f"{cls.__name__} has no parameter {name!r}{nearest(name, names)}") from None
        if name in given:
            raise ArgumentError(f"{cls.__name__}: {name} has two values; give one.") from None
    if len(values) > len(places) and inspect.Parameter.VAR_POSITIONAL not in open_ended:
        raise ArgumentError(
            f"{cls.__name__} takes {counted(len(places), 'value')} without a name, got {len(values)}; its parameters "
            f"are {listed(names)}."
        ) from None
    needed = [one.name for one in parameters if one.default is one.empty and one.kind not in _OPEN]
    missing = [name for name in needed if name not in given and name not in named]
    if missing:
        raise ArgumentError(f"{cls.__name__} needs a value of {listed(missing)}.") from None

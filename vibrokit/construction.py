"""Constructed, called: public classes and functions refuse arguments that they do not take with a sentence."""

from __future__ import annotations

import functools
import inspect
from abc import ABCMeta
from collections.abc import Callable, Iterable
from typing import Any, NoReturn, TypeVar, cast

from vibrokit.errors import ArgumentError, counted, listed, nearest

_OPEN = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)

F = TypeVar("F", bound=Callable[..., Any])  # its signature stays what it is


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
            _check(cls.__name__, inspect.signature(cls).parameters.values(), values, named)
            raise

    @property
    def __signature__(cls) -> inspect.Signature:
        """That of the constructor, for `inspect` and the documentation."""
        own = inspect.signature(cls.__init__)  # type: ignore[misc] # of this very class
        return own.replace(parameters=list(own.parameters.values())[1:], return_annotation=own.empty)


def called(function: F) -> F:
    """Decorate a public function or method: wrong arguments are refused with a sentence, by an ArgumentError."""

    @functools.wraps(function)
    def checked(*values: Any, **named: Any) -> Any:
        try:
            return function(*values, **named)
        except ArgumentError:
            raise
        except TypeError:  # only then is the signature looked at, for a call costs nothing that way
            parameters = list(inspect.signature(function).parameters.values())
            bound = parameters[0].name in ("self", "cls") if parameters else False
            _check(function.__name__, parameters[bound:], values[bound:], named)
            raise

    return cast(F, checked)


def _refuse_abstract(cls: type) -> NoReturn:
    missing = listed(sorted(getattr(cls, "__abstractmethods__", ())))
    raise ArgumentError(
        f"{cls.__name__} is abstract, because it does not define {missing}; define that in the class, or use a class "
        "that does."
    ) from None


def _check(caller: str, takes: Iterable[inspect.Parameter], values: tuple[Any, ...], named: dict[str, Any]) -> None:
    """Raise ArgumentError if these arguments do not fit the parameters."""
    parameters = list(takes)
    names = [one.name for one in parameters if one.kind not in _OPEN]
    places = [one.name for one in parameters if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD)]
    open_ended = {one.kind for one in parameters} & set(_OPEN)
    given = dict(zip(places, values, strict=False))
    for name in named:
        if name not in names and inspect.Parameter.VAR_KEYWORD not in open_ended:
            raise ArgumentError(f"{caller} has no parameter {name!r}{nearest(name, names)}") from None
        if name in given:
            rename = f", and another name to a constant {name}" if inspect.Parameter.VAR_KEYWORD in open_ended else ""
            raise ArgumentError(f"{caller}: {name} has two values; give one{rename}.") from None
    if len(values) > len(places) and inspect.Parameter.VAR_POSITIONAL not in open_ended:
        raise ArgumentError(
            f"{caller} takes {counted(len(places), 'value')} without a name, got {len(values)}; its parameters "
            f"are {listed(names)}."
        ) from None
    needed = [one.name for one in parameters if one.default is one.empty and one.kind not in _OPEN]
    missing = [name for name in needed if name not in given and name not in named]
    if missing:
        raise ArgumentError(f"{caller} needs a value of {listed(missing)}.") from None

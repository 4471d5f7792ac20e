"""What can go wrong, as exceptions whose text is a full sentence."""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable


class VibrokitError(Exception):
    """Root of every error that the toolkit raises on purpose."""


class ParameterError(VibrokitError, ValueError):
    """A parameter has a value that it may not have."""


class SceneError(VibrokitError, ValueError):
    """Parts, or the text of a scene file, do not make a scene."""


class NoSectionError(SceneError):
    """A stroboscopic section was asked of excitations without a common period."""


class UnknownNameError(VibrokitError, LookupError):
    """A name that nothing is registered under."""


class DerivationError(VibrokitError, TypeError):
    """A part's formula cannot be turned into equations."""


class StepperError(VibrokitError, ValueError):
    """A stepper cannot integrate this scene, or its settings are out of range."""


class StructureError(VibrokitError, ValueError):
    """A question about attractors or basins that the scene cannot answer."""


class IntegrationError(VibrokitError, ArithmeticError):
    """The integration left the finite numbers or ran out of steps.

    Attributes
    ----------
    time : float
        Time at which the last good state was seen.
    state : tuple of float
        That state.
    """

    def __init__(self, message: str, time: float, state: tuple[float, ...]) -> None:
        super().__init__(message)
        self.time = time
        self.state = state


def shown(value: object) -> str:
    """Return a value as one short line, whatever it is: the part of a sentence that says what was given."""
    try:
        text = " ".join(_SHORT.repr(value).split())
    except Exception:  # a repr that fails, or an integer too long to be printed
        return f"an object of type {type(value).__name__}"
    return text if len(text) <= _LONGEST_SHOWN else text[:_LONGEST_SHOWN] + "..."


_LONGEST_SHOWN = 120
_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _LONGEST_SHOWN


def nearest(name: str, known: Iterable[str]) -> str:
    """Return the end of a sentence that names the closest of the known names, or all of them."""
    names = sorted(known)
    close = difflib.get_close_matches(str(name)[:60], names, n=1)
    if close:
        return f"; the nearest is {close[0]!r}."
    return f"; there {'is' if len(names) == 1 else 'are'} {', '.join(names) or 'none'}."

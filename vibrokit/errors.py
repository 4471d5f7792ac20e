"""Exceptions of the toolkit, and the parts of their messages. Every message is a full sentence."""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable, Mapping, Sequence


class VibrokitError(Exception):
    """Base class of the errors of the toolkit."""


class ParameterError(VibrokitError, ValueError):
    """A parameter has a value outside its allowed range."""


class FormulaError(VibrokitError, ValueError):
    """A formula given as text, or the name of a parameter in it, is not allowed."""


class SceneError(VibrokitError, ValueError):
    """Parts do not fit together, or a scene file does not describe a scene."""


class NoSectionError(SceneError):
    """The excitations have no common period, so there is no stroboscopic section."""


class UnknownNameError(VibrokitError, LookupError):
    """Nothing is registered under a name."""


class DerivationError(VibrokitError, TypeError):
    """Equations cannot be derived from the formula of a part."""


class StepperError(VibrokitError, ValueError):
    """A stepper cannot integrate this scene, or its settings are out of range."""


class StructureError(VibrokitError, ValueError):
    """A question about attractors, basins or exits has no answer in the scene."""


class ResultFileError(VibrokitError, ValueError):
    """A file is not a saved result, its parts contradict one another, or a result cannot be saved."""


class FileError(VibrokitError, OSError):
    """A file cannot be written, or there is none."""


class NoSuchFileError(FileError, FileNotFoundError):
    """There is no file or folder of this name."""


class CheckpointError(VibrokitError, ValueError):
    """A checkpoint is damaged, or belongs to other work."""


class ArgumentError(VibrokitError, TypeError):
    """A class or function lacks a value that it needs, or is given one that it does not take; a class is abstract."""


class OutOfTime(VibrokitError, TimeoutError):
    """The time limit was reached before there was anything to return."""


class IntegrationError(VibrokitError, ArithmeticError):
    """A state became infinite or NaN, or the number of steps reached its limit.

    Attributes
    ----------
    time : float
        Time of the last finite state (s).
    state : tuple of float
        The last finite state.
    """

    def __init__(self, message: str, time: float, state: tuple[float, ...]) -> None:
        super().__init__(message)
        self.time = time
        self.state = state


class TooManyStepsError(IntegrationError):
    """The number of steps in one interval reached its limit; the state is finite.

    Attributes
    ----------
    time_scale : float
        The shortest time of a force at the state (s), which limits the steps; infinite where none was found.
    friction : bool
        Whether that force is steep in the velocity of the mass, as dry friction is.
    """

    def __init__(self, message: str, time: float, state: tuple[float, ...], time_scale: float, friction: bool) -> None:
        super().__init__(message, time, state)
        self.time_scale = time_scale
        self.friction = friction


def shown(value: object) -> str:
    """Return any value as one short line for an error message."""
    try:
        text = " ".join(_SHORT.repr(value).split())
    except Exception:  # repr fails, or Python refuses to print a very long integer
        return f"an object of type {type(value).__name__}"
    return text if len(text) <= _LONGEST_SHOWN else text[:_LONGEST_SHOWN] + "..."


_LONGEST_SHOWN = 120
_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _LONGEST_SHOWN


def reason(error: Exception) -> str:
    """Return why the system refused a file, without its number and the path."""
    return getattr(error, "strerror", None) or str(error)


def nearest(name: str, known: Iterable[str]) -> str:
    """Return the end of a sentence that names the closest known name, or lists the known names.

    The last component of a path counts as a name too: ``"freqency"`` is close to ``"excitations.0.frequency"``.
    """
    names = sorted(known)
    return nearest_form(name, {path.rpartition(".")[2]: path for path in reversed(names)} | {n: n for n in names})


def nearest_form(name: str, forms: Mapping[str, str]) -> str:
    """Return the same, where each known name has other forms, which are the keys."""
    close = difflib.get_close_matches(str(name)[:60], forms, n=1)
    if close:
        return f"; the nearest is {forms[close[0]]!r}."
    return f"; allowed: {listed(sorted(set(forms.values())))}."


def listed(names: Sequence[str]) -> str:
    """Return names with commas between, at most twenty of them."""
    rest = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(names[:_MOST_LISTED]) + rest or "none"


_MOST_LISTED = 20


def counted(count: int, noun: str, plural: str = "") -> str:
    """Return a number with its noun: ``"1 start"``, ``"2 starts"``."""
    return f"{count:d} {noun if count == 1 else plural or f'{noun}s'}"

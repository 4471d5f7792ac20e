"""Continuation of activation energies in one parameter: exit paths are followed from value to value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.energy_run import EnergyRun
from vibrokit.analyzers.least_action import LeastAction
from vibrokit.construction import called
from vibrokit.errors import ParameterError, StructureError, shown
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, working
from vibrokit.results.energy_continuation import EnergyContinuation
from vibrokit.structure.parameter_values import ParameterLine, ordered_values, parameter_line
from vibrokit.structure.validation import check_means, seed_of

_CALLER = "energy_continuation"

Array = NDArray[np.float64]


@called
def energy_continuation(
    osc: Oscillator,
    parameter: str | Mapping[str, float],
    values: Sequence[float],
    *,
    analyzer: LeastAction | None = None,
    search: Sequence[float] | None = None,
    rng: int | np.random.Generator = 0,
    progress: Progress = None,
    time_limit: float | None = None,
) -> EnergyContinuation:
    """Follow the exit paths of a scene, and so its activation energies, along values of one parameter.

    At a few values the structure and all exit paths are searched for. The cheapest path of each exit is then followed
    to the other values: Newton's method solves for it from the path at the value before. A step is halved until the
    change of the action agrees with its derivative at both ends, so that a path is not exchanged for another one. Where
    paths cost the same, the least action passes from one to the other. A path that is the cheapest at no searched value
    is not found, so that the energies at the other values are upper bounds.

    On Ctrl-C, or when the time limit is reached, what was found so far is returned, marked incomplete.

    Parameters
    ----------
    osc : Oscillator
    parameter : str or dict of str to float
        A parameter that does not shape the equations: a key of ``osc.parameters``, or the end of exactly one; or the
        factors of several, as of `continuation`.
    values : sequence of float
        Finite and distinct; they are taken in ascending order.
    analyzer : LeastAction, optional
        Finds the paths, with its source and its exit; by default ``LeastAction()``.
    search : sequence of float, optional
        Those of the values at which paths are searched for; by default the one nearest to the parameter's own value,
        the first and the last, and then the middle of each stretch in which a state has no energy.
    rng : int or numpy.random.Generator
        Seed of the structures.
    progress : bool or callable, optional
        True shows progress on standard error; a function is called with each `vibrokit.progress.Update`.
    time_limit : float, optional
        In seconds.

    Returns
    -------
    EnergyContinuation

    Raises
    ------
    ParameterError
        An unknown or ambiguous parameter, one that shapes the equations, or values that are not numbers.
    SceneError
        The scene has no noise.
    StructureError
        The analyzer is no `LeastAction`, or no exit path was found at any searched value.

    Examples
    --------
    >>> import vibrokit as vk
    >>> osc = vk.load_scene("hertz-0.570")
    >>> along = vk.energy_continuation(osc, "excitations.0.frequency", [0.56, 0.57, 0.58])  # doctest: +SKIP
    >>> along.energy("clear", "hammering")  # doctest: +SKIP
    """
    check_means(osc, None, None)
    line, numbers = parameter_line(_CALLER, osc, parameter), ordered_values(_CALLER, values)
    chosen = LeastAction() if analyzer is None else analyzer
    if not isinstance(chosen, LeastAction):
        raise StructureError(f"{_CALLER}: analyzer must be a LeastAction, got {shown(analyzer)}.")
    chosen.check(osc)
    wanted = None if search is None else search_places(line, numbers, search)
    run = EnergyRun(osc, line, numbers, chosen, wanted, seed_of(rng))
    with working(progress, time_limit) as work:
        run.run()
        return run.record(work)


def search_places(line: ParameterLine, values: Array, search: Any) -> list[int]:
    """Return the indices of the values to search at, that nearest to the scene's own first; errors as of the caller."""
    found = []
    for value in ordered_values(f"{_CALLER}: search", search):
        place = int(np.argmin(np.abs(values - value)))
        if not np.isclose(values[place], value, rtol=1e-12, atol=0):
            raise ParameterError(f"{_CALLER}: search must contain some of the values, and {value:g} is none of them.")
        found.append(place)
    return sorted(found, key=lambda place: abs(values[place] - line.own))

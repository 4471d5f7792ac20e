"""Request: the arguments of an assessment, checked before any work."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from concurrent.futures import Executor
from numbers import Integral

from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.analyzers.exits import Exit
from vibrokit.arguments import members, real
from vibrokit.errors import ParameterError, SceneError, shown
from vibrokit.oscillator import Oscillator
from vibrokit.progress import checked_time_limit
from vibrokit.registry import Group, load
from vibrokit.structure.validation import check_means, seed_of

METHODS = ("least-action", "mfet", "sgcm")
"""Analyzers that an assessment runs, in this order, by their registered names."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Request:
    """The checked arguments of an assessment.

    Attributes
    ----------
    accuracy : float
    time_limit : float or None
    analyzers : dict of str to Analyzer
        Fitted to the accuracy, by their registered names.
    source : int, str or None
    rng : int
    executor : Executor or None
    """

    accuracy: float
    time_limit: float | None
    analyzers: dict[str, Analyzer]
    source: int | str | None
    rng: int
    executor: Executor | None

    @classmethod
    def of(
        cls,
        osc: Oscillator,
        *,
        accuracy: float,
        time_limit: float | None,
        methods: Sequence[str] | None,
        source: int | str | None,
        exit: Exit,  # noqa: A002 - the name that analyzers use
        rng: int,
        executor: Executor | None,
    ) -> Request:
        """Check arguments; raises a VibrokitError."""
        check_means(osc, None, executor)
        if not 0 < real(accuracy) < 1:
            raise ParameterError(f"accuracy must be above 0 and below 1, got {shown(accuracy)}.")
        names = METHODS if methods is None else members(methods)
        if not names:
            raise ParameterError(f"methods must be names of analyzers, such as {METHODS!r}, got {shown(methods)}.")
        if osc.noise is not None and not osc.noise.intensity > 0:
            raise SceneError("the noise of the scene has the intensity 0, so nothing is left; give it a positive one.")
        if source is not None and (not isinstance(source, str | Integral) or isinstance(source, bool) or source == ""):
            raise ParameterError(f"source must be the label or the name of a state, got {shown(source)}.")
        analyzers = {}
        for name in names:
            analyzers[name] = load(Group.ANALYZERS, name, Analyzer)(exit=exit).for_accuracy(float(accuracy))
            analyzers[name].check(osc)
        return cls(
            accuracy=float(accuracy), time_limit=checked_time_limit(time_limit), analyzers=analyzers, source=source,
            rng=seed_of(rng), executor=executor,
        )  # fmt: skip

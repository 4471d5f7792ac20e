"""SteadyStates: the attractors at one value of a parameter."""

from __future__ import annotations

import dataclasses
from typing import Annotated

from vibrokit.documented import documented
from vibrokit.results.attractor import Attractor
from vibrokit.results.finding import Finding


@documented
@dataclasses.dataclass(frozen=True, eq=False)
class SteadyStates:
    """The steady states at one value of the parameter.

    Orbits are thinned to some 1000 samples; basin fractions are NaN if the work was stopped before them.
    """

    value: Annotated[float, "of the parameter"]
    attractors: Annotated[tuple[Attractor, ...], "labelled by their places"]
    branches: Annotated[tuple[int, ...], "the branch that each attractor belongs to"]
    findings: Annotated[tuple[Finding, ...], "what was found and what was not, or why nothing was found"] = ()

"""Result of the search for the least action."""

from __future__ import annotations

from typing import ClassVar

from vibrokit.results.result import Result


class LeastActionResult(Result):
    """Exit paths of least action and their energies.

    `energies` has the best path of each exit, `branches` all polished paths. `data` has the quasi-potentials as in
    `ActionGraphResult`, where they were computed.
    """

    kind: ClassVar[str] = "least_action"
    refined_by: ClassVar[str] = "raise graph.nodes"

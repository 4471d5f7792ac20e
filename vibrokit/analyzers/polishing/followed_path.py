"""FollowedPath: a polished exit path, solved for again in a scene with another value of a parameter."""

from __future__ import annotations

import dataclasses

import numpy as np

from vibrokit.analyzers.path_ends import PathEnd
from vibrokit.analyzers.paths.candidate import POLISHED, Candidate, same_action
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.analyzers.polishing.certified import certify
from vibrokit.analyzers.polishing.ends import Nodes
from vibrokit.analyzers.polishing.extremal_path import ExtremalPath
from vibrokit.analyzers.polishing.leg import Departure, LegSolver
from vibrokit.analyzers.polishing.linearized_orbit import LinearizedOrbit
from vibrokit.analyzers.polishing.newton import extremal_path
from vibrokit.analyzers.polishing.path_solver import Effort, completed
from vibrokit.analyzers.polishing.sensitivity import Sensitivity, sensitivities
from vibrokit.analyzers.polishing.tolerances import TOLERANCES
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.errors import StructureError
from vibrokit.oscillator import Oscillator
from vibrokit.results.energy import ActivationEnergy


@dataclasses.dataclass(frozen=True, eq=False)
class FollowedPath:
    """An exit path in one scene. The structure of `problem` is that of the scene where the path was found."""

    problem: ExitProblem
    place: int  # of its end among those of the problem
    propagator: SegmentPropagator
    found: ExtremalPath

    @classmethod
    def of(cls, problem: ExitProblem, energy: ActivationEnergy) -> FollowedPath:
        """Polish the path of an energy once more; raises StructureError if it has none or that fails."""
        path, attractor = energy.path, problem.attractor
        if not attractor.repeats:
            raise StructureError(
                f"{attractor.name} is {attractor.kind}; only paths that leave an orbit can be followed."
            )
        if path is None:
            raise StructureError(f"the energy of leaving {attractor.name} has no path that could be followed.")
        ends = [
            end for end in problem.path_ends if end.saddle == energy.saddle and energy.target in end.targets
        ]  # fmt: skip
        nodes = Nodes(problem)
        guess = Candidate(energy.source, energy.target, path.t, path.q, energy.value, energy.method)
        end = min(ends, key=lambda each: nodes.distance(each, guess))
        leg = LegSolver(nodes, Departure.from_attractor(attractor)).solve(end, guess, Effort.FROM_ORBIT)
        return cls(problem, problem.path_ends.index(end), leg.propagator, leg.found)

    @property
    def end(self) -> PathEnd:
        """Where it ends."""
        return self.problem.path_ends[self.place]

    def is_same(self, other: FollowedPath) -> bool:
        """Return whether two paths in one scene have one action and connect the same orbits."""
        one, two = self.found, other.found
        orbits = [(one.source, two.source)]
        orbits += [(own, its) for (own, _), (its, _) in zip(one.ending.approached, two.ending.approached, strict=False)]
        return same_action(one.action, two.action) and all(
            own.closest(its.along(0, 1))[0] <= POLISHED * one.extent for own, its in orbits
        )

    def at(self, osc: Oscillator) -> FollowedPath:
        """Solve for the path in a scene with slightly other parameters, from this one as the guess.

        Raises StructureError if there is none nearby, or if one of the orbits has lost or changed its stability.
        """
        problem, before = dataclasses.replace(self.problem, osc=osc), self.found
        propagator = dataclasses.replace(self.propagator, osc=problem.scene)
        moved = dataclasses.replace(self, problem=problem, propagator=propagator)
        source = before.source.again(propagator)
        ending = before.ending.carried_by(propagator).moved_to(moved.end)
        pairs = [(before.source, source)]
        pairs += [(old, new) for (old, _), (new, _) in zip(before.ending.approached, ending.approached, strict=True)]
        if any(_unstable(old) != _unstable(new) for old, new in pairs):
            raise StructureError("the orbit that it leaves or the saddle that it reaches has changed its stability.")
        last = before.last * propagator.piece / self.propagator.piece
        found = extremal_path(
            propagator, source, before.first, ending, before.points, last,
            evaluations=TOLERANCES.evaluations // 8, accepted=before.accepted(),
        )  # fmt: skip
        return dataclasses.replace(moved, found=found)

    def completed(self) -> FollowedPath:
        """Start and end it as near to its orbits as a polished path; raises StructureError if that fails."""
        if self.found.source.start_on_orbit:
            return self
        return dataclasses.replace(self, found=completed(self.propagator, self.found))

    def derivative(self, parameter: str) -> float:
        """Return the derivative of the action in a parameter; NaN if it has none."""
        unknown = Sensitivity(np.nan, np.nan)
        known = sensitivities(self.problem, self.end, self.propagator, self.found, (parameter,))
        return known.get(parameter, unknown).value

    def error(self) -> float:
        """Return the error of the action by its certificate; raises StructureError if it cannot be certified."""
        return certify(self.propagator, self.found).error


def _unstable(orbit: LinearizedOrbit) -> int:
    return int(np.sum(np.abs(orbit.multipliers) > 1))

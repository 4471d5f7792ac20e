"""Where extremal paths start: points of a unit cube that stand for states near an attractor."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.local_potential import LocalPotential, Phase, local_potential, potential_along
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.boxes import FINEST
from vibrokit.analyzers.shooting.tolerances import TOLERANCES
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.symbolic.flow_kind import Flow

Array = NDArray[np.float64]


class Starts(ABC):
    """A family of starts on the attractor's unstable manifold in (q, p). Abstract."""

    method: ClassVar[str] = "action plot"
    """As in `ActivationEnergy.method`."""

    @property
    @abstractmethod
    def growth(self) -> float:
        """Factor by which a deviation from the attractor grows on the way to the exit."""

    @property
    def patience(self) -> int:
        """Number of rounds without change that end a search."""
        return 3

    def depth(self, first: Array) -> int:
        """Return how many times a box with sides `first` must be split in three before the slowest exit path shows."""
        return 0

    @abstractmethod
    def states(self, places: Array) -> tuple[Array, Array]:
        """Return states (q, p, S), shape (count, 2n + 1), and their times (s) since a section.

        Places (count, d) have coordinates between 0 and 1: the angle in turns; polar angles in half turns where the
        noise has extra states; where it counts, the fraction of the distance between the edges of the domain.
        """

    @abstractmethod
    def grid(self, points: int) -> tuple[int, ...]:
        """Return the numbers of places along each coordinate, about `points` in all, that make cells nearly square."""

    @abstractmethod
    def with_stepper(self, problem: ExitProblem, stepper: Stepper) -> Self:
        """Return the same family around the orbit that another stepper gives."""


@dataclasses.dataclass(frozen=True, eq=False)
class Ring(Starts):
    """A circle around the attractor's point on the section."""

    method: ClassVar[str] = "action plot (ring)"

    point: Array  # (n,)
    potential: LocalPotential
    radius: float  # in m and m s⁻¹ alike

    @classmethod
    def around(cls, problem: ExitProblem, stepper: Stepper, radius: float) -> Self:
        """Make a circle around the orbit that a stepper gives."""
        orbit = problem.orbit(stepper)
        return cls(orbit.point, local_potential(problem.scene, orbit, stepper), radius)

    @property
    def growth(self) -> float:
        """As if the exit were at distance 1."""
        return 1 / self.radius

    def states(self, places: Array) -> tuple[Array, Array]:
        """On the circle, at the section: p = Σ⁻¹ δq and S = ½ δqᵀ Σ⁻¹ δq."""
        angles, offset = 2 * np.pi * places[:, 0], np.zeros((len(places), len(self.point)))
        offset[:, 0], offset[:, 1] = self.radius * np.cos(angles), self.radius * np.sin(angles)
        momentum = offset @ self.potential.stiffness
        action = 0.5 * np.einsum("ij,ij->i", offset, momentum)
        return np.column_stack([self.point + offset, momentum, action]), np.zeros(len(places))

    def grid(self, points: int) -> tuple[int, ...]:
        """Equal angles."""
        return (points,)

    def with_stepper(self, problem: ExitProblem, stepper: Stepper) -> Self:
        """The circle of the same radius."""
        return self.around(problem, stepper, self.radius)


@dataclasses.dataclass(frozen=True, eq=False)
class Shell:
    """Region between an ellipse of the quadratic form at one time and the image of the previous shell's ellipse.

    In coordinates y = L⁻¹ δq, Σ = L Lᵀ, ellipses are spheres and the linear growth of extremals
    δq ↦ (M + C M⁻ᵀ Σ⁻¹) δq = Σ' M⁻ᵀ Σ⁻¹ δq becomes B⁻ᵀ, with B = L'⁻¹ M L. Since B Bᵀ = 1 − L'⁻¹ C L'⁻ᵀ, every radius
    grows. The preimage of y is Bᵀ y, which needs no inverse.
    """

    time: float  # since the section (s)
    point: Array  # (n,)
    root: Array  # (n, n): L
    back: Array  # (n, n): Bᵀ

    def states(self, directions: Array, radius: float, fractions: Array) -> Array:
        """Return (q, p, S) along unit vectors (count, n), at fractions of the log distance between the edges."""
        inner = np.linalg.norm(directions @ self.back.T, axis=1)
        place = directions * (radius * inner**-fractions)[:, None]
        momentum = np.linalg.solve(self.root.T, place.T).T
        return np.column_stack([self.point + place @ self.root.T, momentum, 0.5 * np.sum(place**2, axis=1)])


@dataclasses.dataclass(frozen=True, eq=False)
class FundamentalDomain(Starts):
    """Shells that each extremal path passes through exactly once: together they hold the whole unstable manifold.

    There is one shell, on the section, if radii grow little in a period of the orbit, and several at times in between
    if they grow much. Without forcing all times are equivalent, so the inner edge alone holds every path.

    A place is a direction in the whitened plane, then the fraction of the distance from the inner to the outer edge,
    shells one after another.
    """

    shells: tuple[Shell, ...]
    radius: float  # radius of the inner edge in whitened coordinates, where Ψ = ½ radius²
    relative_radius: float  # the same, relative to the distance from the attractor to the exit
    ratio: float  # ratio of the fastest rate at which deviations decay to the slowest
    edge_only: bool = False  # whether only the inner edge is used

    @property
    def growth(self) -> float:
        """From the inner edge to the exit."""
        return 1 / self.relative_radius

    @property
    def patience(self) -> int:
        """Longer without forcing: rounds are cheap, and an overdamped exit path is a narrow funnel in a plateau."""
        return 8 if self.edge_only else 3

    def states(self, places: Array) -> tuple[Array, Array]:
        """In each place's shell."""
        size, count = len(self.shells[0].point), len(places)
        directions = on_sphere(places[:, : size - 1])
        across = np.zeros(count) if self.edge_only else places[:, -1] * len(self.shells)
        which = np.minimum(across.astype(np.int64), len(self.shells) - 1)
        starts, times = np.empty((count, 2 * size + 1)), np.empty(count)
        for number, shell in enumerate(self.shells):
            here = which == number
            starts[here] = shell.states(directions[here], self.radius, across[here] - number)
            times[here] = shell.time
        return starts, times

    def grid(self, points: int) -> tuple[int, ...]:
        """Cells are nearly square in the logarithms of whitened coordinates."""
        lengths = [2 * math.pi] + [math.pi] * (len(self.shells[0].point) - 2)
        if not self.edge_only:
            grown = -sum(float(np.log(np.linalg.svd(shell.back, compute_uv=False)).mean()) for shell in self.shells)
            lengths.append(max(grown, 1e-3))  # a thinner domain gets one row of starts unless there are very many
        scale = (points / math.prod(lengths)) ** (1 / len(lengths))
        across = [max(1, round(length * scale)) for length in lengths[1:]]
        return max(4, round(points / math.prod(across))), *across

    def depth(self, first: Array) -> int:
        """Where rates differ, all but a narrow fan of directions follow the fastest; the boxes must resolve that fan.

        A path that grows from the relative radius ε along the slowest direction must start within ε^(r − 1) of it, r
        being the ratio of the fastest rate to the slowest.
        """
        splits = math.log(float(first[0]), 3) - (self.ratio - 1) * math.log(self.relative_radius, 3)
        return min(FINEST, max(0, math.ceil(splits)))

    def with_stepper(self, problem: ExitProblem, stepper: Stepper) -> Self:
        """The same radii around another orbit."""
        return dataclasses.replace(self, shells=shells_of(_phases(problem, stepper)))


def _phases(problem: ExitProblem, stepper: Stepper) -> tuple[Phase, ...]:
    return potential_along(problem.scene, problem.orbit(stepper), stepper)


def shells_of(phases: Sequence[Phase]) -> tuple[Shell, ...]:
    """Make the fewest shells, equally spaced in time, across each of which radii grow little."""
    count = len(phases)
    for shells in (number for number in range(1, count + 1) if count % number == 0):
        made = tuple(_shell(phases, last, count // shells) for last in range(0, count, count // shells))
        if all(1 / np.linalg.svd(shell.back, compute_uv=False)[-1] <= TOLERANCES.growth for shell in made):
            break
    return made


def _shell(phases: Sequence[Phase], last: int, steps: int) -> Shell:
    here, before = phases[last], phases[last - steps]
    root = np.linalg.cholesky(here.covariance)
    monodromy = np.eye(len(here.point))
    for number in range(last - steps + 1, last + 1):
        monodromy = phases[number].monodromy @ monodromy
    back = np.linalg.solve(root, monodromy @ np.linalg.cholesky(before.covariance)).T
    return Shell(here.time, here.point, np.asarray(root, dtype=float), np.asarray(back, dtype=float))


def on_sphere(places: Array) -> Array:
    """Return unit vectors (count, k + 1) of places (count, k): an angle in turns, then polar angles in half turns."""
    angle = 2 * np.pi * places[:, :1]
    vectors = np.hstack([np.cos(angle), np.sin(angle)])
    for number in range(1, places.shape[1]):
        polar = np.pi * places[:, number : number + 1]
        vectors = np.hstack([vectors * np.sin(polar), np.cos(polar)])
    return vectors


def fitted_domain(problem: ExitProblem, stepper: Stepper) -> FundamentalDomain:
    """Return the fundamental domain with the largest inner edge in the linear range.

    The edge shrinks until paths from all over the domain, one shell later, have the action of the quadratic form there.
    Raises StructureError if no edge down to a relative radius of about 1e-7 is in the linear range.
    """
    shells = shells_of(_phases(problem, stepper))
    distance = _exit_distance(problem, shells[0])
    rates = -np.log(np.maximum(np.abs(problem.attractor.multipliers), np.finfo(float).tiny))
    ratio = float(rates.max() / rates.min())
    for relative in (TOLERANCES.edge / 4**shrunk for shrunk in range(9)):
        domain = FundamentalDomain(shells, relative * distance, relative, ratio, problem.scene.autonomous)
        error = _nonlinearity(problem, domain, stepper)
        if error <= TOLERANCES.linear:
            return domain
    raise StructureError(
        f"the quadratic quasi-potential is off by {error:.2g} (relative) even at {relative:.1g} of the distance to the "
        "exit: the attractor grazes a stop, or the stepper is too coarse. Take a finer stepper, or give a radius."
    )


def _exit_distance(problem: ExitProblem, shell: Shell) -> float:
    """The least distance, in whitened coordinates, to a cell that counts as left, or else to the region's edge."""
    basins = problem.structure.basins
    cells = basins.region.cell_centres(basins.labels.shape)
    labels = basins.labels.ravel()
    outside = ((labels >= 0) & (labels != problem.source)) | problem.is_out(cells)
    covariance = (shell.root @ shell.root.T)[:2, :2]  # extra states of the noise take their most likely values
    if outside.any():
        offset = cells[outside] - shell.point[:2]
        return float(np.sqrt(np.sum(offset * np.linalg.solve(covariance, offset.T).T, axis=1).min()))
    gaps = np.abs(basins.region.bounds - shell.point[:2, None]).min(axis=1)
    return float((gaps / np.sqrt(np.diag(covariance))).min())


def _nonlinearity(problem: ExitProblem, domain: FundamentalDomain, stepper: Stepper) -> float:
    """The largest relative difference of 64 actions, one shell later, from the quadratic form there."""
    osc, shells = problem.scene, domain.shells
    duration = osc.section_interval * problem.attractor.period / len(shells)
    size = len(shells[0].point)
    places = np.random.default_rng(0).random((64, size))
    worst = 0.0
    for number, (shell, after) in enumerate(zip(shells, (*shells[1:], shells[0]), strict=True)):
        across = (number + places[:, -1:]) / len(shells)
        inside = places[:, :-1] if domain.edge_only else np.hstack([places[:, :-1], across])
        ended = run_ensemble(
            osc, Flow.HAMILTONIAN, stepper, domain.states(inside)[0],
            start_time=shell.time % osc.section_interval, interval=duration,
        )  # fmt: skip
        place = np.linalg.solve(after.root, (ended.states[:, :size] - after.point).T).T
        expected = 0.5 * np.sum(place**2, axis=1)
        error = np.abs(ended.states[:, -1] - expected) / np.abs(expected)
        worst = max(worst, float(np.where(np.isfinite(error), error, np.inf).max()))
    return worst

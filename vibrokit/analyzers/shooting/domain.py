"""The fundamental domain: one start for each extremal path that leaves an attractor.

Starts are near enough to the attractor for the quadratic form, and no nearer.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.paths.local_potential import Phase, potential_along
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.analyzers.shooting.starts import Starts
from vibrokit.errors import StructureError
from vibrokit.kernels.ensemble import run_ensemble
from vibrokit.kernels.stepper import Stepper
from vibrokit.symbolic.flow_kind import Flow

_MOST_GROWTH = 10.0  # of a radius across a shell: the outer edge must still be in the linear range
_ROUNDING = 1e-14
_LARGEST = 0.01  # relative radius; the quadratic form then misses 1e-6 of the action
_SMALLEST = 1e-7
_SHRINK = 0.25
_NONLINEAR = 0.02  # largest relative difference of an action from the quadratic form one shell later
_SAMPLED = 64  # directions at which the difference is sampled
_TINY = 1e-300
_THINNEST = 1e-3  # logarithmic width of a domain, below which it gets one row of starts unless there are very many

Array = NDArray[np.float64]


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

    def fractions(self, states: Array, radius: float) -> Array:
        """Return the fractions at which states (count, ≥ n) lie between the edges; in [0, 1) inside the shell."""
        place = np.linalg.solve(self.root, (states[:, : len(self.point)] - self.point).T).T
        length = np.linalg.norm(place, axis=1)
        before = np.linalg.norm(place @ self.back.T, axis=1)
        return np.log(length / radius) / np.log(length / before)


@dataclasses.dataclass(frozen=True, eq=False)
class FundamentalDomain(Starts):
    """Shells that each extremal path passes through exactly once: together they hold the whole unstable manifold.

    There is one shell, on the section, if radii grow little in a period of the orbit, and several at times in between
    if they grow much. Without forcing all times are equivalent, so the inner edge alone holds every path.

    A place is the direction in spherical coordinates of the whitened plane, then the fraction of the distance from the
    inner to the outer edge, shells one after another.
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
        size = len(self.shells[0].point)
        directions = on_sphere(places[:, : size - 1])
        which, fractions = self._shell(places)
        starts, times = np.empty((len(places), 2 * size + 1)), np.empty(len(places))
        for number, shell in enumerate(self.shells):
            here = which == number
            starts[here] = shell.states(directions[here], self.radius, fractions[here])
            times[here] = shell.time
        return starts, times

    def fractions(self, places: Array) -> Array:
        """Across all shells."""
        return np.zeros(len(places)) if self.edge_only else places[:, -1].copy()

    def grid(self, points: int) -> tuple[int, ...]:
        """Cells are nearly square in the logarithms of whitened coordinates."""
        grown = -sum(float(np.log(np.linalg.svd(shell.back, compute_uv=False)).mean()) for shell in self.shells)
        lengths = [2 * math.pi] + [math.pi] * (len(self.shells[0].point) - 2)
        lengths += [] if self.edge_only else [max(grown, _THINNEST)]
        scale = (points / math.prod(lengths)) ** (1 / len(lengths))
        across = [max(1, round(length * scale)) for length in lengths[1:]]
        return max(4, round(points / math.prod(across))), *across

    def depth(self, first: Array) -> int:
        """Where rates differ, all but a narrow fan of directions follow the fastest; the boxes must resolve that fan.

        A path that grows from the relative radius ε along the slowest direction must start within ε^(r − 1) of it, r
        being the ratio of the fastest rate to the slowest.
        """
        finest = self.relative_radius ** (self.ratio - 1)
        return max(0, math.ceil(math.log(max(float(first[0]) / max(finest, _ROUNDING), 1.0), 3)))

    def with_stepper(self, problem: ExitProblem, stepper: Stepper) -> Self:
        """The same radii around another orbit."""
        return dataclasses.replace(self, shells=shells_around(problem, stepper))

    def _shell(self, places: Array) -> tuple[NDArray[np.int64], Array]:
        if self.edge_only:
            return np.zeros(len(places), dtype=np.int64), np.zeros(len(places))
        across = places[:, -1] * len(self.shells)
        which = np.minimum(across.astype(np.int64), len(self.shells) - 1)
        return which, across - which


def shells_around(problem: ExitProblem, stepper: Stepper) -> tuple[Shell, ...]:
    """Make the shells around the orbit that a stepper gives."""
    return shells_of(potential_along(problem.scene, problem.orbit(stepper), stepper))


def shells_of(phases: Sequence[Phase]) -> tuple[Shell, ...]:
    """Make the fewest shells, equally spaced in time, that keep the growth across each within a factor of 10."""
    count = len(phases)
    for shells in (number for number in range(1, count + 1) if count % number == 0):
        made = tuple(_shell(phases, last, count // shells) for last in range(0, count, count // shells))
        if all(1 / np.linalg.svd(shell.back, compute_uv=False)[-1] <= _MOST_GROWTH for shell in made):
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
    """Return the fundamental domain with the largest inner edge in the linear range, at most 1 % of the exit distance.

    The quadratic form misses a cubic term, so a start at the relative radius ε misses ε³ of the action to be found,
    1e-6 at one hundredth; the duration of a path grows only with log(1/ε). An attractor that nearly touches a stop has
    a smaller linear range than its basin: the edge shrinks until paths from all over the domain, one shell later, have
    the action of the quadratic form there to within 2 %.

    Raises StructureError if no edge down to the relative radius 1e-7 is in the linear range.
    """
    shells = shells_around(problem, stepper)
    distance = _exit_distance(problem, shells[0])
    rates = -np.log(np.maximum(np.abs(problem.attractor.multipliers), _TINY))
    ratio = float(rates.max() / rates.min())
    relative, error = _LARGEST, np.inf
    while relative >= _SMALLEST:
        domain = FundamentalDomain(shells, relative * distance, relative, ratio, problem.scene.autonomous)
        error = _nonlinearity(problem, domain, stepper)
        if error <= _NONLINEAR:
            return domain
        relative *= _SHRINK
    raise StructureError(
        f"the quadratic quasi-potential is off by {error:.2g} (relative) even at {_SMALLEST:g} of the distance to the "
        "exit: the attractor grazes a stop, or the stepper is too coarse. Take a finer stepper, or give a radius."
    )


def _exit_distance(problem: ExitProblem, shell: Shell) -> float:
    """Return the least distance, in whitened coordinates, from the attractor to a basin cell outside the exit.

    If no cell is outside, return the distance to the nearest edge of the region.
    """
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
    """Return the largest relative difference of actions, one shell later, from the quadratic form there."""
    osc, shells = problem.scene, domain.shells
    duration = osc.section_interval * problem.attractor.period / len(shells)
    size = len(shells[0].point)
    places = np.random.default_rng(0).random((_SAMPLED, size))
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

"""Activation energies by direct minimisation of S = ∫ ½ u² dt: a reference that shares nothing with the toolkit.

A path from the attractor's orbit to the saddle's is a chain of quintic Hermite elements (position, velocity and
acceleration at every node; the noise u = x″ + 2ζx′ + spring − push that it needs follows by differentiation); Gauss
quadrature gives its action, a banded Newton method with Levenberg's damping the least one. Neither momentum nor
shooting takes part, except in first guesses (`reference_guesses`). Elements in which a stop is met, where x⁗ jumps,
are halved again and again. Every path in the window is one that noise could drive, so up to quadrature a value is an
upper bound of the least action, and a Hessian that Cholesky accepts shows a local minimum.

`ENERGIES` were computed with 96, 192 and 384 elements a period, those at the stops 60 times shorter, and again with
28 to 44 periods more; the error is what the last steps of either changed. They are the lowest minima found, which is
no proof that there is none below. Found besides, on refined grids: from 0.570's clear state 8.354e-5, 8.706e-5,
8.63e-4,
1.038e-3; from 0.525's hammering orbit 7.95e-5, 7.96e-5, 8.45e-5, 8.49e-5, 8.63e-5 and a dozen up to 1.1e-4.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

_GAUSS = 6  # points of quadrature in an element

# (frequency, name of the attractor): to the boundary saddle, and error.
ENERGIES = {
    (0.570, "clear"): (7.905215e-5, 1e-11),
    (0.570, "hammering"): (8.46609e-4, 1e-9),
    (0.525, "clear"): (9.432542e-5, 1e-11),
    (0.525, "hammering"): (7.72077e-5, 1e-10),
}
# Points on the section, and periods.
ORBITS = {
    (0.570, "clear"): ((0.4665511593, 0.0025656191), 1),
    (0.570, "hammering"): ((0.0235822019, -0.0490713265), 1),
    (0.570, "saddle"): ((0.5344675937, -0.0383563915), 1),
    (0.525, "clear"): ((0.4484378800, 0.0018906100), 1),
    (0.525, "hammering"): ((0.0966084400, -0.0270568000), 4),
    (0.525, "saddle"): ((0.5114955758, -0.0467524270), 1),
}


@dataclasses.dataclass(frozen=True)
class Stop:
    """A push of k·depth^power·(1 + c·rate), away from the stop."""

    position: float
    side: int  # 1: the stop is on the right of the mass; −1: on its left
    stiffness: float
    power: float = 1.5
    rate: float = 0.0  # c

    def depth(self, x):
        return self.side * (x - self.position)

    def pull(self, x, v):
        """Force, and its derivatives in x, v, x twice, x and v."""
        inside, depth = self.depth(x) > 0, np.maximum(self.depth(x), 0.0)
        rated, base = 1 + self.rate * self.side * v, self.stiffness * depth**self.power
        slope = self.stiffness * self.power * inside * depth ** (self.power - 1)
        curve = np.zeros_like(depth)
        np.power(depth, self.power - 2, out=curve, where=inside)
        curve *= self.stiffness * self.power * (self.power - 1)
        return self.side * base * rated, slope * rated, self.rate * base, self.side * curve * rated, (
            self.side * self.rate * slope
        )  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Model:
    """x″ + 2ζx′ + linear·x + cubic·x³ = Σ amplitude·cos(Ωt) + push + stops + noise, Ω the least of the tones."""

    damping: float
    linear: float = 1.0
    cubic: float = 0.0
    stops: tuple[Stop, ...] = ()
    tones: tuple[tuple[float, float], ...] = ()  # amplitude and frequency of each
    push: float = 0.0

    @property
    def period(self):
        return 2 * np.pi / min((frequency for _, frequency in self.tones), default=1.0)

    def pull(self, x, v):
        """Damping, spring and stops, and their derivatives in x, v, x twice, x and v."""
        none, twice = np.zeros_like(x), 2 * self.damping
        spring = self.linear * x + self.cubic * x**3 + twice * v
        parts = [(spring, self.linear + 3 * self.cubic * x**2, twice + none, 6 * self.cubic * x, none)]
        parts += [stop.pull(x, v) for stop in self.stops]
        return tuple(sum(each) for each in zip(*parts, strict=True))

    def forcing(self, t):
        return sum(amplitude * np.cos(frequency * t) for amplitude, frequency in self.tones) + self.push

    def acceleration(self, t, x, v):
        """Of the motion without noise."""
        return self.forcing(t) - self.pull(x, v)[0]

    def follow(self, state, times):
        """States at the times from one at the first of them, without noise."""

        def rates(t, z):
            return z[1], float(self.acceleration(t, *z[:, None])[0])

        span, limit = (times[0], times[-1]), self.period / 60
        return solve_ivp(rates, span, state, "DOP853", times, rtol=1e-12, atol=1e-14, max_step=limit).y.T

    def orbit(self, guess, periods=1):
        """A state that is back after so many periods, by Newton's method with differences."""
        state, span, h = np.array(guess, float), np.array([0.0, periods * self.period]), 1e-6
        for _ in range(20):
            ends = [self.follow(state + h * e, span)[-1] for e in np.array([(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)])]
            miss = ends[0] - state
            if abs(miss).max() < 1e-10:
                return state
            derivative = np.column_stack([ends[1] - ends[3], ends[2] - ends[4]]) / (2 * h)
            state -= np.linalg.solve(derivative - np.eye(2), miss)
        raise ValueError(f"no orbit of {periods} periods near {guess}: {abs(miss).max():.1e} is left.")

    def orbit_nodes(self, state, periods, times):
        """Position, velocity, acceleration of the orbit at any times from 0."""
        phase = np.mod(times, periods * self.period)
        order = np.argsort(phase)
        states = np.empty((len(times), 2))
        grid = np.concatenate([[0.0], phase[order]])
        grid, back = np.unique(grid, return_inverse=True)
        states[order] = self.follow(state, grid)[back[1:]] if len(grid) > 1 else state
        return np.column_stack([states, self.acceleration(times, *states.T)])


def paper(frequency):
    """The paper's scene."""
    stops = Stop(0.5, 1, 50.0), Stop(-0.5, -1, 50.0)
    return Model(0.01, stops=stops, tones=((0.18, frequency),), push=0.2)


def known_orbit(frequency, name):
    """A state of the orbit, by Newton's method, and its periods."""
    guess, periods = ORBITS[frequency, name]
    return paper(frequency).orbit(guess, periods), periods


def _hermite_basis():
    """Quintics on [0, 1]: value, slope and curvature 1 at the left end, then at the right."""
    rows = [[Polynomial.basis(n).deriv(d)(s) for n in range(6)] for s in (0.0, 1.0) for d in range(3)]
    return [Polynomial(column) for column in np.linalg.inv(np.array(rows)).T]


def _shapes(places):
    """Value, slope, curvature of every basis function at the places: 3 × (places, 6)."""
    return np.array([[(p.deriv(d) if d else p)(places) for p in _hermite_basis()] for d in range(3)]).transpose(0, 2, 1)


_NODES, WEIGHTS = np.polynomial.legendre.leggauss(_GAUSS)
_NODES, WEIGHTS = (_NODES + 1) / 2, WEIGHTS / 2
_SHAPES = _shapes(_NODES)


@dataclasses.dataclass(frozen=True)
class ExitPath:
    """Position, velocity and acceleration (nodes, 3) at the times."""

    model: Model
    times: np.ndarray
    nodes: np.ndarray
    action: float = np.nan
    gradient: float = np.nan  # largest component left
    minimum: bool = False  # whether the Hessian is positive definite

    def local(self, nodes):
        """Degrees of freedom of every element (elements, 6), scaled to the unit interval."""
        powers = np.diff(self.times)[:, None] ** np.arange(3)
        return np.hstack([nodes[:-1] * powers, nodes[1:] * powers])

    def at(self, nodes, shapes):
        """x, v, a inside every element, 3 × (elements, places)."""
        h = np.diff(self.times)[:, None]
        return [self.local(nodes) @ shape.T / h**d for d, shape in enumerate(shapes)]

    def noise(self, nodes):
        """u at every point of quadrature, and the derivatives of the pull there, each (elements, points)."""
        x, v, a = self.at(nodes, _SHAPES)
        pull, *derivatives = self.model.pull(x, v)
        t = self.times[:-1, None] + np.diff(self.times)[:, None] * _NODES
        return a + pull - self.model.forcing(t), *derivatives

    def split(self, chosen):
        """The same path with the chosen elements halved."""
        middle = np.array(self.at(self.nodes, _shapes(np.array([0.5]))))[:, chosen, 0].T
        places = np.flatnonzero(chosen) + 1
        halves = (self.times[:-1] + np.diff(self.times) / 2)[chosen]
        times, nodes = np.insert(self.times, places, halves), np.insert(self.nodes, places, middle, axis=0)
        return ExitPath(self.model, times, nodes)

    def refined(self):
        """The same path with every element halved."""
        return self.split(np.ones(len(self.times) - 1, bool))

    def touching(self, shortest):
        """Elements in which the stop is met or left, and that are longer than the shortest."""
        inside = self.at(self.nodes, _shapes(np.linspace(0, 1, 9)))[0]
        deep = [stop.depth(inside) > 0 for stop in self.model.stops]
        met = [each.any(1) & ~each.all(1) for each in deep]
        return np.any(met, axis=0) & (np.diff(self.times) > shortest)

    def extended(self, start, before, end, after, elements):
        """With more periods on the orbits at either end (states and periods of the orbits; whole multiples before)."""
        model, span = self.model, self.model.period
        early = np.linspace(0, before * span, before * elements + 1)[:-1]
        late = np.linspace(0, after * span, after * elements + 1)[1:]
        nodes = [model.orbit_nodes(*start, early), self.nodes, model.orbit_nodes(*end, late)]
        times = [early, before * span + self.times, before * span + self.times[-1] + late]
        return ExitPath(model, np.concatenate(times), np.vstack(nodes))


def least(path: ExitPath, iterations=300, tolerance=1e-13) -> ExitPath:
    """The path of least action near this one, its first and last state held."""
    nodes, damping = path.nodes.copy(), 1e-3
    weights = np.diff(path.times)[:, None] * WEIGHTS
    steps = np.diff(path.times)
    scale = np.minimum(np.append(steps, np.inf), np.insert(steps, 0, np.inf))[:, None] ** np.arange(3)
    action, gradient, hessian = _expand(path, nodes, weights, scale)
    for _ in range(iterations):
        try:
            change = _solve(hessian, gradient, damping)
        except LinAlgError:
            damping = max(4 * damping, 1e-9)
            continue
        trial = nodes - change.reshape(-1, 3) / scale
        gained = action - 0.5 * np.sum(weights * path.noise(trial)[0] ** 2)
        if not gained > 0:
            if damping > 1e8 or abs(gained) <= tolerance * action:
                break
            damping = max(4 * damping, 1e-12)
            continue
        nodes, damping = trial, damping / 5 if damping > 1e-13 else 0.0
        action, gradient, hessian = _expand(path, nodes, weights, scale)
        if gained <= tolerance * action and damping < 1e-6:
            break
    try:
        cholesky_banded(hessian, lower=True)
        minimum = True
    except LinAlgError:
        minimum = False
    return dataclasses.replace(path, nodes=nodes, action=action, gradient=abs(gradient).max(), minimum=minimum)


def _solve(hessian, gradient, damping):
    damped = hessian.copy()
    damped[0] += damping * np.maximum(abs(hessian[0]), 1e-12)
    return cho_solve_banded((cholesky_banded(damped, lower=True), True), gradient)


def _expand(path, nodes, weights, scale):
    """Action, gradient and banded Hessian (lower form) in the scaled degrees of freedom."""
    u, in_x, in_v, in_xx, in_xv = path.noise(nodes)
    h, count = np.diff(path.times)[:, None, None], len(nodes)
    value, rate, bend = _SHAPES
    powers = np.diff(path.times)[:, None] ** np.arange(3)
    columns = np.hstack([powers / scale[:-1], powers / scale[1:]])[:, None, :]
    value, rate = value * columns, rate / h * columns
    jacobian = bend / h**2 * columns + in_v[:, :, None] * rate + in_x[:, :, None] * value
    gradients = ((weights * u)[:, None, :] @ jacobian)[:, 0]
    blocks = (jacobian * weights[:, :, None]).transpose(0, 2, 1) @ jacobian
    blocks += (value * (weights * u * in_xx)[:, :, None]).transpose(0, 2, 1) @ value
    mixed = (value * (weights * u * in_xv)[:, :, None]).transpose(0, 2, 1) @ rate
    blocks += mixed + mixed.transpose(0, 2, 1)
    gradient = np.zeros((count, 3))
    gradient[:-1] += gradients[:, :3]
    gradient[1:] += gradients[:, 3:]
    band = np.zeros((6, count, 3))
    for i in range(6):
        for j in range(i + 1):
            node, part = divmod(j, 3)
            band[i - j, node : count - 1 + node, part] += blocks[:, i, j]
    band, gradient = band.reshape(6, -1), gradient.ravel()
    for fixed in (0, 1, 3 * count - 3, 3 * count - 2):  # the states at both ends are held
        gradient[fixed] = 0.0
        band[:, fixed] = 0.0
        for offset in range(1, min(6, fixed + 1)):
            band[offset, fixed - offset] = 0.0
        band[0, fixed] = 1.0
    return 0.5 * np.sum(weights * u**2), gradient, band


def followed_in(path, shortest, rounds=12):
    """Least path with the elements at the stops halved until they are the shortest, solved anew every time."""
    path = least(path)
    for _ in range(rounds):
        chosen = path.touching(shortest)
        if not chosen.any():
            break
        path = least(path.split(chosen))
    return path

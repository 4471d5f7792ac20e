"""Runs of cheap scenes, x″ = −c x′ − a x − b x³ − k (x − p)₊ + F(t) + ξ, which share no code with the package.

Steps are those of Leimkuhler and Matthews (Appl. Math. Res. eXpress 2013, 34): half a kick, half a drift, the exact
Ornstein–Uhlenbeck step of the velocity, and back. They are of second order in law.
"""

import dataclasses
import math

import numba
import numpy as np


@numba.njit(cache=True)
def _runs(rng, starts, pushes, step, spring, damping, intensity, periods, cores, home, stop):
    """Periods after which each run is first at a core other than `home` (−1: never), the last core, and the last state.

    `cores` has a row for each: its centre, and the matrix R of the ellipse |R (q − c)| ≤ 1. Runs end there if `stop`.
    """
    keep = math.exp(-damping * step)
    kick, half = math.sqrt(intensity * (1 - keep**2) / (2 * damping)), 0.5 * step
    linear, cubic, stiffness, position = spring
    left, at, last = np.full(len(starts), -1), np.full(len(starts), home), np.empty((len(starts), 2))
    for run in range(len(starts)):
        x, v = starts[run]
        for period in range(periods):
            for k in range(len(pushes) - 1):
                force = pushes[k] - linear * x - cubic * x**3
                if x > position:
                    force -= stiffness * (x - position)
                v += half * force
                x += half * v
                v = keep * v + kick * rng.standard_normal()
                x += half * v
                force = pushes[k + 1] - linear * x - cubic * x**3
                if x > position:
                    force -= stiffness * (x - position)
                v += half * force
            for core in range(len(cores)):
                dx, dv = x - cores[core, 0], v - cores[core, 1]
                one = cores[core, 2] * dx + cores[core, 3] * dv
                other = cores[core, 4] * dx + cores[core, 5] * dv
                if one**2 + other**2 <= 1:
                    at[run] = core
            if left[run] < 0 and at[run] != home:
                left[run] = period + 1
                if stop:
                    break
        last[run] = x, v
    return left, at, last


@dataclasses.dataclass(frozen=True)
class Scene:
    """A scene with two attractors, given by a state in the basin of each."""

    spring: tuple[float, float, float, float]  # a, b, k and p
    damping: float
    amplitude: float
    frequency: float
    constant: float
    states: tuple[tuple[float, float], tuple[float, float]]
    steps: int  # in a period

    @property
    def period(self):
        return 2 * math.pi / self.frequency

    def run(self, starts, intensity, periods, cores=(), *, seed=0, home=0, stop=False):
        phases = 2 * math.pi * np.arange(self.steps + 1) / self.steps
        pushes = self.constant + self.amplitude * np.cos(phases)
        return _runs(
            np.random.default_rng(seed), np.array(starts, dtype=float), pushes, self.period / self.steps, self.spring,
            self.damping, intensity, periods, np.array(cores, dtype=float).reshape(-1, 6), home, stop,
        )  # fmt: skip

    def attractors(self):
        """Points of the attractors at t = 0."""
        return self.run(self.states, 0.0, 400)[2]

    def cores(self, intensity, weak=1e-4):
        """Ellipses of one standard deviation around the attractors, by what weak noise does."""
        found = []
        for point in self.attractors():
            ends = self.run(np.tile(point, (4000, 1)), weak, 40)[2]
            spread = np.cov(ends.T) * intensity / weak
            found.append([*ends.mean(axis=0), *np.linalg.cholesky(np.linalg.inv(spread)).T.ravel()])
        return found

    def exits(self, home, intensity, runs, periods, seed=1):
        """Periods after which each of so many runs from an attractor is at the other one; −1 for one that is not."""
        starts = np.tile(self.attractors()[home], (runs, 1))
        return self.run(starts, intensity, periods, self.cores(intensity), seed=seed, home=home, stop=True)[0]

    def shares(self, intensity, runs, periods, seed=2):
        """Share of runs that were at each attractor last, after so many periods, half of them from each one."""
        cores, points = self.cores(intensity), self.attractors()
        ends = [
            self.run(np.tile(point, (runs // 2, 1)), intensity, periods, cores, seed=seed + home, home=home)[1]
            for home, point in enumerate(points)
        ]
        return np.bincount(np.concatenate(ends), minlength=2) / len(np.concatenate(ends))


WELL = Scene((-1.0, 1.0, 0.0, 0.0), 0.8, 0.15, 1.0, 0.03, ((-1.0, 0.0), (1.0, 0.0)), 64)
"""A forced double well that leans to one side."""
STOP = Scene((1.0, 0.0, 100.0, 0.6), 0.2, 0.4, 1.4, 0.0, ((-0.384, 0.157), (-0.15, 1.47)), 200)
"""A forced linear oscillator with one linear stop: clear, or hammering."""

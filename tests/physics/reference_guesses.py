"""First guesses for `reference_action.least`."""

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from tests.physics.reference_action import ExitPath


def known_sections(frequency):
    """Rough (x, v, p₁, p₂) on successive sections along the hammering state's exit path."""
    rows = np.loadtxt(Path(__file__).with_name("reference_sections.txt"))
    return rows[rows[:, 0] == frequency, 1:]


def blended(model, start, end, before, crossing, after, elements, swing=None):
    """A first guess: on the first orbit, over to the second within so many periods, and on it.

    ``start`` and ``end`` are (state, periods); ``swing`` (size, rate, phase) adds an oscillation while crossing.
    """
    times = np.linspace(0, (before + crossing + after) * model.period, (before + crossing + after) * elements + 1)
    first, second = (model.orbit_nodes(*orbit, times) for orbit in (start, end))
    s = np.clip((times / model.period - before) / crossing, 0, 1)
    share = _rise(s)
    nodes = (1 - share) * first + share * second
    if swing is not None:
        size, rate, phase = swing
        bump, angle = size * 16 * s**2 * (1 - s) ** 2, rate * times + phase
        nodes += (bump * np.array([np.sin(angle), rate * np.cos(angle), -(rate**2) * np.sin(angle)])).T
    return ExitPath(model, times, nodes)


def pieced(model, source, target, sections, elements, before, after):
    """A first guess from rough (x, v, p₁, p₂) on successive sections: Hamilton's equations from each, for a period.

    The first repetition of the attractor is blended with the attractor's orbit, the last period with the saddle's.
    """

    def rates(t, z):
        slope = model.pull(np.array(z[0]), np.array(z[1]))[1]
        return z[1], model.acceleration(t, z[0], z[1]) + z[3], slope * z[3], -z[2] + 2 * model.damping * z[3]

    times = np.linspace(0, model.period, elements + 1)
    pieces = [solve_ivp(rates, times[[0, -1]], z, "DOP853", times, rtol=1e-8, atol=1e-11).y.T[:-1] for z in sections]
    z = np.vstack(pieces)
    times = np.linspace(0, len(sections) * model.period, len(z) + 1)
    fall = model.acceleration(times[:-1], z[:, 0], z[:, 1])
    first, last = model.orbit_nodes(*source, times), model.orbit_nodes(*target, times)
    nodes = np.vstack([np.column_stack([z[:, :2], fall + z[:, 3]]), last[-1:]])
    nodes = first + _rise(times / (source[1] * model.period)) * (nodes - first)
    nodes += _rise(times / model.period - len(sections) + 1) * (last - nodes)
    return ExitPath(model, times, nodes).extended(source, before, target, after, elements)


def _rise(s):
    """From 0 to 1 with two continuous derivatives, as a column."""
    s = np.clip(s, 0, 1)
    return (s**3 * (10 - 15 * s + 6 * s**2))[:, None]


def sampled(model, path, samples):
    """A path of the toolkit on its own samples, to the last of them on the section; `samples` in a period."""
    whole = (len(path.t) - 1) // samples * samples + 1
    t, (x, v), noise = path.t[:whole], path.q[:whole].T, path.p[:whole, 1]
    return ExitPath(model, t, np.column_stack([x, v, model.acceleration(t, x, v) + noise]))

"""The linear oscillator x″ + 2ζω_n x′ + ω_n² x = noise: everything in closed form."""

import functools

import numpy as np
import scipy.linalg

import vibrokit as vk


@functools.cache
def oscillator(damping, natural=1.0):
    return vk.Oscillator(natural_frequency=natural, damping_ratio=damping, noise=vk.WhiteNoise(1e-3))


@functools.cache
def structure(damping, natural=1.0):
    region = ((-2.0, 2.0), (-2.0 * natural, 2.0 * natural))
    return vk.find_structure(
        oscillator(damping, natural), region=region, cells=(20, 20), starts=(4, 4), saddles=False, manifolds=False
    )


def flow(damping, natural, time):
    """M of a time, and the covariance C of the noise, by Van Loan's block exponential."""
    drift = np.array([[0.0, 1.0], [-(natural**2), -2 * damping * natural]])
    blocks = scipy.linalg.expm(time * np.block([[-drift, np.diag([0.0, 1.0])], [np.zeros((2, 2)), drift.T]]))
    return blocks[2:, 2:].T, blocks[2:, 2:].T @ blocks[:2, 2:]


def potential(damping, natural, states):
    """½ δqᵀ Σ⁻¹ δq with Σ = diag(1/(4ζω_n³), 1/(4ζω_n))."""
    x, v = np.moveaxis(states, -1, 0)
    return 2 * damping * natural * (natural**2 * x**2 + v**2)

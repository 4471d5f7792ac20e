"""Linear spaces in which extremal paths leave and approach an orbit at p = 0."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from vibrokit.analyzers.paths.local_potential import stationary_covariance
from vibrokit.analyzers.paths.segment_propagator import SegmentPropagator
from vibrokit.errors import StructureError
from vibrokit.structure.linear_map import GaussianMap

_NEUTRAL = 1e-6  # distance of a multiplier's size from 1 below which its rate is lost in the orbit's own error

Array = NDArray[np.float64]


def check_hyperbolic(point: Array, multipliers: NDArray[np.complex128]) -> None:
    """Raise StructureError if a multiplier has the size 1."""
    nearest = multipliers[np.argmin(np.abs(np.abs(multipliers) - 1))]
    if not abs(abs(nearest) - 1) > _NEUTRAL:
        raise StructureError(
            f"the orbit at {tuple(point.tolist())} is not hyperbolic: it has the multiplier {nearest:.8g}, of "
            "size 1, so no path leaves or approaches it exponentially; move a parameter away from the bifurcation."
        )


def carried_along(
    linear: GaussianMap, unstable: Array, stable: Array, scale: Array, neutral: int = 0
) -> tuple[Array, Array]:
    """Return the spaces at all nodes, given at the first: the unstable one carried forward, the stable one backward.

    The first vectors of both, which are neutral, stay what they are.
    """
    steps = [extended(step, part) for step, part in zip(linear.derivatives, linear.covariances, strict=True)]
    forward, backward = [normalized(unstable, scale, neutral)], [normalized(stable, scale, neutral)]
    for node in range(len(steps) - 1):
        forward.append(normalized(steps[node] @ forward[-1], scale, neutral))
        before = np.asarray(np.linalg.solve(steps[-1 - node], backward[-1]), dtype=float)
        backward.append(normalized(before, scale, neutral))
    return np.array(forward), np.array([backward[0], *backward[:0:-1]])


def carried_around(linear: GaussianMap, turns: int, scale: Array) -> tuple[Array, Array]:
    """Return the spaces at all nodes of a closed orbit that has no neutral direction, without its map over a period.

    Any two spaces are carried some times around the orbit, one forward and one backward.
    """
    steps = [extended(step, part) for step, part in zip(linear.derivatives, linear.covariances, strict=True)]
    n = linear.images.shape[1]
    unstable, stable = np.random.default_rng(0).standard_normal((2, 2 * n, n)) * scale[:, None]
    for _ in range(turns):
        for step in steps:
            unstable = normalized(step @ unstable, scale, 0)
        for step in reversed(steps):
            stable = normalized(np.asarray(np.linalg.solve(step, stable), dtype=float), scale, 0)
    return carried_along(linear, unstable, stable, scale)


def normals_of(basis: Array, scale: Array) -> Array:
    """Return an orthonormal basis (n, 2n), in units of `scale`, of the complement of a space."""
    full = np.linalg.qr(basis / scale[:, None], mode="complete")[0]
    return full[:, basis.shape[1] :].T


def extended(step: Array, covariance: Array) -> Array:
    """E = [[M, C M⁻ᵀ], [0, M⁻ᵀ]]."""
    inverse = np.linalg.inv(step).T
    return np.block([[step, covariance @ inverse], [np.zeros_like(step), inverse]])


def invariant_spaces(monodromy: Array, covariance: Array, neutral: Array) -> tuple[Array, Array]:
    """Bases (2n, n) of the unstable and the stable space of the extended map.

    With the map's invariant spaces M V = V A and their dual bases Lᵀ (s stable, u unstable), the unstable space of the
    extended map is spanned by (V_u, 0) and (V_s y, L_s), y = A_s y A_sᵀ + L_sᵀ C L_s; for an attractor that is
    (Σ, 1). The stable space is spanned by (V_s, 0) and (V_u y, L_u) with the same equation for u. Both have the
    directions (V_0, 0) besides, in which paths are shifted in time: `neutral`, array (n, count).
    """
    _, stable, decaying = scipy.linalg.schur(monodromy / (1 - _NEUTRAL / 2), sort="iuc")
    _, unstable, growing = scipy.linalg.schur(monodromy / (1 + _NEUTRAL / 2), sort="ouc")
    vectors = np.hstack([stable[:, :decaying], unstable[:, :growing], neutral])
    duals = np.linalg.inv(vectors).T
    strict = slice(decaying, decaying + growing)
    v_s, v_u, l_s, l_u = vectors[:, :decaying], vectors[:, strict], duals[:, :decaying], duals[:, strict]
    y_s, y_u = np.zeros((decaying, decaying)), np.zeros((growing, growing))
    if decaying:
        y_s = stationary_covariance(l_s.T @ monodromy @ v_s, l_s.T @ covariance @ l_s)
    if growing:
        back = np.linalg.inv(l_u.T @ monodromy @ v_u)
        y_u = stationary_covariance(back, -back @ l_u.T @ covariance @ l_u @ back.T)
    still = np.hstack([neutral, v_u])
    leaving = np.hstack([np.vstack([still, np.zeros_like(still)]), np.vstack([v_s @ y_s, l_s])])
    still = np.hstack([neutral, v_s])
    approaching = np.hstack([np.vstack([still, np.zeros_like(still)]), np.vstack([v_u @ y_u, l_u])])
    return leaving, approaching


def scale_of(propagator: SegmentPropagator, covariance: Array) -> Array:
    """Sizes of (q, p) that belong together, for well-conditioned bases."""
    size = propagator.units
    gathered = np.maximum(np.diag(covariance) / size, np.finfo(float).tiny)
    return np.concatenate([size, 1 / np.maximum(gathered, 1e-12 * gathered.max())])


def normalized(basis: Array, scale: Array, neutral: int) -> Array:
    """Return a basis of the same space, in units of `scale`: its first vectors as they are, the others orthonormal."""
    still, others = np.hsplit(basis / scale[:, None], [neutral])
    still = still / np.linalg.norm(still, axis=0)
    return np.asarray(scale[:, None] * np.hstack([still, np.linalg.qr(others)[0]]), dtype=np.float64)

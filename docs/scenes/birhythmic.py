"""
Two limit cycles
================

A self-excited oscillator can have two rhythms. This one extends van der Pol's equation by terms of higher order: small
and large limit cycles attract, and an unstable cycle separates them. Models of enzyme reactions have this form.
Source: R. Yamapi, G. Filatrella, M. A. Aziz-Alaoui and H. A. Cerdeira, *Chaos* 22, 043114, 2012 (doi
10.1063/1.4766678).
"""

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

mu, alpha, beta = 0.1, 0.144, 0.005
osc = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=0.0,
    spring=vk.CustomSpring("x - mu*(1 - x**2 + al*x**4 - be*x**6)*v", mu=mu, al=alpha, be=beta),
    noise=vk.WhiteNoise(intensity=0.003),
)
structure = vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)
print(structure)

# %%
# Both cycles in the phase plane, and the unstable cycle between them. Rest is unstable.

fig, ax = plt.subplots(figsize=(6.0, 5.0), layout="constrained")
for state in structure.attractors:
    ax.plot(state.orbit[:, 0], state.orbit[:, 1], label=state.name)
(saddle,) = structure.saddles
ax.plot(saddle.orbit[:, 0], saddle.orbit[:, 1], "k--", linewidth=1.0, label="unstable cycle")
ax.set_xlabel("displacement $x$ (m)")
ax.set_ylabel(r"velocity $v$ (m s$^{-1}$)")
legend = ax.legend(loc="center")

# %%
# For :math:`\mu \to 0` averaging gives the amplitudes as the roots of :math:`1 - A^2/4 + \alpha A^4/8 - 5\beta
# A^6/64`; corrections are of the order of :math:`\mu^2` = 1 %.

squares = np.roots([-5 * beta / 64, alpha / 8, -1 / 4, 1])
averaged = np.sort(np.sqrt(squares.real))
found = sorted(np.ptp(orbit.extent[0]) / 2 for orbit in structure.attractors)
print("amplitudes:", np.round(found, 4), "averaging:", np.round(averaged[[0, 2]], 4))
assert np.allclose(found, averaged[[0, 2]], rtol=0.01)

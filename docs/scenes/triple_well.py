"""
Three wells
===========

A mass in a potential with three wells has three states of rest. From an outer well every exit leads through the middle one.
The most probable exit path leaves a well against the flow: without noise the mass would run down the same path in the
opposite direction of time.
"""

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

damping = 0.1
osc = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=damping,
    spring=vk.CustomSpring("x*(x**2 - 1)*(x**2 - 4)/4"),
    noise=vk.WhiteNoise(intensity=0.01),
)
structure = vk.find_structure(osc, cells=(80, 80), starts=(8, 8), manifolds=False)
print(structure)

# %%
# Exit paths to the neighbouring wells, in the phase plane over the basins.

result = vk.LeastAction(shooting=None, graph=vk.GraphSearch(nodes=(60, 60))).run(osc, structure)
fig, ax = plt.subplots(figsize=(7.2, 5.4), layout="constrained")
drawn = result.plot(ax=ax)

# %%
# With linear damping and white noise, :math:`\Delta U = 4\zeta\omega_n` times the height of the barrier of
# :math:`V = x^6/24 - 5x^4/16 + x^2/2`.


def potential(x):
    return x**6 / 24 - 5 * x**4 / 16 + x**2 / 2


print(vk.Transitions.of(result))
for source, target, exact in (
    ("centre", "right", 4 * damping * (potential(1.0) - potential(0.0))),
    ("right", "centre", 4 * damping * (potential(1.0) - potential(2.0))),
):
    print(source, target, exact)
print(np.round([energy.value for energy in result.energies], 8), structure.names)

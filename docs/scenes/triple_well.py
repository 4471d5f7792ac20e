"""
Three wells
===========

A mass in a potential with three wells has three states of rest. From an outer well every exit leads through the middle
one. The most probable exit path leaves a well against the flow: without noise the mass would run down the same path in
the opposite direction of time.
"""

import matplotlib.pyplot as plt

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
# Exit paths from the middle and the right well to their neighbours, in the phase plane over the basins of attraction.
# Each one winds outwards from a rest to a saddle.

search = [
    vk.LeastAction(source=source, shooting=None, graph=vk.GraphSearch(nodes=(32, 32))) for source in ("middle", "right")
]
results = [each.run(osc, structure) for each in search]
fig, ax = plt.subplots(figsize=(6.8, 4.8), layout="constrained")
drawn = structure.plot(ax=ax)
for energy in (
    results[0].energy("middle", "left"),
    results[0].energy("middle", "right"),
    results[1].energy("right", "middle"),
):
    ax.plot(energy.path.q[:, 0], energy.path.q[:, 1], color="black", linewidth=0.9)
limits = ax.set(xlim=(-3, 3), ylim=(-2, 2))

# %%
# With linear damping and white noise, :math:`\Delta U = 4\zeta\omega_n\,\Delta V`, where :math:`\Delta V` is the
# height of the barrier of :math:`V = x^6/24 - 5x^4/16 + x^2/2`.


def potential(x):
    return x**6 / 24 - 5 * x**4 / 16 + x**2 / 2


for found, rest in ((results[0].energy("middle", "right"), 0.0), (results[1].energy("right", "middle"), 2.0)):
    exact = 4 * damping * (potential(1.0) - potential(rest))
    print(f"from the rest at x = {rest}: ΔU = {found.value:.9f} m² s⁻³; closed form: {exact:.9f}")
    assert abs(found.value / exact - 1) < 1e-6

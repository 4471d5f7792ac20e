"""
Escape of a Josephson junction
==============================

The phase :math:`\\varphi` of a junction with a bias current moves like a particle in a tilted washboard potential. In
the zero-voltage state it rests in a well. Thermal noise drives it over the barrier; the junction then switches to the
running state or moves to the next well. With :math:`\\beta\\varphi'' + \\varphi' + \\sin\\varphi = I` divided by
:math:`\\beta` it is a scene. The escape is that of a Brownian particle in a tilted periodic potential (H. Risken, *The
Fokker–Planck Equation*, chapter 11).
"""

import math

import matplotlib.pyplot as plt

import vibrokit as vk

capacitance, current = 1.25, 0.7  # β and I
osc = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=1 / (2 * capacitance),
    spring=vk.CustomSpring("sin(x)/b", b=capacitance),
    excitations=(vk.Constant(current / capacitance),),
    noise=vk.WhiteNoise(intensity=0.05),
)
structure = vk.find_structure(osc, cells=(60, 60), starts=(8, 8), manifolds=False)
graph = vk.ActionGraph(nodes=(100, 100)).run(osc, structure)
energy = vk.LeastAction(shooting=None, graph=vk.GraphSearch(nodes=(40, 40))).run(osc, structure).energies[0]
print(structure)

# %%
# The colours show the quasi-potential of the rest: the least action of noise that takes the phase to each state. The
# line is the most probable exit path; it ends on the saddle.

fig, ax = plt.subplots(figsize=(6.4, 4.8), layout="constrained")
drawn = graph.plot(ax=ax)
path = ax.plot(energy.path.q[:, 0], energy.path.q[:, 1], color="black", linewidth=1.0)
ax.set(xlim=(-1.0, 4.0), ylim=(-1.4, 1.4))
ax.set_xlabel(r"phase $\varphi$ (rad)")
label = ax.set_ylabel(r"velocity $\varphi'$ (rad s$^{-1}$)")

# %%
# ΔU is :math:`4\zeta\omega_n` times the barrier of the washboard: :math:`\Delta U = \tfrac{2}{\beta^2}\left(2\sqrt{1 -
# I^2} - 2I\arccos I\right)`.

exact = 2 / capacitance**2 * (2 * math.sqrt(1 - current**2) - 2 * current * math.acos(current))
print(f"ΔU = {energy.value:.9f} m² s⁻³; closed form: {exact:.9f}")
assert abs(energy.value / exact - 1) < 2e-6

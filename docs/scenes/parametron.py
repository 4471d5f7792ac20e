"""
Parametron
==========

The stiffness of a resonator varies at twice its natural frequency. Above a threshold rest loses its stability, and the
resonator swings at half the frequency of the variation, in one of two opposite phases. The two phases store a bit;
noise flips it. A force of amplitude 0 makes two periods of the stiffness the section interval, so that each phase is a
steady state of its own.
"""

import math

import matplotlib.pyplot as plt

import vibrokit as vk

damping, depth = 0.05, 0.3  # γ = 2ζω_n and λ
osc = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=damping / 2,
    spring=vk.CubicSpring(linear=1.0, cubic=1.0),
    excitations=(
        vk.ParametricStiffness(stiffness=depth, frequency=2.0, phase=math.pi),
        vk.Harmonic(amplitude=0.0, frequency=1.0),
    ),
    noise=vk.WhiteNoise(intensity=1e-3),
)
structure = vk.find_structure(osc, cells=(40, 40), starts=(6, 6), saddles=False)
print(structure)

# %%
# A noisy motion, seen once in two periods of the stiffness: it stays near one phase and flips to the other one. Lines
# mark the two phases without noise.

section = osc.trajectory(structure.attractors[0].points[0], periods=1500, samples=1, rng=3)
fig, ax = plt.subplots(layout="constrained")
ax.plot(section.t / osc.period, section.x, ".", markersize=3)
for state in structure.attractors:
    ax.axhline(state.points[0, 0], color="0.5", linewidth=0.8)
ax.set_xlabel("time $t/T$")
label = ax.set_ylabel("displacement on the section $x$ (m)")

# %%
# Rest loses its stability at :math:`\lambda = 2\gamma`, up to a relative error of the order of :math:`\gamma^2` (A. H.
# Nayfeh and D. T. Mook, *Nonlinear Oscillations*, chapter 5). Two periods of the stiffness are one of the section;
# without the second force, the loss of stability is a period doubling.

single = osc.replace(excitations=osc.excitations[:1], noise=None)
sweep = vk.continuation(single, "stiffness", [0.05, 0.15], cells=None, starts=(4, 4))
threshold = next(each for each in sweep.bifurcations if each.kind == "period doubling")
print(f"threshold λ = {threshold.value:.8f}; leading order 2γ = {2 * damping}")
assert abs(threshold.value / (2 * damping) - 1) < damping**2

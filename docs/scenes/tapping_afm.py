"""
Tapping-mode atomic force microscope
====================================

The tip of a cantilever vibrates at its resonance, 300 kHz, close to a surface. Van der Waals forces attract it and,
below 0.3 nm, the surface repels it as a Hertzian contact (Derjaguin, Muller and Toporov). At the same drive the tip
can stay clear of the surface or tap it. A change between the two states is a step in the image. The numbers are those
of AFMsimulations.jl, after U. D. Schwarz and H. Hölscher (2007).
"""

import math

import matplotlib.pyplot as plt

import vibrokit as vk

natural, quality, stiffness = 2 * math.pi * 300e3, 300.0, 40.0  # rad s⁻¹, 1, N/m
mass = stiffness / natural**2  # 11 ng
hamaker, radius, closest, distance = 2e-19, 10e-9, 0.3e-9, 8.5e-9  # J, m, m, m
modulus = 1 / ((1 - 0.3**2) / 1e9 + (1 - 0.3**2) / 130e9)  # Pa, of tip and sample together
osc = vk.Oscillator(
    natural_frequency=natural,
    damping_ratio=1 / (2 * quality),
    spring=vk.CustomSpring(
        "w2*x - a/max(d - x, a0)**2", w2=natural**2, a=hamaker * radius / (6 * mass), d=distance, a0=closest
    ),
    barriers=(
        vk.Barrier(vk.Hertz(4 / 3 * modulus * math.sqrt(radius) / mass), position=distance - closest, side="right"),
    ),
    excitations=(vk.Harmonic(amplitude=1.333e-9 / mass, frequency=1.0005 * natural),),
)
structure = vk.find_structure(osc, cells=(20, 20), starts=(8, 8), saddles=False)
print(structure)

# %%
# Displacement of both states over two periods, and the distance at which the tip touches the surface.

fig, ax = plt.subplots(layout="constrained")
for state in structure.attractors:
    path = osc.trajectory(state.points[0], periods=2, samples=512)
    ax.plot(1e6 * path.t, 1e9 * path.x, label=state.name)
ax.axhline(1e9 * (distance - closest), color="0.5", linestyle="--", label="surface")
ax.set_xlabel(r"time $t$ (µs)")
ax.set_ylabel(r"displacement $x$ (nm)")
legend = ax.legend()

# %%
# Balance of one harmonic gives the amplitudes 8.17 nm and 9.83 nm, with an error of the order of :math:`1/Q`, that is,
# below 1 %.

found = sorted((state.extent[0, 1] - state.extent[0, 0]) / 2 for state in structure.attractors)
for amplitude, balance in zip(found, (8.17e-9, 9.83e-9), strict=True):
    print(f"amplitude {1e9 * amplitude:.3f} nm; one-harmonic balance: {1e9 * balance:.2f} nm")
    assert abs(amplitude / balance - 1) < 0.01

"""
A steel ball between two plates
===============================

A steel ball on a leaf spring moves between two steel plates and is shaken at 50 Hz. All numbers are in metres, seconds
and kilograms. The contact stiffness follows from the elastic constants by Hertz's theory. At the same shaking the ball
runs clear of the plates, or strikes both of them in each period.
"""

import math

import matplotlib.pyplot as plt

import vibrokit as vk

modulus, poisson, density = 210e9, 0.3, 7850.0  # Pa, 1, kg m⁻³
radius, gap = 10e-3, 0.1e-3  # m
mass = density * 4 / 3 * math.pi * radius**3  # kg
stiffness = 4 / 3 * modulus / (2 * (1 - poisson**2)) * math.sqrt(radius) / mass  # m^(−1/2) s⁻²
natural, damping, shaking, frequency = 2 * math.pi * 40.0, 0.05, 3.0, 2 * math.pi * 50.0
osc = vk.Oscillator(
    natural_frequency=natural,
    damping_ratio=damping,
    barriers=(
        vk.Barrier(vk.Hertz(stiffness), position=gap, side="right"),
        vk.Barrier(vk.Hertz(stiffness), position=-gap, side="left"),
    ),
    excitations=(vk.Harmonic(amplitude=shaking, frequency=frequency),),
)
structure = vk.find_structure(osc, cells=(40, 40), starts=(12, 12), saddles=False)
clear, hammering = structure.attractors
print(structure)

# %%
# Displacement of both states over one period, between the plates.

fig, ax = plt.subplots(layout="constrained")
for state in structure.attractors:
    path = osc.trajectory(state.points[0], periods=1, samples=2048)
    ax.plot(1e3 * path.t, 1e6 * path.x, label=state.name)
for plate in (-gap, gap):
    ax.axhline(1e6 * plate, color="0.5", linewidth=0.8)
ax.set_xlabel("time $t$ (ms)")
ax.set_ylabel("displacement $x$ (µm)")
legend = ax.legend(loc="upper right")

# %%
# Without contact the amplitude is that of a linear oscillator.

amplitude = shaking / math.hypot(natural**2 - frequency**2, 2 * damping * natural * frequency)
print(f"amplitude clear of the plates: {1e6 * clear.extent[0, 1]:.4f} µm; closed form: {1e6 * amplitude:.4f} µm")
assert abs(clear.extent[0, 1] / amplitude - 1) < 1e-5

# %%
# A free ball that arrives at the speed :math:`v` enters to the depth :math:`\delta = (5v^2/4k)^{2/5}` (K. L. Johnson,
# *Contact Mechanics*, section 11.4).

speed = 0.1  # m/s
free = osc.replace(spring=vk.LinearSpring(stiffness=0.0), damping_ratio=0.0, excitations=())
depth = free.trajectory((gap, speed), duration=1e-4, samples=10**6).x.max() - gap
exact = (5 * speed**2 / (4 * stiffness)) ** 0.4
print(f"depth at {speed} m/s: {1e6 * depth:.5f} µm; Hertz: {1e6 * exact:.5f} µm")
assert abs(depth / exact - 1) < 1e-5

"""
A valve with dry friction
=========================

A spring-loaded valve of 0.34 g moves between two seats 1.016 mm apart, under a pressure that pulsates at 250 Hz. Dry
friction of 1 N acts on it, and each impact keeps 0.3 of the speed. The valve flies from seat to seat, bounces, and
rests until the pressure changes. The scene is that of a user of DifferentialEquations.jl, whose event was missed so
that the mass flew through the seat (SciML/DiffEqBase.jl, issue 634).
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

mass, area, unit = 3.3612e-4, 7.37366e-5, 6895.0  # kg, m², Pa in a pound per square inch
stiffness, damping = 1e10, 0.497239  # of the seats; the damping gives the restitution 0.3 of a stop that does not pull
seat = vk.KelvinVoigt(stiffness, 2 * damping * math.sqrt(stiffness))
osc = vk.Oscillator(
    natural_frequency=math.sqrt(1488.578 / mass),
    damping_ratio=0.0,
    friction=vk.DryFriction(magnitude=1.0 / mass, width=1e-3),
    barriers=(vk.Barrier(seat, position=1.016e-3, side="right"), vk.Barrier(seat, position=0.0, side="left")),
    excitations=(
        vk.Constant((18 * unit * area - 8.54503) / mass),
        vk.Harmonic(4 * unit * area / mass, 2 * math.pi * 250, phase=-math.pi / 2),
    ),
)
structure = vk.find_structure(osc, cells=(20, 20), starts=(6, 6), saddles=False)
(state,) = structure.attractors
print(structure)

# %%
# Displacement over two periods, and the seats. After the impact on the right seat friction holds the valve beside it.

path = osc.trajectory(state.points[0], periods=2, samples=100_000)
fig, ax = plt.subplots(layout="constrained")
ax.plot(1e3 * path.t, 1e3 * path.x)
for position in path.stops:
    ax.axhline(1e3 * position, color="0.5", linewidth=0.8)
ax.set_xlabel("time $t$ (ms)")
label = ax.set_ylabel("displacement $x$ (mm)")

# %%
# Event stepping with rigid seats, in steps of 0.2 µs, gives impacts at 2.09 m/s on the right seat and at 2.30 m/s on
# the left one. The elastic seats agree with it to about 2 %.


def impact_speed(depth, v):
    """Largest speed at which a depth becomes positive."""
    arrivals = np.flatnonzero((depth[:-1] < 0) & (depth[1:] >= 0))
    return np.abs(v[arrivals]).max()


right, left = impact_speed(path.x - 1.016e-3, path.v), impact_speed(-path.x, path.v)
print(f"impact speeds: {right:.3f} and {left:.3f} m/s; rigid seats: 2.09 and 2.30 m/s")
assert abs(right / 2.09 - 1) < 0.02
assert abs(left / 2.30 - 1) < 0.02

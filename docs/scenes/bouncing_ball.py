"""
A ball on a vibrating table
===========================

A ball bounces on a table that moves as :math:`A\\sin\\omega t`. The coordinate is the height above the table, so that the
table is a stop at rest and its acceleration a force. Lengths are in :math:`g/\\omega^2` and times in :math:`1/\\omega`.
The only parameter is then :math:`\\Gamma = A\\omega^2/g`. A steady bounce once a period loses its stability by period
doubling. Source: J. J. Barroso, M. V. Carneiro and E. E. N. Macau, *Physical Review E* 79, 026206, 2009.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

restitution = 0.5
stiffness, damping = 1e8, 0.255276  # of the contact; the damping gives the restitution 0.5 of a stop that does not pull
osc = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=0.0,
    spring=vk.LinearSpring(stiffness=0.0),
    barriers=(vk.Barrier(vk.KelvinVoigt(stiffness, 2 * damping * math.sqrt(stiffness)), position=0.0, side="left"),),
    excitations=(vk.Constant(-1.0), vk.Harmonic(amplitude=1.4, frequency=1.0, phase=-math.pi / 2)),
)
values = [1.4, 1.6]
sweep = vk.continuation(osc, "amplitude", values, cells=None, starts=(6, 6), stepper=vk.FreeFlight())
print(sweep)

# %%
# Motions of table and ball below and above the period doubling: all bounces are alike at :math:`\Gamma = 1.4`, and every
# second one at :math:`\Gamma = 1.6`.

fig, panels = plt.subplots(2, 1, sharex=True, layout="constrained")
for ax, at in zip(panels, (sweep.states[0], sweep.states[-1]), strict=True):
    state = max(at.attractors, key=lambda each: each.extent[0, 1])
    path = osc.replace({"excitations.1.amplitude": at.value}).trajectory(state.points[0], periods=4, samples=1024)
    table = at.value * np.sin(path.t)
    ax.plot(path.t / osc.period, table, color="0.5", label="table")
    ax.plot(path.t / osc.period, path.x + table, label="ball")
    ax.set_title(rf"$\Gamma$ = {at.value:g}, period {state.period}", fontsize=9)
    ax.set_ylabel(r"height ($g/\omega^2$)")
panels[1].set_xlabel(r"time $t/T$")
legend = panels[1].legend()

# %%
# For a rigid table with restitution :math:`e`, one bounce a period exists above :math:`\Gamma_1 = \pi(1 - e)/(1 + e)` and
# is stable up to :math:`\Gamma_2 = \sqrt{\Gamma_1^2 + \left(2(1 + e^2)/(1 + e)^2\right)^2}`. The elastic table differs
# from it by the order of the contact time, :math:`\pi/\sqrt k` = 3e-4, times the slope of the bounce.

first = math.pi * (1 - restitution) / (1 + restitution)
exact = math.hypot(first, 2 * (1 + restitution**2) / (1 + restitution) ** 2)
doubling = next(each for each in sweep.bifurcations if each.kind == "period doubling")
print(f"period doubling at Γ = {doubling.value:.5f}; rigid table: {exact:.5f}")
assert abs(doubling.value - exact) < 0.005

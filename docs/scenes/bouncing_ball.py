"""
A ball on a vibrating table
===========================

A ball bounces on a table that moves as :math:`A\\sin\\omega t`. The coordinate is the height above the table, so that
the table is a stop at rest and its acceleration a force. Lengths are in :math:`g/\\omega^2` and times in
:math:`1/\\omega`. The only parameter is then :math:`\\Gamma = A\\omega^2/g`. A steady bounce once a period loses its
stability by period doubling. Source: J. J. Barroso, M. V. Carneiro and E. E. N. Macau, *Physical Review E* 79, 026206,
2009.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

restitution, stiffness = 0.5, 1e8
damping = 2 * 0.255276 * math.sqrt(stiffness)  # gives this restitution to a stop that does not pull
osc = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=0.0,
    spring=vk.LinearSpring(stiffness=0.0),
    barriers=(vk.Barrier(vk.KelvinVoigt(stiffness, damping), position=0.0, side="left"),),
    excitations=(vk.Constant(-1.0), vk.Harmonic(amplitude=1.4, frequency=1.0, phase=-math.pi / 2)),
)


def settled(gamma, start, periods):
    """States on the section during the last 32 of some periods."""
    shaken = osc.replace({"excitations.1.amplitude": gamma})
    return shaken.trajectory(start, periods=periods, samples=1, stepper=vk.Order8(1e-10)).states[-32:]


# %%
# Each column of the picture has the heights once a period, after 300 periods that begin at the last state of the
# column before. One bounce a period turns into two different ones, then into four, and so on to chaos.

state = (2.9, -3.8)
fig, ax = plt.subplots(layout="constrained")
for gamma in np.linspace(1.4, 1.72, 161):
    states = settled(gamma, state, 300)
    state = states[-1]
    ax.plot(np.full(32, gamma), states[:, 0], ".", color="C0", markersize=1.5)
ax.set_xlabel(r"acceleration of the table $\Gamma$")
label = ax.set_ylabel(r"height above the table on the section $x$ ($g/\omega^2$)")

# %%
# For a rigid table with restitution :math:`e`, one bounce a period exists above :math:`\Gamma_1 = \pi(1 - e)/(1 + e)`
# and is stable up to :math:`\Gamma_2 = \sqrt{\Gamma_1^2 + \left(2(1 + e^2)/(1 + e)^2\right)^2}`. The contact with the
# elastic table lasts about 3e-4; its period doubling agrees with :math:`\Gamma_2` to 0.005.

first = math.pi * (1 - restitution) / (1 + restitution)
exact = math.hypot(first, 2 * (1 + restitution**2) / (1 + restitution) ** 2)
before, after = (np.ptp(settled(exact + step, (2.9, -3.8), 3000)[:, 0]) for step in (-0.005, 0.005))
print(f"rigid table: period doubling at Γ = {exact:.6f}")
print(f"difference of successive heights: {before:.1e} at Γ − 0.005, {after:.3f} at Γ + 0.005")
assert before < 1e-3 < 0.1 < after

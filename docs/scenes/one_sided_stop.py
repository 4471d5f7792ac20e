"""
A one-sided stop at resonance
=============================

A mass on a spring is driven at its natural frequency and has one stop. The orbit that runs clear of the stop grows
with the forcing until it grazes the stop. Beyond grazing the stop limits the displacement. The scene is the impact
oscillator of Example 15.2 in *Recipes for Continuation* (H. Dankowicz and F. Schilder, SIAM, 2013), with a stiff
elastic stop instead of a rigid one.
"""

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

frequency, damping = 1.0, 0.05
osc = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=damping,
    barriers=(vk.Barrier(vk.Linear(stiffness=100.0), position=1.0, side="right"),),
    excitations=(vk.Harmonic(amplitude=0.09, frequency=frequency),),
)
amplitudes = np.linspace(0.06, 0.18, 9)
sweep = vk.continuation(osc, "amplitude", amplitudes, cells=(20, 20), starts=(12, 12))
print(sweep)

# %%
# The picture shows the largest displacement of each steady state against the forcing amplitude. Without the stop it is
# the dashed line.

fig, ax = plt.subplots(layout="constrained")
for name in sweep.branch_names:
    points = [(value, state.extent[0, 1]) for value, state in sweep.branch(name)]
    ax.plot(*np.transpose(points), "o", label=name)
ax.axhline(1.0, color="0.5", label="stop")
ax.plot(amplitudes, amplitudes / (2 * damping), "--", color="0.5", label="no stop")
ax.set_xlabel(r"forcing amplitude $f$ (m s$^{-2}$)")
ax.set_ylabel(r"largest displacement $x$ (m)")
legend = ax.legend()

# %%
# The clear orbit grazes the stop at :math:`x = 1` when its amplitude is 1, that is, at :math:`f = \sqrt{(1 -
# \omega^2)^2 + (2\zeta\omega)^2}`, whatever the contact law.

grazing = next(each for each in sweep.bifurcations if each.kind == "grazing")
exact = np.hypot(1 - frequency**2, 2 * damping * frequency)
print(f"grazing at f = {grazing.value:.10f}; closed form: {exact:.10f}")
assert abs(grazing.value - exact) < 1e-8

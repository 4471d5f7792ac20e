"""
Steady states without noise
===========================

**Question:** Which steady states does a scene have, which starts lead to each of them, and
what separates them?

The stability of a steady state against noise depends on the motion without noise. This
tutorial computes the structure of the scene of the first tutorial: attractors, basins and
the saddle between them. It compares the numbers with closed forms, computes the smallest
kick that leaves each basin, and follows the states as the forcing frequency changes.

``python tutorials/03_without_noise.py`` prints the numbers of this page and then shows
its pictures in windows. Without a display it only prints.
"""

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

# %%
# The structure of a scene
# ------------------------
#
# ``find_structure`` integrates a grid of starts until each motion recurs on the section,
# and refines the orbits by Newton's method. It computes the attractor of each cell of a
# grid (the basins), follows the basin boundary to the saddle on it, and grows the stable
# and the unstable manifold of the saddle.

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, rng=0)
print(structure.status)

# %%
# The picture shows the section. Each point is a start; its pale colour is the state to
# which it leads. The clear-running state has a narrow, winding basin. Its boundary is the
# stable manifold of the saddle.

fig, ax = plt.subplots(layout="constrained")
structure.plot(ax=ax)

# %%
# The attractors
# --------------
#
# ``name`` describes the motion. ``period`` is in forcing periods. ``hits`` counts the
# entries into contact with each stop per orbit. The share of the region that the basin
# covers has a standard error, since it is counted on cells.

for a in structure.attractors:
    share, error = 100 * a.basin_fraction, 100 * a.basin_fraction_error
    print(f"{a.name}: {a.kind}, period {a.period}, hits {dict(a.hits)}")
    print(f"    basin {share:.1f} ± {error:.1f} % of the region")
    print(f"    largest contact force per unit mass {max(a.peak_force.values()):.3f}")
    print(f"    residual {a.residual:.0e}, error {a.error:.0e}")

# %%
# ``residual`` is the closing error of the orbit; ``error`` is its change when the
# integration tolerance is reduced by a factor of 100. The clear-running state is that of
# a linear oscillator, so that both can be compared with the true error.

clear, hammering = structure.attractors
zeta, omega, f0, f1 = 0.01, 0.57, 0.18, 0.2  # ω_n = 1
response = f0 / (1 - omega**2 + 2j * zeta * omega)
exact = np.array([f1 + response.real, (1j * omega * response).real])
x, v = clear.points[0]
print(f"clear-running:  x = {x:.12f}, v = {v:.12f}")
print(f"closed form:    x = {exact[0]:.12f}, v = {exact[1]:.12f}")

# %%
# Both motions over one period, in the phase plane:

fig, ax = plt.subplots(layout="constrained")
structure.plot_orbits(ax=ax)

# %%
# The saddle
# ----------
#
# The saddle is an unstable orbit on the basin boundary. One of its multipliers lies
# outside the unit circle: a deviation in that direction grows by this factor per period.
# The most probable exit path of each basin ends on it. ``leads_to`` has the attractors
# on both sides.

(saddle,) = structure.saddles
x, v = saddle.points[0]
print(f"saddle of period {saddle.period} at x = {x:.6f}, v = {v:.6f}")
print("multipliers", saddle.multipliers.real.round(4))
print("between the attractors", saddle.leads_to)

# %%
# The stops conserve energy. The product of the multipliers of each orbit of period T is
# therefore :math:`e^{-2\zeta\omega_n T}`, at the attractors as well as at the saddle.

contraction = float(np.exp(-2 * zeta * osc.period))
orbits = {"clear-running": clear, "hammering": hammering, "saddle": saddle}
products = [float(np.prod(orbit.multipliers).real) for orbit in orbits.values()]
for name, product in zip(orbits, products, strict=True):
    print(f"{name:<14} product {product:.10f}, exact {contraction:.10f}")

# %%
# The smallest kick
# -----------------
#
# A state with a large basin may still be close to the basin boundary. The smallest kick
# that leaves the basin, in the least favourable direction and at the least favourable
# time, measures this distance. It is not the activation energy: noise leaves the basin by
# many small pushes, each at the right time.

stability = vk.shape_stability(osc, structure)
for s in stability:
    kick, push = s.any_kick, s.velocity_kick
    print(f"{structure.names[s.label]}:")
    print(f"    smallest kick {kick.size:.4f}, at t = {kick.time / osc.period:.2f} T")
    print(f"    in velocity alone {push.size:.4f}")

# %%
# Continuation in the frequency
# -----------------------------
#
# ``continuation`` finds the steady states at each value of a parameter, joins them into
# branches and locates bifurcations.

frequencies = np.linspace(0.57, 0.65, 9)
name = "excitations.0.frequency"
sweep = vk.continuation(osc, name, frequencies, cells=(40, 40), starts=(12, 12))
print(sweep.status)
for bifurcation in sweep.bifurcations:
    print(bifurcation)

# %%
# Towards the resonance the amplitude of the clear-running state grows until the orbit
# grazes the right stop. This happens where the amplitude
# :math:`f_0/\sqrt{(\omega_n^2 - \omega^2)^2 + (2\zeta\omega_n\omega)^2}` equals the
# distance 0.3 from the offset to the stop, which is a quadratic equation in
# :math:`\omega^2`.

squares = np.roots([1, 4 * zeta**2 - 2, 1 - (f0 / (0.5 - f1)) ** 2])
grazing = float(np.sqrt(squares.min()))
right = [b for b in sweep.bifurcations if b.kind == "grazing" and b.side == "right"]
located = min((b.value for b in right), key=lambda value: abs(value - grazing))
print(f"grazing: located at ω = {located:.10f}, closed form {grazing:.10f}")

# %%
# The branches show the displacement of each state on the section, and the shares show how
# much of the region each basin covers.

fig, ax = plt.subplots(layout="constrained")
sweep.plot(ax=ax)

fig, ax = plt.subplots(layout="constrained")
sweep.plot_fractions(ax=ax)

# %%
# What you saw
# ------------
#
# * The scene has two attractors of period T and one saddle between their basins.
# * The clear-running state, the products of the multipliers and the grazing frequency
#   agree with closed forms.
# * Basin size and smallest kick describe stability without noise. They are not the
#   activation energy.
#
# :doc:`/how-to/structure` has more on this search. The next tutorial,
# :doc:`04_least_action`, adds weak noise.

plt.show()

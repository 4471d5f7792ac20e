"""
Activation energies
===================

**Question:** How stable is each state against weak noise, and along which path is it left?

Noise eventually drives a mass out of any steady state. The mean exit time grows like
:math:`e^{\\Delta U/D}` as the noise intensity D (m² s⁻³) decreases. The activation energy
:math:`\\Delta U` is the least action of all exit paths, and the path of least action is
the most probable exit path (:doc:`/theory/exit-paths`). This tutorial computes an energy
that is known in closed form, then those of the two states of the earlier tutorials with
their certificates. It shows how a search can miss the path of least action, computes the
energy of a first contact, and derives the long-term behaviour.

``python tutorials/04_least_action.py`` prints the numbers of this page and then shows its
pictures in windows. Without a display it only prints. It takes about half a minute, and
longer the first time, when the equations are compiled.
"""

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

# %%
# A double well with a known answer
# ---------------------------------
#
# The unforced double well has the potential :math:`x^4/4 - x^2/2`. Its barrier is 1/4.
# Without forcing, the path of least action out of a well is the time-reversed relaxation
# into it. On this path the noise force must be twice the damping force, so that the
# momentum is :math:`p_2 = 4\zeta\omega_n v`, and the action is :math:`4\zeta\omega_n`
# times the barrier.

well = vk.load_scene("double-well")
wells = vk.find_structure(well, cells=(60, 60), rng=0)
graph = vk.GraphSearch(nodes=(160, 160))
climb = vk.LeastAction(graph=graph, shooting=None, source=0).run(well, wells)
(energy,) = climb.energies

zeta = well.parameters["damping_ratio"]
exact = 4 * zeta * 0.25
print(f"ΔU = {energy.value:.12f}")
print(f"exact {exact:.12f}, relative difference {energy.value / exact - 1:.0e}")

path = energy.path
misfit = np.abs(path.p[:, 1] - 4 * zeta * path.q[:, 1]).max()
largest = np.abs(path.p[:, 1]).max()
print(f"p₂ - 4ζω_n v is at most {misfit / largest:.0e} of the largest p₂")
assert abs(energy.value / exact - 1) < 1e-6

# %%
# The clear-running and the hammering state
# -----------------------------------------
#
# With forcing there is no such formula. ``LeastAction`` has two independent searches for
# exit paths: a graph search over the section, and shooting. It polishes each path to a
# solution of Hamilton's equations. Both searches run by default. Here the graph search
# with 160 × 160 nodes is sufficient. The status lists the findings.

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, cells=(100, 100), rng=0)
result = vk.LeastAction(graph=graph, shooting=None).run(osc, structure)
print(result.status)

# %%
# Each energy has bounds. The upper bound is the action of a path from the attractor to the
# exit. Below the lower bound the graph search found no path, within its estimated error.

clear = result.energy("clear", "hammering")
for e in result.energies:
    print(f"{result.exit_of(e)}: ΔU = {e.value:.6g} m² s⁻³")
    print(f"    bounds {e.lower:.6g} to {e.upper:.6g} ({e.bound})")

# %%
# The exit paths on the section have one point per period. They are spirals that begin at
# the attractor and end on the saddle.

fig, ax = plt.subplots(layout="constrained")
result.plot(ax=ax)

# %%
# The momentum :math:`p_2` is the force that the noise must supply. It grows from period to
# period. Most of the action is spent within ten periods, before the path approaches the
# saddle.

fig, axes = plt.subplots(2, 2, sharex="col", figsize=(8.4, 4.6), layout="constrained")
result.plot_history(ax=axes)

# %%
# The certificate
# ---------------
#
# A certificate states how accurately a path satisfies Hamilton's equations. The residual
# is the largest misfit. Three changes show how much the action depends on the distance of
# the start from the attractor, on the length of the path, and on the integration
# tolerance.

certificate = clear.certificate
print(f"residual {certificate.residual:.0e}")
print(f"length of the path {certificate.periods:.0f} periods")
print(f"distance of its start from the attractor {certificate.start_distance:.0e}")
print(f"distance of its end from the saddle {certificate.end_distance:.0e}")
print(f"change of the action by start    {certificate.by_start:.0e}")
print(f"                     by length   {certificate.by_length:.0e}")
print(f"                     by stepper  {certificate.by_stepper:.0e}")

# %%
# The certificate shows that the path is an extremal and how accurate its action is. It
# does not exclude a cheaper path. The lower bound does, within the estimated error of the
# graph search. The bounds are therefore much wider apart than the numerical error of the
# path.

print(f"numerical error of the path {clear.numerical_error:.0e}")
print(f"distance of the bounds      {clear.upper - clear.lower:.0e}")

# %%
# The path ends on the saddle with zero momentum. From next to it, the motion without noise
# leads to one state or the other.

(saddle,) = structure.saddles
arrival = np.linalg.norm(clear.path.q[-1] - saddle.points[0])
left_over = np.abs(clear.path.p[-1, 1]) / np.abs(clear.path.p[:, 1]).max()
print(f"distance from the saddle at the end {arrival:.0e}")
print(f"momentum at the end over its maximum {left_over:.0e}")

# %%
# How a search can miss the path
# ------------------------------
#
# ``ActionPlot`` starts many extremals near the attractor and records their action at the
# exit. By default the starts cover a domain that each extremal crosses once. The published
# method starts on one small circle at one phase of the period. Most extremals, including
# the one of least action, do not cross this circle, and more points on it do not help.

shots = vk.ActionPlot(source="clear", points=3000).run(osc, structure)
ring = vk.ActionPlot(source="clear", points=20_000, radius=1e-6).run(osc, structure)
for name, found in (("whole domain", shots), ("circle", ring)):
    value = found.energies[0].value
    above = 100 * (value / clear.value - 1)
    print(f"{name:<13} {value:.4e}, {above:.2f} % above the certified path")

# %%
# The action plot shows the action at the exit against the angle of the start. It jumps
# where neighbouring starts leave after different numbers of periods. Its least value
# approaches the activation energy from above.

fig, ax = plt.subplots(layout="constrained")
shots.plot(ax=ax)

# %%
# First contact
# -------------
#
# ``FirstContact`` asks for another exit: the first contact with a stop. Up to then the
# clear-running motion is that of a linear oscillator, and the energy is
#
# .. math::
#
#    \Delta U = 2\zeta\omega_n^3\,(b - \max x_s)^2,
#
# with the position b of the stop and the steady motion :math:`x_s(t)`.

few = vk.Shooting(points=500, rounds=4)
contact = vk.FirstContact("right")
search = vk.LeastAction(shooting=few, graph=None, source="clear", exit=contact)
(touch,) = search.run(osc, structure).energies

damping, omega, f0, f1 = 0.01, 0.57, 0.18, 0.2  # ω_n = 1
amplitude = f0 / abs(1 - omega**2 + 2j * damping * omega)
by_formula = 2 * damping * (0.5 - f1 - amplitude) ** 2
print(f"first contact with the right stop: {touch.value:.8e} m² s⁻³")
print(f"closed form:                       {by_formula:.8e} m² s⁻³")
print(f"share of the energy to leave the basin: {touch.value / clear.value:.2f}")

# %%
# The first contact costs a fraction of the energy of the exit. At weak noise, most
# contacts therefore do not lead to hammering.
#
# The long term
# -------------
#
# The energies of all transitions determine which state is the most stable, which is left
# first, and the exponents of the stationary probabilities. Prefactors are not known here,
# so that no share of time follows from the energies alone.

transitions = vk.Transitions.of(result)
print(transitions)
intensity = osc.noise.intensity
for e in result.energies:
    print(f"D = {intensity:g}: ΔU/D = {e.value / intensity:.1f} for {result.exit_of(e)}")
print(transitions.stationary_weights(intensity))

# %%
# The quasi-potential is the least action from the clear-running state to each point of the
# section. It is a smooth bowl near the state, and has kinks where two paths with different
# histories cost the same.

fig, ax = plt.subplots(layout="constrained")
result.plot_quasi_potential("clear", ax=ax)

# %%
# What you saw
# ------------
#
# * The energy of the double well agrees with :math:`4\zeta\omega_n` times its barrier, and
#   that of the first contact with its closed form.
# * A certified path is an extremal. The lower bound of its energy rests on the graph search
#   and its estimated error.
# * The clear-running state has the smaller energy: it is left first.
#
# :doc:`/how-to/least-action` has the settings. The next tutorial, :doc:`05_densities`,
# computes densities and rates at finite noise.

plt.show()

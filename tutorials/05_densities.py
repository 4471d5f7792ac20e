"""
Densities and exit rates
========================

**Question:** At a given noise intensity, how is the state distributed, and at what rate is
a steady state left?

At finite noise intensity D each attractor has an exit rate and a density of the states
that have not left. ``SGCM`` computes both, also where rates are below e⁻⁵⁰ and no
simulated trajectory leaves. This tutorial computes densities and rates of a double well,
where both are known in closed form, extrapolates them to D → 0, and compares a density of
the scene with two stops with simulated trajectories.

``python tutorials/05_densities.py`` prints the numbers of this page and then shows its
pictures in windows. Without a display it only prints. It takes about half a minute, and
longer the first time, when the equations are compiled.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

# %%
# The logarithm of the density
# ----------------------------
#
# Let E be the energy per unit mass above the bottom of the well. The stationary density of
# an unforced oscillator is Boltzmann's: :math:`\rho \propto e^{-4\zeta\omega_n E/D}`. At the
# saddle of this well :math:`E = 1/4`. With :math:`\zeta = 0.2` and D = 0.004 the density
# there is e⁻⁵⁰ of its maximum. It cannot be sampled: of 10²¹ independent samples about one
# would lie near the saddle. ``SGCM`` stores ln ρ on a grid and carries it along the exact
# flow, so that the error of ln ρ is small at any depth.

zeta, barrier = 0.2, 0.25
well = vk.load_scene("double-well").replace({"damping_ratio": zeta})
wells = vk.find_structure(well, cells=(60, 60), rng=0)
(saddle,) = wells.saddles
search = vk.SGCM(intensities=(0.01, 0.006, 0.004), nodes=(120, 120))
result = search.run(well, wells)
print("findings:", result.status or "none")

# %%
# The density
# -----------
#
# The density of one attractor is quasi-stationary: it describes the states that have not
# left. ``StationaryDensity`` adds the densities of both wells, weighted by the
# probabilities of the wells, which follow from the rates and are equal by symmetry. The
# largest difference of ln ρ from Boltzmann's density, over all states below the barrier,
# is a small fraction of the range of ln ρ.

stationary = vk.StationaryDensity.of(result)
print(stationary)

x, v = np.meshgrid(stationary.x, stationary.v, indexing="ij")
energy = v**2 / 2 - x**2 / 2 + x**4 / 4 + barrier
area = (stationary.x[1] - stationary.x[0]) * (stationary.v[1] - stationary.v[0])
misfits = []
densities = zip(stationary.intensities, stationary.log_density, strict=True)
for intensity, log_density in densities:
    boltzmann = -4 * zeta * energy / intensity
    boltzmann -= math.log(np.exp(boltzmann).sum() * area)
    difference = np.abs(log_density - boltzmann)[energy < barrier]
    misfits.append(float(difference.max()))
    depth = 4 * zeta * barrier / intensity
    print(f"D = {intensity:g}: range of ln ρ {depth:.0f}, difference {misfits[-1]:.2f}")

# %%
# The picture shows :math:`-D \ln\rho`, up to a constant. It has the shape of the energy E.

fig, ax = plt.subplots(layout="constrained")
stationary.plot(ax=ax)

# %%
# The rates
# ---------
#
# Kramers' formula gives the rate out of the well for weak noise and moderate or strong
# damping. Its prefactor contains the curvatures of the potential, 2 at the bottom and −1 at
# the top:
#
# .. math::
#
#    k = \frac{\sqrt 2}{2\pi}\left(\sqrt{\zeta^2 + 1} - \zeta\right) e^{-\zeta/D}.
#
# At these intensities the formula has an error of about 2 %.

prefactor = (math.sqrt(zeta**2 + 1) - zeta) * math.sqrt(2) / (2 * math.pi)
left_rates = [rate for rate in result.rates if rate.source == 0]
kramers = [prefactor * math.exp(-zeta / rate.intensity) for rate in left_rates]
for rate, by_formula in zip(left_rates, kramers, strict=True):
    bounds = f"{rate.lower:.3g} to {rate.upper:.3g}"
    print(f"D = {rate.intensity:g}: rate {rate.value:.4g} /s ({bounds})")
    print(f"    Kramers' formula {by_formula:.4g} /s")
    print(f"    mean exit time {rate.mean_time:.3g} s")

# %%
# The rate of one start
# ---------------------
#
# A rate belongs to an attractor. For a single start, ``committor`` is the probability to
# reach the core of the other well, a small ellipse around its attractor, before the core
# of its own well. ``mean_exit_time`` is the mean time until the exit. From the saddle both
# cores are equally probable by symmetry. The mean exit time from there is half that from
# the attractor.

place = {"x": saddle.points[0][0], "v": saddle.points[0][1]}
at_saddle = result.committor("left-rest").interp(place).values
times = result.mean_exit_time("left-rest").interp(place).values
time_ratios = times * [rate.value for rate in left_rates]
print("from the saddle, at the three intensities")
print("    probability of the right well", at_saddle.round(4), "exact 0.5")
print("    mean time over that of the attractor", time_ratios.round(4), "exact 0.5")

# %%
# The limit of weak noise
# -----------------------
#
# At one intensity, :math:`D\ln\tau` of the mean exit time :math:`\tau` differs from the
# activation energy by the logarithm of the prefactor times D. ``SGCM`` extrapolates from
# several intensities to D → 0, with an error estimate. The exact limit is
# :math:`4\zeta\omega_n` times the barrier.

exact = 4 * zeta * barrier
limit = result.energy("left-rest", "right-rest")
for rate in left_rates:
    print(f"D = {rate.intensity:g}: D ln τ = {-rate.intensity * rate.log_value:.4f}")
print(f"D → 0: ΔU = {limit.value:.4f}, bounds {limit.lower:.4f} to {limit.upper:.4f}")
print(f"exact: ΔU = {exact:.4f}")

# %%
# The logarithm of the mean exit time is nearly a straight line over 1/D. The slope between
# neighbouring intensities tends to the activation energy.

fig, ax = plt.subplots(layout="constrained")
result.plot_rates(source="left-rest", ax=ax)

fig, ax = plt.subplots(layout="constrained")
result.plot_slopes(source="left-rest", limits=[limit], ax=ax)

# %%
# A density in time
# -----------------
#
# ``evolve_density`` carries any density to later times. Here it is uniform on a square at
# first, and the scene is that with two stops at D = 10⁻⁴. ``mass`` is the probability in
# the region; it stays 1 if the region is large enough.

osc = vk.load_scene("hertz-0.570").replace({"noise.intensity": 1e-4})
box = np.array([[-0.4, 0.4], [-0.4, 0.4]])
region = ((-0.75, 0.75), (-0.9, 0.9))
intervals = (1, 4, 10)
history = vk.evolve_density(osc, region, intervals, start=box, nodes=(300, 300))
print("findings:", history.status or "none")
print("probability in the region:", history.mass.round(6))

# %%
# The comparison is with 20 000 simulated trajectories. The empirical distribution function
# of so many samples differs from the exact one by less than 0.013 with a probability of
# 99.8 % (Kolmogorov's limit law).

starts = np.random.default_rng(5).uniform(*box.T, (20_000, 2))
ends = [osc.section_map(starts, interval, rng=7) for interval in intervals]
simulated = [np.sort(states[:, 0]) for states in ends]
steps = np.diff(history.x)
differences = []
for marginal, sample in zip(history.marginal("x").values, simulated, strict=True):
    pieces = 0.5 * (marginal[1:] + marginal[:-1]) * steps
    cumulative = np.concatenate([[0.0], np.cumsum(pieces)])
    counted = np.searchsorted(sample, history.x) / len(sample)
    differences.append(np.abs(cumulative / cumulative[-1] - counted).max())
for interval, difference in zip(intervals, differences, strict=True):
    print(f"t = {interval:2d} T: largest difference {difference:.4f}")

# %%
# The lines are the marginal densities of x, the dots histograms of the trajectories.

fig, ax = plt.subplots(layout="constrained")
artists = history.plot(ax=ax)
for line, sample in zip(artists.lines, simulated, strict=True):
    shares, edges = np.histogram(sample, 100, density=True)
    centres = (edges[1:] + edges[:-1]) / 2
    ax.plot(centres, shares, ".", markersize=4, color=line.get_color())
ax.set_xlim(-0.4, 0.8)

# %%
# What you saw
# ------------
#
# * The density of the double well agrees with Boltzmann's down to e⁻⁵⁰ of its maximum, and
#   its rates with Kramers' formula.
# * Extrapolated to D → 0, the rates give the activation energy without any path.
# * A density in time agrees with simulated trajectories.
#
# :doc:`/how-to/density` has the settings. The next tutorial, :doc:`06_exit_times`,
# simulates the exits.

plt.show()

"""
Mean first exit times
=====================

**Question:** How long does a steady state last at a given noise intensity, and how do the
exits happen?

``MFET`` simulates exits: walkers start around an attractor and move with noise until they
leave. The inverse of the mean of their times is the exit rate. Where no walker would leave
in a reasonable time, adaptive multilevel splitting gives the rate. This tutorial simulates
the exits from a double well, tests the exponential law, fits the Arrhenius law, and
compares the rates with Kramers' formula. Then it computes a rate at weaker noise by
splitting, and the exit times of the clear-running state of the earlier tutorials.

``python tutorials/06_exit_times.py`` prints the numbers of this page and then shows its
pictures in windows. Without a display it only prints. It takes about half a minute, and
longer the first time, when the equations are compiled.
"""

import math

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad

import vibrokit as vk

# %%
# Simulation
# ----------
#
# The well is that of the previous tutorial, with the activation energy
# :math:`4\zeta\omega_n \times 1/4 = 0.2`. Walkers start in the core of the left well, an
# ellipse of one standard deviation around its equilibrium. They have left when they reach
# the core of the right well. This event is called *commitment*. Crossing the basin boundary
# is not sufficient: half of the walkers there turn back.
#
# A relative standard error of :math:`1/\sqrt n` needs n exits, 400 for the default of 5 %.
# ``splitting=False`` requires direct simulation at each intensity. ``escapes=20`` keeps
# the last part of 20 realizations for a picture.

zeta, barrier = 0.2, 0.25
exact = 4 * zeta * barrier
well = vk.load_scene("double-well").replace({"damping_ratio": zeta})
wells = vk.find_structure(well, cells=(60, 60), manifolds=False, rng=0)
search = vk.MFET(
    source="left-rest",
    intensities=(0.04, 0.03, 0.025),
    splitting=False,
    escapes=20,
)
direct = search.run(well, wells)
for rate in direct.rates:
    time, error = rate.mean_time, 100 * rate.log_error
    print(f"D = {rate.intensity:g}: mean exit time {time:.4g} s ± {error:.0f} %")

# %%
# The exponential law
# -------------------
#
# A rate describes the exits if a walker that has not left has no memory of its start. Exit
# times then follow an exponential law, and the share 1/e of the walkers has not left after
# the mean time. ``data`` has the probability that exponential times deviate from the law at
# least as much as the simulated ones (Epstein and Sobel's test). A finding reports a value
# below 0.001.

p_values = direct.data["exponential_p_value"].sel(source=0).values
times = direct.exit_times("left-rest", 0.03)
left_over = int(direct.data["walkers_left_over"].sel(source=0)[1])
mean = next(rate.mean_time for rate in direct.rates if rate.intensity == 0.03)
walkers = times.size + left_over
remaining = 1 - (times.values < mean).sum() / walkers
error = math.sqrt(remaining * (1 - remaining) / walkers)
print("probability of a larger deviation:", p_values.round(3))
print(f"share that has not left after the mean time: {remaining:.3f} ± {error:.3f}")
print(f"1/e:                                         {math.exp(-1):.3f}")

# %%
# On a logarithmic scale an exponential law is a straight line.

fig, ax = plt.subplots(layout="constrained")
direct.plot_exit_times(source="left-rest", intensity=0.03, ax=ax)

# %%
# The realizations below are aligned at their ends. They climb the barrier and oscillate in
# the right well until they reach its core.

fig, ax = plt.subplots(layout="constrained")
direct.plot_escapes(source="left-rest", ax=ax)

# %%
# The Arrhenius law and Kramers' formula
# --------------------------------------
#
# Let :math:`\tau` be the mean exit time. The slope of :math:`\ln\tau` against 1/D tends to
# the activation energy as D → 0. ``arrhenius`` fits a straight line. The slopes between
# neighbouring intensities show whether the line is straight. If they change by more than
# their errors, a finding reports it and no energy is given.

fit = direct.arrhenius("left-rest")
slopes, slope_errors = fit.local_slopes
energy = direct.energy("left-rest", "right-rest")
print(f"slope {fit.slope:.3f} ± {fit.slope_error:.3f}")
print("local slopes", slopes.round(3), "±", slope_errors.round(3))
print(f"ΔU = {energy.value:.3f}, bounds {energy.lower:.3f} to {energy.upper:.3f}")
print(f"exact {exact:.3f}")

# %%
# Kramers' formula has the prefactor as well, for weak noise and moderate or strong damping.
# The correction of first order in D depends on the damping. In the overdamped limit the
# rate is a ratio of integrals, and the correction follows from it. At ζ = 0.2 this
# correction is too large, by a factor of up to 2 at the intensities of this page. The whole
# correction is taken as the error.


def kramers(intensity):
    """Return ln of the rate by Kramers' formula, corrected, and the error."""
    temperature = intensity / (4 * zeta)

    def in_the_well(x):
        return math.exp(-((x**2 - 1) ** 2) / 4 / temperature)

    def on_the_barrier(x):
        return math.exp((x**4 / 4 - x**2 / 2) / temperature)

    bottom, top = quad(in_the_well, -3, 0)[0], quad(on_the_barrier, -1, 1)[0]
    correction = math.log(2 * math.pi * temperature / math.sqrt(2) / (bottom * top))
    prefactor = (math.sqrt(zeta**2 + 1) - zeta) * math.sqrt(2) / (2 * math.pi)
    log_rate = math.log(prefactor) - exact / intensity + correction
    return log_rate, abs(correction)


for rate in direct.rates:
    formula, formula_error = kramers(rate.intensity)
    simulated = f"{rate.log_value:.3f} ± {rate.log_error:.3f}"
    print(f"D = {rate.intensity:g}: ln rate, simulated {simulated}")
    print(f"{'':<20} Kramers   {formula:.3f} ± {formula_error:.3f}")
    assert abs(rate.log_value - formula) < 3 * rate.log_error + formula_error

# %%
# Splitting
# ---------
#
# At D = 0.01 the mean exit time is about e²² s. Splitting follows excursions from the core.
# It replaces those with the least progress by copies of others, restarted where these had
# made more progress, and repeats this until all have left. The share that is kept at each
# level is known, and the product of these shares is the probability to leave. The estimate
# is unbiased; independent repetitions give its error.

search = vk.MFET(source="left-rest", intensities=(0.01,), target_error=0.15)
split = search.run(well, wells)
(rare,) = split.rates
formula, formula_error = kramers(rare.intensity)
print(f"ln rate by {rare.method} {rare.log_value:.2f} ± {rare.log_error:.2f}")
print(f"        by Kramers   {formula:.2f} ± {formula_error:.2f}")

time_step = well.section_interval / 256  # of RK4, the default
waiting = rare.mean_time / time_step / rare.log_error**2
print(f"time steps by splitting         {split.stats.steps:.1e}")
print(f"           by direct simulation {waiting:.1e}, for the same error")

# %%
# All rates stand on one line:

fig, ax = plt.subplots(layout="constrained")
artists = direct.plot_rates(ax=ax)
inverse = np.linspace(22, 110, 50)
logs = [-kramers(1 / one)[0] for one in inverse]
(line,) = ax.plot(inverse, logs, "k--", label="Kramers' formula")
place, log_time = 1 / rare.intensity, -rare.log_value
point = ax.errorbar(place, log_time, rare.log_error, fmt="sC1", label="splitting")
ax.legend(handles=[*artists.points, point, line])

# %%
# The clear-running state
# -----------------------
#
# The clear-running state of ``hertz-0.570`` has :math:`\Delta U = 7.905\cdot10^{-5}` m² s⁻³
# (:doc:`04_least_action`). At D = 5·10⁻⁵ the ratio ΔU/D is 1.6, and the state is left
# after a few relaxation times. A finding states that it is not metastable at this
# intensity. The mean time is well defined, but exit times follow no exponential law. At
# D = 2·10⁻⁵ the mean time is about nine times as long.

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, cells=(100, 100), manifolds=False, rng=0)
search = vk.MFET(source="clear", intensities=(5e-5, 2e-5), escapes=300)
forced = search.run(osc, structure)
print(forced.status)
log_periods = [-rate.log_value - math.log(osc.period) for rate in forced.rates]
for rate, log_time in zip(forced.rates, log_periods, strict=True):
    print(f"D = {rate.intensity:g}: ln(τ/T) = {log_time:.3f} ± {rate.log_error:.3f}")

# %%
# The error of the time steps is tested as well: steps of twice the length should not change
# the rate by more than three standard errors.

changes = forced.data["step_change"].sel(source=0).values
change_errors = forced.data["step_change_error"].sel(source=0).values
for change, error in zip(changes, change_errors, strict=True):
    print(f"half as many steps change ln of the rate by {change:.2f} ± {error:.2f}")

# %%
# On the section, with one point per period, realizations leave the narrow basin near the
# saddle, follow the unstable manifold of the saddle, and then spiral into the hammering
# state. The red line is one of them.

fig, ax = plt.subplots(layout="constrained")
structure.plot(ax=ax)
escapes = forced.escapes("clear")
per_period = round(osc.period / np.diff(escapes.time).mean())
states = escapes[:, ::-1][:, : 40 * per_period : per_period].values
ax.plot(*states.reshape(-1, 2).T, ".", color="black", markersize=1, zorder=3)
ax.plot(*states[0].T, ".-", color="crimson", linewidth=1, zorder=4)
ax.set(xlim=(-0.35, 0.65), ylim=(-0.5, 0.3))

# %%
# What you saw
# ------------
#
# * The mean of simulated exit times gives the rate with a confidence interval. It agrees
#   with Kramers' formula.
# * The slope of ln τ against 1/D is the activation energy, if the exits are rare.
# * Splitting gives rates that direct simulation cannot reach.
#
# :doc:`/how-to/exit-times` has the settings. The next tutorial, :doc:`07_a_machine`, uses
# all of this for a machine in SI units.

plt.show()

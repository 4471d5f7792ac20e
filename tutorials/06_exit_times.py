"""Mean first exit times

Noise drives a mass out of any steady state, after a random time. `MFET` simulates this: walkers start around an
attractor, move with noise until they leave, and the mean of their times is the inverse of the exit rate. Where no
walker would leave in a reasonable time, adaptive multilevel splitting gives the rate. This tutorial simulates the exits
from a double well, tests whether the times follow an exponential law, fits the Arrhenius law and compares the rates
with Kramers' formula. Then it computes a rate at weaker noise by splitting, and the exit times of the clear-running
state of the earlier tutorials.

Run it with ``python tutorials/06_exit_times.py``. It prints its results and saves four pictures. It takes about half a
minute, and longer the first time, when the equations are compiled.
"""

import math
from pathlib import Path

import numpy as np
from scipy.integrate import quad

import vibrokit as vk

# ---------------------------------------------------------------------------------------------------------------------
# 1. Simulation
#
# The well is the one of the previous tutorial: damping ratio 0.2, activation energy 4ζω_n × 1/4 = 0.2. Walkers start in
# the core of the left well, an ellipse of one standard deviation around its rest. They have left when they are in the
# core of the right well. This event is called commitment: crossing the top of the barrier is not enough, since a mass
# there turns back in half of the cases.
#
# A relative standard error of 1/√n needs n exits, 400 for the default 5 %. An error of half the size takes four times
# as long. `splitting=False` requires direct simulation at all three intensities. `escapes=20` keeps the last part of 20
# realizations for a picture.

zeta, barrier = 0.2, 0.25
exact = 4 * zeta * barrier
well = vk.load_scene("double-well").replace({"damping_ratio": zeta})
two_wells = vk.find_structure(well, cells=(60, 60), manifolds=False, rng=0)
intensities = (0.04, 0.03, 0.025)
direct = vk.MFET(source="left-rest", intensities=intensities, splitting=False, escapes=20).run(well, two_wells)
for rate in direct.rates:
    print(f"D = {rate.intensity:g}: mean time {rate.mean_time:.4g} s, ± {rate.log_error:.0%}, {rate.method}")

# ---------------------------------------------------------------------------------------------------------------------
# 2. The exponential law
#
# A rate describes the exits if their times follow an exponential law: a walker that has not left has no memory of when
# it started. `data` has the probability that exponential times deviate more than these (Epstein & Sobel 1953). A value
# below 0.001 is reported as a finding. Of an exponential law the standard deviation equals the mean, and a share 1/e
# has not left after the mean time.

p_values = direct.data["exponential_p_value"].sel(source=0).values
times = direct.exit_times("left-rest", 0.03)
left_over = int(direct.data["walkers_left_over"].sel(source=0)[1])
mean = next(rate.mean_time for rate in direct.rates if rate.intensity == 0.03)
remaining = 1 - (times.values < mean).sum() / (times.size + left_over)
print("probability of a larger deviation from the exponential law:", p_values.round(3))
print(f"D = 0.03: {remaining:.3f} of the walkers have not left after the mean time; 1/e is {math.exp(-1):.3f}")

# ---------------------------------------------------------------------------------------------------------------------
# 3. The Arrhenius law and Kramers' formula
#
# The slope of ln τ against 1/D tends to the activation energy as D → 0. `arrhenius` fits a straight line. The slopes
# between neighbouring intensities show whether the line is straight; if they change by more than their errors, a
# finding reports it and no energy is given. The bounds of the energy allow for a prefactor proportional to D, as at
# weak damping.

fit = direct.arrhenius("left-rest")
slopes, slope_errors = fit.local_slopes
energy = direct.energy("left-rest", "right-rest")
print(f"slope {fit.slope:.4f} ± {fit.slope_error:.4f}, local slopes {slopes.round(4)} ± {slope_errors.round(4)}")
print(f"activation energy {energy.value:.4f}, between {energy.lower:.4f} and {energy.upper:.4f}; exact {exact:.4f}")

# Kramers' formula has a prefactor as well, for moderate and strong damping. It is the limit of weak noise. The next
# term of the expansion in D follows from the overdamped limit, where the rate is a ratio of integrals. The term after
# that is of the order of its square, which is the error estimate.


def kramers(intensity):
    """Return ln of the rate by Kramers' formula with its next term, and the error of that."""
    temperature = intensity / (4 * zeta)
    prefactor = (math.sqrt(zeta**2 + 1) - zeta) * math.sqrt(2) / (2 * math.pi)
    bottom = quad(lambda x: math.exp(-((x**2 - 1) ** 2) / 4 / temperature), -3, 0)[0]
    top = quad(lambda x: math.exp((x**4 / 4 - x**2 / 2) / temperature), -1, 1)[0]
    next_term = math.log(2 * math.pi * temperature / math.sqrt(2) / (bottom * top))
    return math.log(prefactor) - exact / intensity + next_term, next_term**2


for rate in direct.rates:
    by_formula, formula_error = kramers(rate.intensity)
    print(
        f"D = {rate.intensity:g}: ln rate {rate.log_value:.3f} ± {rate.log_error:.3f}, "
        f"by the formula {by_formula:.3f} ± {formula_error:.3f}"
    )
    assert abs(rate.log_value - by_formula) < 3 * rate.log_error + formula_error

# ---------------------------------------------------------------------------------------------------------------------
# 4. Splitting
#
# At D = 0.01 the mean time is e²² s. Splitting does not wait for it. It follows excursions from the core, replaces
# those with the least progress by copies of others, restarted where these had made more progress, and repeats this
# until all leave. The fraction that is kept at each level is known, and the product of these fractions is the
# probability to leave. The estimate is unbiased; independent replicas give its error.

split = vk.MFET(source="left-rest", intensities=(0.01,), target_error=0.15).run(well, two_wells)
(rare,) = split.rates
by_formula, formula_error = kramers(rare.intensity)
time_step = well.section_interval / 256  # of RK4, the default
waiting = rare.mean_time / time_step / rare.log_error**2
print(f"D = 0.01: ln rate {rare.log_value:.2f} ± {rare.log_error:.2f}, by the formula {by_formula:.2f}; {rare.method}")
print(f"time steps: {split.stats.steps:.2g} by splitting, {waiting:.2g} by direct simulation with the same error")

# ---------------------------------------------------------------------------------------------------------------------
# 5. The clear-running state
#
# `hertz-0.570` has a clear-running and a hammering state, and ΔU = 7.905e-5 for the exit from the first (tutorial 4).
# At D = 5e-5 the noise is not weak: ΔU/D is 1.6 and the state is left after a few relaxation times. The findings say
# so, and that exit times follow no exponential law: no walker is in the core of the hammering state within the first
# periods. The mean time is well defined all the same. At D = 2e-5 it is nine times as long, and the delay is a small
# part of it.

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, cells=(100, 100), manifolds=False, rng=0)
forced = vk.MFET(source="clear", intensities=(5e-5, 2e-5), escapes=300).run(osc, structure)
print(forced.status)
log_periods = [-rate.log_value - math.log(osc.period) for rate in forced.rates]
for rate, log_time in zip(forced.rates, log_periods, strict=True):
    print(f"D = {rate.intensity:g}: ln of the mean time in periods {log_time:.3f} ± {rate.log_error:.3f}")

# Steps twice as long must not change the rate by more than three standard errors (`step_change_error`).

for change, error in np.stack([forced.data[f"step_change{end}"].sel(source=0) for end in ("", "_error")], axis=-1):
    print(f"half the steps change ln of the rate by {change:.2f} ± {error:.2f}")

# ---------------------------------------------------------------------------------------------------------------------
# 6. Pictures
#
# The share of walkers that have not left is nearly a straight line on a logarithmic scale. `plot_rates` draws ln τ
# against 1/D. `escapes` has realizations on their way out, aligned at the exit. In the well they climb the barrier and
# oscillate in the other well until they are in its core. For the forced scene the section is clearer than the phase
# plane: the last picture shows one state per period over the basins, and one realization as a line. It leaves the
# narrow basin near the saddle, follows the unstable manifold of the saddle, and then spirals into the hammering state.


def draw_rates():
    """Draw the mean times of the well, with Kramers' formula and the result of splitting."""
    artists = direct.plot_rates()
    inverse = np.linspace(22, 110, 50)
    (line,) = artists.ax.plot(inverse, [-kramers(1 / one)[0] for one in inverse], "k--", label="Kramers' formula")
    point = artists.ax.errorbar(
        1 / rare.intensity, -rare.log_value, rare.log_error, fmt="s", color="C1", label="by splitting"
    )
    artists.ax.legend(handles=[*artists.points, point, line], frameon=False)
    return artists


def draw_section():
    """Draw the realizations of the forced scene on the section, over the basins."""
    artists = structure.plot()
    per_period = round(osc.period / np.diff(forced.escapes("clear").time).mean())
    states = forced.escapes("clear")[:, ::-1][:, : 40 * per_period : per_period].values
    artists.ax.plot(*states.reshape(-1, 2).T, ".", color="black", markersize=1, zorder=3)
    artists.ax.plot(*states[0].T, ".-", color="crimson", markersize=5, linewidth=1, zorder=4)
    artists.ax.set(xlim=(-0.35, 0.65), ylim=(-0.5, 0.3))
    return artists


PICTURES = {
    "06-survival.png": lambda: direct.plot_exit_times(source="left-rest", intensity=0.03),
    "06-exit-times.png": draw_rates,
    "06-escapes.png": lambda: direct.plot_escapes(source="left-rest"),
    "06-section.png": draw_section,
}


def save_pictures(folder):
    """Save the pictures in a folder and print where they are."""
    folder.mkdir(exist_ok=True)
    for name, draw in PICTURES.items():
        draw().figure.savefig(folder / name, dpi=150)
        print("picture:", folder / name)


if __name__ == "__main__":
    save_pictures(Path.cwd() / "tutorial-pictures")

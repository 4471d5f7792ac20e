"""Densities and exit rates

At a finite noise intensity D a state is left at some rate, and until then its density has a shape. `SGCM` computes
both. Rates of interest are often below e⁻⁵⁰, which no simulated trajectory shows. This tutorial computes densities
and rates of a double well, where both are known in closed form, follows them to the limit D → 0, and then compares the
density of the impacting scene of the earlier tutorials with simulated trajectories.

Run it with ``python tutorials/05_densities.py``. It prints its results and saves four pictures. It takes about half a
minute, and longer the first time, when the equations are compiled.
"""

import math
from pathlib import Path

import numpy as np

import vibrokit as vk

# ---------------------------------------------------------------------------------------------------------------------
# 1. Why the logarithm of the density is stored
#
# The stationary density of an unforced oscillator is that of Boltzmann: p is proportional to exp(−4ζω_n E/D), where E
# is the energy above the bottom of the well. The barrier of this well is 1/4, so that ln p at the saddle is ζ/D below
# its maximum. With ζ = 0.2 and D = 0.004 this is 50.
#
# A density of e⁻⁵⁰ cannot be sampled: of 10²¹ independent samples, about one would be near the saddle. A transition
# matrix of sampled trajectories has a zero there. `SGCM` stores ln p at the nodes of a grid and carries it along the
# exact flow, so that the error of ln p is small at any depth. At several intensities:

zeta, barrier = 0.2, 0.25
well = vk.load_scene("double-well").replace({"damping_ratio": zeta})
two_wells = vk.find_structure(well, cells=(60, 60), rng=0)
(saddle,) = two_wells.saddles
result = vk.SGCM(intensities=(0.01, 0.006, 0.004), nodes=(120, 120)).run(well, two_wells)
print(result.status)

# ---------------------------------------------------------------------------------------------------------------------
# 2. The density
#
# The density of each attractor is quasi-stationary: that of the states which have not left. `StationaryDensity` adds
# them, each with the probability of its attractor, which follows from the rates. Both wells are equal, and so are the
# probabilities. Below the barrier, ln p agrees with the formula to a small fraction of its range of 50.

stationary = vk.StationaryDensity.of(result)
print(stationary)

x, v = np.meshgrid(stationary.x, stationary.v, indexing="ij")
energy = v**2 / 2 - x**2 / 2 + x**4 / 4 + barrier
area = (stationary.x[1] - stationary.x[0]) * (stationary.v[1] - stationary.v[0])
below = energy < barrier
misfits = []
for intensity, log_density in zip(stationary.intensities, stationary.log_density, strict=True):
    boltzmann = -4 * zeta * energy / intensity
    boltzmann -= math.log(np.exp(boltzmann).sum() * area)
    misfits.append(np.abs(log_density - boltzmann)[below].max())
    depth = 4 * zeta * barrier / intensity
    print(f"D = {intensity:g}: ln p is within {misfits[-1]:.2f} of the formula, down to {depth:.0f} below its maximum")

# ---------------------------------------------------------------------------------------------------------------------
# 3. The rates
#
# Kramers' formula gives the rate out of a well in the limit of weak noise, at moderate and strong damping. Its
# prefactor depends on the damping and on the curvatures of the well, 2, and of the barrier, 1. At these intensities the
# formula is correct within 2 %. `ExitRate` has the rate with its error estimate, and the mean exit time.

prefactor = (math.sqrt(zeta**2 + 1) - zeta) * math.sqrt(2) / (2 * math.pi)
left_rates = [rate for rate in result.rates if rate.source == 0]
kramers = [prefactor * math.exp(-4 * zeta * barrier / rate.intensity) for rate in left_rates]
for rate, by_formula in zip(left_rates, kramers, strict=True):
    print(
        f"D = {rate.intensity:g}: {rate.value:.4g} per second, from {rate.lower:.3g} to {rate.upper:.3g}; "
        f"Kramers {by_formula:.4g}; mean time {rate.mean_time:.3g} s"
    )

# ---------------------------------------------------------------------------------------------------------------------
# 4. The committor and the mean exit time
#
# A rate belongs to the attractor as a whole. For one start, `committor` is the probability to reach the core (a central
# ellipse) of the other well before that of its own, and `mean_exit_time` the mean time until the exit. From the saddle
# of this well both cores are equally likely by symmetry, so that the mean time is half that of the attractor.

place = {"x": saddle.points[0][0], "v": saddle.points[0][1]}
at_saddle = result.committor("left-rest").interp(place).values
times = result.mean_exit_time("left-rest").interp(place).values
time_ratios = times * [rate.value for rate in left_rates]
print("probability to reach the right well first, from the saddle:", at_saddle.round(4))
print("mean exit time from the saddle, over that of the attractor:", time_ratios.round(4))

# ---------------------------------------------------------------------------------------------------------------------
# 5. The limit of weak noise
#
# At one intensity, D ln τ differs from the activation energy by the prefactor, which is of the order of D. −D ln p at
# the saddle differs by D ln 2 here, since half of the stationary density there belongs to the other well. From several
# intensities `SGCM` extrapolates the limit D → 0 with an error estimate. The exact value is 4ζω_n times the barrier.

exact = 4 * zeta * barrier
limit = result.energy("left-rest", "right-rest")
for rate, height in zip(left_rates, result.barrier("left-rest").values, strict=True):
    print(f"D = {rate.intensity:g}: D ln τ = {-rate.intensity * rate.log_value:.4f}, −D ln p = {height:.4f}")
print(f"limit D → 0: {limit.value:.4f}, between {limit.lower:.4f} and {limit.upper:.4f}; exact {exact:.4f}")

# ---------------------------------------------------------------------------------------------------------------------
# 6. A density in time
#
# `evolve_density` carries any density to later times. Here it starts as a uniform density, as in the paper, on the
# scene with two stops. Noise of D = 10⁻⁴ is five times that of the scene; weaker noise has narrower densities, which
# need more nodes and time. A finding reports what truncation on so few nodes would have changed in the probability. The
# comparison is with 20 000 simulated trajectories: their distribution function differs from the exact one by less than
# 0.013 with probability 99.8 %.

osc = vk.load_scene("hertz-0.570").replace({"noise.intensity": 1e-4})
box = np.array([[-0.4, 0.4], [-0.4, 0.4]])
intervals = (1, 4, 10)
history = vk.evolve_density(osc, ((-0.75, 0.75), (-0.9, 0.9)), intervals, start=box, nodes=(200, 200))
print(history.status)

starts = np.random.default_rng(5).uniform(*box.T, (20_000, 2))
simulated = [np.sort(osc.section_map(starts, interval, rng=7)[:, 0]) for interval in intervals]
marginals = history.marginal("x").values
differences = []
for marginal, sample in zip(marginals, simulated, strict=True):
    steps = np.diff(history.x)
    cumulative = np.concatenate([[0.0], np.cumsum(0.5 * (marginal[1:] + marginal[:-1]) * steps)])
    counted = np.searchsorted(sample, history.x) / len(sample)
    differences.append(np.abs(cumulative / cumulative[-1] - counted).max())
for time, difference in zip(history.times, differences, strict=True):
    print(f"t = {time:5.1f} s: distribution functions of x differ by up to {difference:.4f}")

# ---------------------------------------------------------------------------------------------------------------------
# 7. Pictures
#
# The stationary quasi-potential −D ln p has the shape of the energy. The logarithm of the mean exit time is nearly a
# straight line over 1/D; its local slope tends to the activation energy. The dots on the marginal densities of x are
# histograms of the simulated trajectories.


def draw_transients():
    """Draw the marginal densities of x and histograms of the simulated trajectories."""
    artists = history.plot()
    for line, sample in zip(artists.lines, simulated, strict=True):
        shares, edges = np.histogram(sample, 100, density=True)
        artists.ax.plot((edges[1:] + edges[:-1]) / 2, shares, ".", markersize=4, color=line.get_color())
    artists.ax.set_xlim(-0.4, 0.8)
    return artists


PICTURES = {
    "05-quasi-potential.png": stationary.plot,
    "05-exit-times.png": lambda: result.plot_rates(source="left-rest"),
    "05-slopes.png": lambda: result.plot_slopes(source="left-rest", limits=[limit]),
    "05-transients.png": draw_transients,
}


def save_pictures(folder):
    """Save the pictures in a folder and print where they are."""
    folder.mkdir(exist_ok=True)
    for name, draw in PICTURES.items():
        draw().figure.savefig(folder / name, dpi=150)
        print("picture:", folder / name)


if __name__ == "__main__":
    save_pictures(Path.cwd() / "tutorial-pictures")

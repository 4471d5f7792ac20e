"""A machine in SI units

A steel ball on a leaf spring moves between two steel plates. The machine is shaken at 50 Hz, and random vibration acts
on it as well. At the same shaking the ball can run clear of the plates or hammer both of them. How much random
vibration is allowed, if the ball is to run clear for a year?

Nothing has to be made dimensionless: all values are in metres, seconds and kilograms. The contact is stiff,
10¹¹ m^(−1/2) s⁻², and lasts a hundredth of a period. The defaults for the region, the tolerances and the steps follow
from the scene.

Run it with ``python tutorials/07_a_machine.py``. It prints its results and saves two pictures. It takes about a minute,
and longer the first time, when the equations are compiled.
"""

import math
from pathlib import Path

import numpy as np

import vibrokit as vk

# ---------------------------------------------------------------------------------------------------------------------
# 1. From drawings to parameters
#
# Hertz's theory gives the force between a ball and a plate, F = (4/3) E* √R δ^(3/2), from the modulus E, Poisson's
# ratio ν and the radius R; both bodies are of steel, so that 1/E* = 2 (1 − ν²)/E. A scene has forces per unit mass.

modulus, poisson, density = 210e9, 0.3, 7850.0  # Pa, 1, kg m⁻³
radius, gap = 10e-3, 0.1e-3  # m
mass = density * 4 / 3 * math.pi * radius**3  # kg
stiffness = 4 / 3 * modulus / (2 * (1 - poisson**2)) * math.sqrt(radius) / mass  # m^(−1/2) s⁻²
print(f"ball: {1e3 * mass:.1f} g, contact stiffness {stiffness:.3g} m^(-1/2) s^-2")

natural, damping = 2 * math.pi * 40.0, 0.05  # rad s⁻¹, 1
shaking, frequency = 3.0, 2 * math.pi * 50.0  # m s⁻², rad s⁻¹
osc = vk.Oscillator(
    natural_frequency=natural,
    damping_ratio=damping,
    barriers=(
        vk.Barrier(vk.Hertz(stiffness), position=gap, side="right"),
        vk.Barrier(vk.Hertz(stiffness), position=-gap, side="left"),
    ),
    excitations=(vk.Harmonic(amplitude=shaking, frequency=frequency),),
    noise=vk.WhiteNoise(intensity=2e-5),
)

# ---------------------------------------------------------------------------------------------------------------------
# 2. Two steady states
#
# Without touching the plates the ball is a linear oscillator. Its amplitude is 82 % of the gap, so that one state runs
# clear. In the other state the ball strikes both plates in each period: above resonance, stops on both sides sustain
# it. `peak_force` is per unit mass too.

structure = vk.find_structure(osc, rng=0)
clear, hammering = structure.attractors
amplitude = shaking / math.hypot(natural**2 - frequency**2, 2 * damping * natural * frequency)
print(structure)
print(f"clear: amplitude {1e6 * np.ptp(clear.orbit[:, 0]) / 2:.2f} µm, by the linear formula {1e6 * amplitude:.2f} µm")
print(f"hammering: {mass * hammering.peak_force['right']:.1f} N and {mass * hammering.peak_force['left']:.1f} N")

# Beside the contact force all other forces are negligible. A ball that arrives at a speed v then enters to a depth δ
# with (2/5) k δ^(5/2) = v²/2, and the contact lasts 2.943 δ/v (Goldsmith, "Impact", 1960).

depth = hammering.peak_depth["right"]
speed = math.sqrt(0.8 * stiffness * depth**2.5)
duration = 2.943 * depth / speed
print(f"each impact: {speed:.3f} m/s, {1e6 * depth:.2f} µm deep, {1e6 * duration:.0f} µs of {1e3 * osc.period:.0f} ms")

# ---------------------------------------------------------------------------------------------------------------------
# 3. The activation energy
#
# The intensity D of white noise is half the one-sided power spectral density of the random acceleration. For weak noise
# the mean time until the ball hammers is C exp(ΔU/D). Here C is taken as the forcing period T; section 5 measures it.
# ΔU does not depend on D.

least = vk.LeastAction(source="clear").run(osc, structure)
energy = least.energy("clear", "hammering")
print(least)

year = 365.25 * 86400.0
allowed = energy.value / math.log(year / osc.period)
g = 9.81
print(f"one exit a year: D = {allowed:.3g} m² s⁻³, a spectral density of {2 * allowed / g**2:.2g} g²/Hz")

# ---------------------------------------------------------------------------------------------------------------------
# 4. Which dimension matters
#
# `sensitivity` has the derivative of ΔU in every parameter, from the path that is already known. Multiplied by the
# parameter and divided by ΔU, it is the percentage by which one percent of the parameter changes the energy. The two
# plates count together.

slopes = energy.sensitivity
relative = {
    "gap": gap * (slopes["barriers.0.position"] - slopes["barriers.1.position"]) / energy.value,
    "shaking": shaking * slopes["excitations.0.amplitude"] / energy.value,
    "frequency": frequency * slopes["excitations.0.frequency"] / energy.value,
    "natural frequency": natural * slopes["natural_frequency"] / energy.value,
    "damping": damping * slopes["damping_ratio"] / energy.value,
    "contact stiffness": stiffness
    * (slopes["barriers.0.law.stiffness"] + slopes["barriers.1.law.stiffness"])
    / energy.value,
}
for name, value in relative.items():
    print(f"1 % more {name:<18} {value:+.2f} % of energy")

# The two frequencies matter most: what counts is the distance from resonance. The stiffness hardly matters: with
# plates of brass the energy would be nearly the same.
#
# ΔU is measured in m² s⁻³. This gives two checks. Longer lengths: one percent more gap and shaking, and half a percent
# less stiffness, must give 2 % more energy. Faster rates: one percent more of both frequencies, and two percent more
# shaking and stiffness, must give 3 % more.

by_length = relative["gap"] + relative["shaking"] - relative["contact stiffness"] / 2
by_time = relative["natural frequency"] + relative["frequency"]
by_time += 2 * relative["shaking"] + 2 * relative["contact stiffness"]
print(f"powers of length and of rate: {by_length:.6f} and {by_time:.6f}")

# ---------------------------------------------------------------------------------------------------------------------
# 5. A check by simulation
#
# A year cannot be simulated, but stronger noise can. At D = ΔU/4 the mean time to hammering is a few seconds.

strong = energy.value / 4
simulated = vk.MFET(source="clear", intensities=(strong,), target_error=0.1, splitting=False).run(osc, structure)
(rate,) = simulated.rates
prefactor = rate.mean_time * math.exp(-energy.value / strong)
print(f"D = ΔU/4: mean time {rate.mean_time:.2f} s ± {rate.log_error:.0%}; τ exp(-ΔU/D) is {1e3 * prefactor:.0f} ms")
print(f"with that factor, one exit a year: D = {energy.value / math.log(year / prefactor):.3g} m² s⁻³")

# ---------------------------------------------------------------------------------------------------------------------
# 6. Pictures
#
# The first picture has the basins on the section, with the saddle and its manifolds. Their corners are where motions
# begin to graze a plate. The second one has the force of the noise on the path of least action: it builds up over some
# ten periods, in step with the ball, and ends with the first impacts.

PICTURES = {"07-basins.png": structure.plot, "07-history.png": least.plot_history}


def save_pictures(folder):
    """Save the pictures in a folder and print where they are."""
    folder.mkdir(exist_ok=True)
    for name, draw in PICTURES.items():
        draw().figure.savefig(folder / name, dpi=150)
        print("picture:", folder / name)


if __name__ == "__main__":
    save_pictures(Path.cwd() / "tutorial-pictures")

"""
A machine in SI units
=====================

**Question:** How much random vibration may a machine have, if it is to run clear of its
stops for a year?

A steel ball on a leaf spring moves between two steel plates. It is shaken at 50 Hz, and
random vibration acts on it as well. At the same shaking the ball can run clear of the
plates or hammer both of them. All values are in metres, seconds and kilograms. The contact
is stiff and lasts a hundredth of a period; the region, the tolerances and the steps follow
from the scene.

``python tutorials/07_a_machine.py`` prints the numbers of this page and then shows its
pictures in windows. Without a display it only prints. It takes about a minute, and longer
the first time, when the equations are compiled.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

# %%
# From a drawing to parameters
# ----------------------------
#
# Hertz's theory gives the force between a ball of radius R and a plate,
#
# .. math::
#
#    F = \tfrac43 E^* \sqrt R\,\delta^{3/2}, \qquad
#    \frac{1}{E^*} = \frac{1-\nu_1^2}{E_1} + \frac{1-\nu_2^2}{E_2},
#
# with Young's moduli E and Poisson's ratios ν of both bodies. Here both are of steel. A
# scene has forces per unit mass, so that the stiffness is divided by the mass of the ball.

modulus, poisson, density = 210e9, 0.3, 7850.0  # Pa, 1, kg/m³
radius, gap = 10e-3, 0.1e-3  # m
mass = density * 4 / 3 * math.pi * radius**3  # kg
effective = modulus / (2 * (1 - poisson**2))  # Pa
stiffness = 4 / 3 * effective * math.sqrt(radius) / mass  # m^(-1/2) s⁻²
print(f"ball: {1e3 * mass:.1f} g, contact stiffness {stiffness:.3g} m^(-1/2) s⁻²")

# %%
natural, damping = 2 * math.pi * 40.0, 0.05  # rad/s, 1
shaking, frequency = 3.0, 2 * math.pi * 50.0  # m/s², rad/s
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

# %%
# Two steady states
# -----------------
#
# Without contact the ball is a linear oscillator. Its amplitude is 82 % of the gap, so that
# one state runs clear. In the other state the ball strikes both plates in each period.

structure = vk.find_structure(osc, rng=0)
clear, hammering = structure.attractors
response = natural**2 - frequency**2 + 2j * damping * natural * frequency
print(structure)
print(f"amplitude of the clear state {1e6 * np.ptp(clear.orbit[:, 0]) / 2:.2f} µm")
print(f"closed form                  {1e6 * shaking / abs(response):.2f} µm")

# %%
# The corners of the basins are where motions begin to graze a plate.

fig, ax = plt.subplots(layout="constrained")
structure.plot(ax=ax)

# %%
# In contact all forces but that of the plate are negligible. A ball with the speed v then
# enters to the depth :math:`\delta` with :math:`\tfrac25 k\,\delta^{5/2} = \tfrac12 v^2`,
# and the contact lasts :math:`2.943\,\delta/v` (Goldsmith, *Impact*, 1960). ``peak_depth``
# and ``peak_force`` (per unit mass) describe the hardest impact of an orbit.

depth = hammering.peak_depth["right"]
speed = math.sqrt(0.8 * stiffness * depth**2.5)
duration = 2.943 * depth / speed
for side, force in hammering.peak_force.items():
    print(f"{side} plate: largest force {mass * force:.1f} N")
print(f"impact at {speed:.3f} m/s, {1e6 * depth:.2f} µm deep")
print(f"contact of {1e6 * duration:.0f} µs in a period of {1e3 * osc.period:.0f} ms")

# %%
# The activation energy
# ---------------------
#
# The intensity D of white noise is half the one-sided power spectral density of the random
# acceleration. For weak noise the mean time until the ball hammers is
# :math:`C e^{\Delta U/D}`, and :math:`\Delta U` does not depend on D.

least = vk.LeastAction(source="clear").run(osc, structure)
energy = least.energy("clear", "hammering")
print(least)

# %%
# The noise force on the most probable exit path grows over some ten periods, in step with
# the ball. The path ends with the first impacts.

fig, axes = plt.subplots(2, 1, sharex=True, layout="constrained")
least.plot_history(ax=axes)

# %%
# The allowed intensity follows from :math:`\Delta U` and a year. Here C is taken as the
# forcing period T. The check by simulation below determines it.

year = 365.25 * 86400.0
allowed = energy.value / math.log(year / osc.period)
psd = 2 * allowed / 9.80665**2
print(f"one exit a year: D = {allowed:.3g} m² s⁻³")
print(f"                 power spectral density {psd:.2g} g²/Hz")

# %%
# Which dimension matters
# -----------------------
#
# ``sensitivity`` has the derivative of :math:`\Delta U` in each parameter, from the path
# that is already known. Multiplied by the parameter and divided by :math:`\Delta U` it is
# the change of the energy in per cent for one per cent of the parameter. The two plates
# count together.

slopes = energy.sensitivity
both_gaps = slopes["barriers.0.position"] - slopes["barriers.1.position"]
both_laws = slopes["barriers.0.law.stiffness"] + slopes["barriers.1.law.stiffness"]
relative = {
    "gap": gap * both_gaps / energy.value,
    "shaking": shaking * slopes["excitations.0.amplitude"] / energy.value,
    "frequency": frequency * slopes["excitations.0.frequency"] / energy.value,
    "natural frequency": natural * slopes["natural_frequency"] / energy.value,
    "damping": damping * slopes["damping_ratio"] / energy.value,
    "contact stiffness": stiffness * both_laws / energy.value,
}
for name, value in relative.items():
    print(f"1 % more {name:<18} {value:+.2f} % of ΔU")

# %%
# The two frequencies matter most: the distance from resonance decides. The contact
# stiffness hardly matters.
#
# The unit of :math:`\Delta U`, m² s⁻³, gives two checks. With a longer unit of length, one
# per cent more gap and shaking and half a per cent less stiffness give 2 % more energy.
# With a shorter unit of time, one per cent more of both frequencies and two per cent more
# shaking and stiffness give 3 % more energy.

by_length = relative["gap"] + relative["shaking"] - relative["contact stiffness"] / 2
by_time = relative["natural frequency"] + relative["frequency"]
by_time += 2 * relative["shaking"] + 2 * relative["contact stiffness"]
print(f"power of the length {by_length:.6f}, exact 2")
print(f"power of the rate   {by_time:.6f}, exact 3")

# %%
# A check by simulation
# ---------------------
#
# A year cannot be simulated, but stronger noise can. At D = ΔU/4 the mean time until
# hammering is a few seconds. It determines C.

strong = energy.value / 4
search = vk.MFET(
    source="clear",
    intensities=(strong,),
    target_error=0.1,
    splitting=False,
)
(rate,) = search.run(osc, structure).rates
prefactor = rate.mean_time * math.exp(-energy.value / strong)
corrected = energy.value / math.log(year / prefactor)
error = 100 * rate.log_error
print(f"D = ΔU/4: mean exit time {rate.mean_time:.2f} s ± {error:.0f} %")
print(f"C = {1e3 * prefactor:.0f} ms, T = {1e3 * osc.period:.0f} ms")
print(f"one exit a year with this C: D = {corrected:.3g} m² s⁻³")

# %%
# What you saw
# ------------
#
# * Parameters in SI units follow from dimensions and materials.
# * The activation energy gives the allowed spectral density. The factor C changes it
#   little, because the time enters by its logarithm.
# * The sensitivities tell which dimension to hold tightly.
#
# :doc:`/questions/how-much-noise` and :doc:`/questions/which-dimension` ask these questions
# again with less code. The next tutorial, :doc:`08_from_spectrum_to_verdict`, begins with
# a measured record.

plt.show()

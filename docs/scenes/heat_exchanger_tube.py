"""
A tube in its support
=====================

A heat-exchanger tube of 0.35 kg vibrates in a support with a clearance of 0.25 mm on either side. The flow drives it
with 6 N at 65 Hz and with random forces. In its quiet state the tube does not touch the support. The page computes the
mean time in this state. All numbers are given with their units.
"""

import math

import matplotlib.pyplot as plt

import vibrokit as vk

osc = vk.Oscillator(
    mass="0.35 kg",
    stiffness="22 kN/m",
    damping_ratio="0.8 %",
    barriers=(
        vk.Barrier(vk.Linear("2 MN/m"), position="0.25 mm", side="right"),
        vk.Barrier(vk.Linear("2 MN/m"), position="-0.25 mm", side="left"),
    ),
    excitations=(vk.Harmonic(amplitude="6 N", frequency="65 Hz"),),
    noise=vk.WhiteNoise("9.8e-5 N^2/Hz"),
)
structure = vk.find_structure(osc, cells=(40, 40), starts=(12, 12), saddles=False)
clear = structure.attractors[0]
print(structure)

# %%
# Exit times from the quiet state by simulation. The share of tubes that have not left falls exponentially.

intensity = float(osc.noise.intensity)
times = vk.MFET(source="clear", intensities=(intensity,), splitting=False).run(osc, structure)
fig, ax = plt.subplots(layout="constrained")
drawn = times.plot_exit_times(ax=ax, source="clear")

# %%
# An independent simulation at this intensity, :math:`D` = 4e-4 m² s⁻³, gives a mean time of 38.1 ± 0.8 s
# (``tests/physics/test_density_errors.py``). The two agree within three standard errors.

mean = 1 / sum(rate.value for rate in times.rates)
error = mean**2 * math.hypot(*(rate.value * rate.log_error for rate in times.rates))
print(f"D = {intensity:.3g} m² s⁻³, mean time {mean:.1f} ± {error:.1f} s; independent simulation: 38.1 ± 0.8 s")
assert abs(mean - 38.1) < 3 * math.hypot(error, 0.8)

# %%
# The amplitude without contact has a closed form.

natural, frequency = math.sqrt(22e3 / 0.35), 2 * math.pi * 65
amplitude = 6 / 0.35 / math.hypot(natural**2 - frequency**2, 2 * 0.008 * natural * frequency)
print(f"amplitude: {1e3 * clear.extent[0, 1]:.6f} mm; closed form: {1e3 * amplitude:.6f} mm")
assert abs(clear.extent[0, 1] / amplitude - 1) < 1e-5

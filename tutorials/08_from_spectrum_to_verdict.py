"""
From a spectrum to a verdict
============================

**Question:** A part rattles in some vehicles and not in others. How long does it stay quiet
at the vibration that was measured?

A gear lever moves between two stops. The drawing gives its mass, stiffness and clearance,
and an accelerometer on its support has recorded the vibration while driving. This tutorial
makes a scene with units of both, runs ``assess``, and reads the verdict with its intervals.
The record is synthetic, so that the estimates can be compared with the true values.

``python tutorials/08_from_spectrum_to_verdict.py`` prints the numbers of this page and then
shows its pictures in windows. Without a display it only prints. It takes about a minute,
and longer the first time, when the equations are compiled.
"""

import math

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import welch

import vibrokit as vk

# %%
# The record
# ----------
#
# The accelerometer has recorded 32 s at 2048 samples per second. The record is the sum of
# the vibration of the engine at 54 Hz and of random vibration from the road, whose
# one-sided power spectral density is 2·10⁻⁶ g²/Hz.

rate, seconds, g_n = 2048, 32, 9.80665
true_amplitude = 4.5 / 0.42  # m/s²
true_intensity = 2e-6 * g_n**2 / 2  # m² s⁻³
t = np.arange(rate * seconds) / rate
rng = np.random.default_rng(0)
road = math.sqrt(true_intensity * rate) * rng.standard_normal(t.size)
record = true_amplitude * np.cos(2 * math.pi * 54 * t + 0.4) + road

# %%
# The periodic part is separated first, by a least-squares fit of a wave of 54 Hz. Without
# contact it acts on the lever as a harmonic force per unit mass; its phase does not matter.

waves = np.column_stack([trig(2 * math.pi * 54 * t) for trig in (np.cos, np.sin)])
coefficients = np.linalg.lstsq(waves, record, rcond=None)[0]
amplitude = float(np.hypot(*coefficients))
rest = record - waves @ coefficients
print(f"amplitude at 54 Hz {amplitude:.3f} m/s², true {true_amplitude:.3f} m/s²")

# %%
# The rest determines the noise. The intensity D is half the one-sided power spectral
# density of the acceleration (:doc:`/questions/spectrum-to-d`). ``from_record`` fits the
# density of white noise to Welch's estimate. A misfit of about 1 means that the record is
# white, within its errors, at the frequencies that were fitted.

estimate = vk.WhiteNoise.from_record(t, rest)
D, D_error = estimate.noise.parameters["intensity"], estimate.standard_errors["intensity"]
print(f"D = ({1e5 * D:.3f} ± {1e5 * D_error:.3f})·10⁻⁵ m² s⁻³")
print(f"true {1e5 * true_intensity:.3f}·10⁻⁵ m² s⁻³")
print(f"power spectral density {2 * D / g_n**2:.3g} g²/Hz, misfit {estimate.misfit:.2f}")

# %%
# Welch's estimate of the whole record shows the line of the engine above the density 2D.

fig, ax = plt.subplots(layout="constrained")
f, density = welch(record, rate, nperseg=rate)
ax.loglog(f[2:], density[2:], linewidth=0.8, label="record")
ax.axhline(2 * D, color="black", linestyle="--", label="$2D$")
ax.set(xlabel="frequency $f$ (Hz)", ylabel=r"PSD $G$ ((m/s²)²/Hz)")
ax.legend()

# %%
# The scene
# ---------
#
# The dimensions are those of the drawing, with their units. Forces per unit mass and
# frequencies in rad/s follow from them (:doc:`/how-to/units`). The displacement is counted
# from the support.

osc = vk.Oscillator(
    mass="0.42 kg",
    stiffness="31 kN/m",
    damping_ratio="1.5 %",
    barriers=(
        vk.Barrier(vk.Linear("1.5 MN/m"), "0.3 mm", "right"),
        vk.Barrier(vk.Linear("1.5 MN/m"), "-0.3 mm", "left"),
    ),
    excitations=(vk.Harmonic(amplitude, "54 Hz"),),
    noise=estimate.noise,
)

# %%
# ``plausibility`` prints closed forms of the scene. A wrong unit shows here first.

print(vk.plausibility(osc))

# %%
# The assessment
# --------------
#
# ``assess`` finds the steady states, and runs several methods on each state. Here it is
# restricted to the clear-running state, two methods and an accuracy of 20 %.

a = vk.assess(
    osc,
    source="clear",
    accuracy=0.2,
    methods=("least-action", "mfet"),
    time_limit=None,
)
print("states:", ", ".join(a.names))
print(a.mean_time("clear"))

# %%
# The time until the lever rattles is random, with an exponential law. For a drive of one
# hour the probability of leaving counts. For a design, the largest allowed intensity
# counts. It is marked as extrapolated, since at so weak a noise no rate was computed.

print(a.probability_of_leaving("clear", within="1 h"))
print(a.allowed_intensity("clear", mean_time="1 yr"))

# %%
# The methods are independent. ``reconciliation`` compares them exit by exit, within their
# errors (:doc:`/questions/do-methods-agree`).

for verdict in a.reconciliation.verdicts:
    print(f"{verdict.one} and {verdict.other}: {verdict.code.value}")

# %%
# The points are mean exit times by simulation, the line has the slope of the activation
# energy by least action.

fig, ax = plt.subplots(layout="constrained")
a.plot(ax=ax)

# %%
# The inputs
# ----------
#
# The intervals above hold for the estimated D and for the dimensions of the drawing. Their
# errors count as well. With :math:`\tau = C e^{\Delta U/D}`, a relative change of D
# changes :math:`\ln\tau` by :math:`\Delta U/D` times as much.

energy = a.energy("clear")
ratio = energy.value / D
print(f"ΔU = {energy.value:.4g} m² s⁻³, bounds {energy.lower:.4g} to {energy.upper:.4g}")
print(f"ΔU/D = {ratio:.1f}")
print(f"1 % more D divides the mean time by {math.exp(ratio / 100):.2f}")

# %%
# ``sensitivities`` has the same for each dimension. A name with an asterisk stands for
# both stops together.

for one in a.sensitivities("clear"):
    factor = 1 + one.time / 100
    change = f"{one.energy:+6.2f} % of ΔU, mean time × {factor:.3g}"
    print(f"1 % more {one.parameter:<26} {change}")

# %%
# What you saw
# ------------
#
# * A record gives the harmonic force and the intensity D with its error; the drawing gives
#   the rest of the scene.
# * ``assess`` answers with intervals: the mean time, the probability of leaving during a
#   drive, and the allowed vibration. The two methods agree.
# * The mean time is most sensitive to the frequencies and to the clearance. Measure these
#   before you trust a number.
#
# ``vk.save_scene(osc, "lever.toml")`` writes the scene as a file, and
# ``a.report().save("lever.html")`` a page to hand on (:doc:`/how-to/report`).
# :doc:`/questions/index` continues with the questions of an engineer.

plt.show()

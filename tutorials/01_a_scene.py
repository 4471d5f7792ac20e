"""
A scene, its equations, a trajectory
====================================

**Question:** Into which steady motions can a mass between two stops settle?

A mass on a spring moves between two stops. A constant force pushes it towards the right
stop, and a harmonic force drives it. At the same forcing the mass has two steady states:
one runs clear of the stops, the other hammers the right stop. This tutorial composes the
scene from parts, reads the derived equations, finds both states, and compares them with
closed forms.

``python tutorials/01_a_scene.py`` prints the numbers of this page and then shows its
pictures in windows. Without a display it only prints.
"""

import textwrap

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

# %%
# The scene
# ---------
#
# A scene consists of parts. Per unit mass, its equation of motion is
#
# .. math::
#
#    \ddot x + 2\zeta\omega_n \dot x + \omega_n^2 x
#    = \text{stops} + \text{excitations} + \text{noise}.
#
# The values below are dimensionless and come from a published example. A stop consists of
# a contact law and a position. The law gives the contact force as a function of the
# depth. The barrier holds the position and the side on which the stop is.

osc = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=0.01,
    barriers=(
        vk.Barrier(vk.Hertz(stiffness=50.0), position=0.5, side="right"),
        vk.Barrier(vk.Hertz(stiffness=50.0), position=-0.5, side="left"),
    ),
    excitations=(
        vk.Harmonic(amplitude=0.18, frequency=0.57),
        vk.Constant(force=0.2),
    ),
    noise=vk.WhiteNoise(intensity=2e-5),
)

# %%
# The toolkit contains the same scene as a file.

assert osc == vk.load_scene("hertz-0.570")

# %%
# Each parameter has a dotted name.

for name, value in osc.parameters.items():
    print(f"{name:<28} {value:g}")

# %%
# ``replace`` returns a new oscillator with other values. An unambiguous ending of the
# dotted name is sufficient. Fields of the scene may be given by name.

gentler = osc.replace({"amplitude": 0.1})
assert gentler == osc.replace({"excitations.0.amplitude": 0.1})
damped = osc.replace(damping_ratio=0.02, noise=vk.WhiteNoise(intensity=1e-4))
print("ζ =", damped.parameters["damping_ratio"])
print("D =", damped.parameters["noise.intensity"])

# %%
# The equations
# -------------
#
# SymPy derives the equations from the parts. For a scene with noise they are Hamilton's
# equations of the most probable paths, with the momentum :math:`p = (p_1, p_2)` and the
# action :math:`S`. For :math:`p = 0` they are the equations of motion. Both stops push
# the mass back: the right stop to the left, with a minus sign, and the left stop to the
# right.

for equation in str(osc.model).splitlines():
    print(textwrap.fill(equation, 86, subsequent_indent=" " * 8))

# %%
# Stops that conserve energy do not change the rate at which areas of the phase plane
# contract: the divergence of the drift is :math:`-2\zeta\omega_n` everywhere.

divergence = osc.model.jacobian.trace()
print("divergence of the drift:", divergence)

# %%
# A trajectory
# ------------
#
# The mass starts at rest, at the maximum of the harmonic force, and is followed for 40
# forcing periods. ``RK4`` takes a fixed number of steps per period. ``Order8`` and
# ``FreeFlight`` are more accurate, locate every contact, and take longer to compile
# (:doc:`/how-to/steppers`).

start = osc.trajectory((0.0, 0.0), periods=40, stepper=vk.RK4(steps=256))
print(f"from rest, x goes from {start.x.min():.3f} to {start.x.max():.3f}")
print("the stops are at", start.stops)

# %%
# The section and two steady states
# ---------------------------------
#
# The stroboscopic section contains the states at the times 0, T, 2T, …, where
# :math:`T = 2\pi/\omega` is the forcing period. A motion of period T is a fixed point of
# the section map. ``section_map`` maps many states at once. Deviations from a steady
# state without contact decrease by the factor :math:`e^{-\zeta\omega_n T} \approx 0.9`
# per period, so that 400 periods are sufficient.

fine = vk.RK4(steps=2048)
starts = np.array([[0.45, 0.0], [0.0, 0.0]])
clear, hammering = osc.section_map(starts, periods=400, stepper=fine)
errors = osc.error_estimate([clear, hammering], stepper=fine)
print(f"clear-running:  x = {clear[0]:.8f}, v = {clear[1]:.8f}")
print(f"hammering:      x = {hammering[0]:.8f}, v = {hammering[1]:.8f}")
print("largest error by the next finer steps:", f"{errors.max():.0e}")

# %%
# The clear-running state has no contact. It is the forced motion of a linear oscillator:
# it oscillates about :math:`f_1/\omega_n^2` with the complex amplitude
#
# .. math::
#
#    X = \frac{f_0}{\omega_n^2 - \omega^2 + 2 i \zeta\omega_n\omega},
#
# where :math:`f_0` is the amplitude of the harmonic force, :math:`\omega` its frequency,
# and :math:`f_1` the constant force.

zeta, omega, f0, f1 = 0.01, 0.57, 0.18, 0.2  # ω_n = 1
response = f0 / (1 - omega**2 + 2j * zeta * omega)
exact = np.array([f1 + response.real, (1j * omega * response).real])
print(f"clear-running:  x = {clear[0]:.10f}, v = {clear[1]:.10f}")
print(f"closed form:    x = {exact[0]:.10f}, v = {exact[1]:.10f}")

clear_orbit = osc.trajectory(clear, periods=1, samples=2048, stepper=fine)
amplitude = np.ptp(clear_orbit.x) / 2
offset = clear_orbit.x[:-1].mean()
clearance = 0.5 - f1 - abs(response)
print(f"amplitude {amplitude:.6f}, closed form {abs(response):.6f}")
print(f"offset    {offset:.6f}, closed form {f1:.6f}")
print(f"clearance to the right stop: {clearance:.4f}")

# %%
# The filled circles below are the states on the section. The hammering state crosses the
# right stop twice per period.

hammering_orbit = osc.trajectory(hammering, periods=1, samples=2048, stepper=fine)

fig, ax = plt.subplots(layout="constrained")
for orbit, name in ((clear_orbit, "clear-running"), (hammering_orbit, "hammering")):
    (line,) = ax.plot(orbit.x, orbit.v, label=name)
    ax.plot(orbit.x[0], orbit.v[0], "o", color=line.get_color())
for stop in clear_orbit.stops:
    ax.axvline(stop, color="0.55", linestyle="--", label="stop" if stop > 0 else None)
ax.set(xlabel="displacement $x$ (m)", ylabel="velocity $v$ (m/s)")
ax.legend(loc="lower left")


# %%
# A hit is an entry into contact.


def hits(orbit):
    """Count the entries into contact with the right and the left stop."""
    left, right = orbit.stops[1], orbit.stops[0]
    contacts = (orbit.x > right, orbit.x < left)
    return tuple(int(np.sum(~now[:-1] & now[1:])) for now in contacts)


print("hits of the right and the left stop per period")
print("    clear-running:", hits(clear_orbit))
print("    hammering:    ", hits(hammering_orbit))

# %%
# Two checks
# ----------
#
# First, energy. The stops are conservative. Over one period of a steady state the work of
# the forcing therefore equals the energy that the damping dissipates.


def energy_balance(orbit):
    """Return the work of the forcing and the dissipation over one period."""
    work = np.trapezoid(f0 * np.cos(omega * orbit.t) * orbit.v, orbit.t)
    dissipation = np.trapezoid(2 * zeta * orbit.v**2, orbit.t)
    return work, dissipation


for name, orbit in (("clear-running", clear_orbit), ("hammering", hammering_orbit)):
    work, dissipation = energy_balance(orbit)
    print(f"{name:<14} work {work:.6f}, dissipation {dissipation:.6f}")

# %%
# Second, areas. Let :math:`M` be the derivative of the section map at the fixed point.
# Because the divergence of the drift is constant, an area on the section contracts by
# :math:`\det M = e^{-2\zeta\omega_n T}` per period. The eigenvalues of :math:`M` are the
# multipliers of the steady state. It is stable if they lie inside the unit circle. Here
# :math:`M` is computed by central differences.


def map_derivative(point, step=1e-5):
    """Return the derivative of the section map at a point."""
    nudges = step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    east, west, north, south = osc.section_map(point + nudges, stepper=fine)
    return np.column_stack([east - west, north - south]) / (2 * step)


derivatives = {
    "clear-running": map_derivative(clear),
    "hammering": map_derivative(hammering),
}
contraction = np.exp(-2 * zeta * osc.period)
for name, M in derivatives.items():
    sizes = np.abs(np.linalg.eigvals(M))
    print(f"{name:<14} det M = {np.linalg.det(M):.7f}, exact {contraction:.7f}")
    print(f"{'':<14} absolute values of the multipliers {sizes.round(4)}")

# %%
# Noise
# -----
#
# With a seed (``rng=``) the same call adds the noise of the scene, of intensity D. The
# mass starts in the clear-running state and stays near it for some time. Then the noise
# drives it out, and the mass hammers the right stop. Another seed gives another time.
# Only the hammering motion reaches :math:`x < -0.3`, which shows when the transition has
# happened.

noisy = osc.trajectory(clear, periods=80, rng=10, stepper=vk.RK4(steps=256))
far_left = noisy.x < -0.3
jump = noisy.t[np.argmax(far_left)] / osc.period if far_left.any() else np.inf
print(f"hammering begins before t = {jump:.1f} T")

fig, ax = plt.subplots(layout="constrained")
ax.plot(noisy.t / osc.period, noisy.x, linewidth=0.8)
for stop in noisy.stops:
    ax.axhline(stop, color="0.55", linestyle="--")
ax.set(xlabel="time $t/T$", ylabel="displacement $x$ (m)")

# %%
# What you saw
# ------------
#
# * A scene is composed of parts; its equations are derived from them.
# * At the same forcing there are two steady states, one without contact. It agrees with
#   the closed form to ten digits.
# * Weak noise makes the mass change from one state to the other, at a random time.
#
# The mean of this time grows like :math:`e^{\Delta U/D}` as D decreases. The activation
# energy :math:`\Delta U` is one number for each state; :doc:`04_least_action` computes
# it. The next tutorial, :doc:`02_your_own_contact_law`, changes the stops.

plt.show()

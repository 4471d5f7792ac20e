"""A scene, its equations, a trajectory

A mass on a spring moves between two stops. A constant force pushes it towards the right stop, a harmonic force drives
it, and the stops push back by Hertz's law. At the same forcing the mass can settle into either of two motions: one runs
clear of the stops, the other hammers the right stop. This tutorial composes the scene from parts, reads the derived
equations, integrates trajectories, and finds both motions on the stroboscopic section.

Run it with ``python tutorials/01_a_scene.py``. It prints its results and saves two pictures.
"""

from pathlib import Path

import numpy as np

import vibrokit as vk

# ---------------------------------------------------------------------------------------------------------------------
# 1. The scene
#
# A scene is a sum of parts: x″ + 2ζω_n x′ + ω_n² x = stops + excitations + noise, all per unit mass. The values are
# those of a published example and are dimensionless. A stop is a contact law at a position: the law gives the force as
# a function of depth, the barrier the position and the side of the mass.

osc = vk.Oscillator(
    natural_frequency=1.0,
    damping_ratio=0.01,
    barriers=(
        vk.Barrier(vk.Hertz(stiffness=50.0), position=0.5, side="right"),
        vk.Barrier(vk.Hertz(stiffness=50.0), position=-0.5, side="left"),
    ),
    excitations=(vk.Harmonic(amplitude=0.18, frequency=0.57), vk.Constant(force=0.2)),
    noise=vk.WhiteNoise(intensity=2e-5),
)

# The toolkit contains the same scene as a file.

assert osc == vk.load_scene("hertz-0.570")

# Every parameter has a dotted name, its path. `replace` returns a new oscillator with some of them changed. An
# unambiguous ending of the name is enough. Fields of the scene can be given by name, too.

for path, value in osc.parameters.items():
    print(f"{path:<28} {value:g}")

gentler = osc.replace({"amplitude": 0.1})
assert gentler == osc.replace({"excitations.0.amplitude": 0.1})
damped = osc.replace(damping_ratio=0.02, noise=vk.WhiteNoise(intensity=1e-4))

# ---------------------------------------------------------------------------------------------------------------------
# 2. The equations
#
# The equations are derived from the parts. For a scene with noise they are Hamilton's equations of the most probable
# paths: p_1 and p_2 are momenta, S is the action. With p_1 = p_2 = 0 they are the equations of motion. Both stops push
# the mass back: the right stop to the left, with a minus sign, the left stop to the right.

print(osc.model)

# The terms are SymPy expressions; a notebook shows `osc.model` typeset. Stops that conserve energy do not change how
# fast areas of the phase plane contract: the divergence of the drift is −2ζω_n everywhere.

divergence = osc.model.jacobian.trace()
print("divergence of the drift:", divergence)

# ---------------------------------------------------------------------------------------------------------------------
# 3. A trajectory
#
# The mass starts at rest and is followed for 40 forcing periods. At t = 0 the harmonic force has its maximum. `RK4`
# takes a fixed number of steps per period and compiles in one or two seconds. `Order8` and `FreeFlight` locate every
# contact to ten digits and take longer to compile for a new kind of scene.

start = osc.trajectory((0.0, 0.0), periods=40, stepper=vk.RK4(steps=256))
print(f"from rest, x goes from {start.x.min():.3f} to {start.x.max():.3f}; the stops are at -0.5 and 0.5")

# ---------------------------------------------------------------------------------------------------------------------
# 4. The section map, and two steady states
#
# Sampled once per forcing period, at t = 0, T, 2T, …, a periodic motion is a fixed point. `section_map` maps many
# states at once. With weak damping transients are long: deviations decrease by exp(−ζω_n T) ≈ 0.9 per period, so 400
# periods are sufficient. With 2048 steps per period the fixed points have at least six digits. `error_estimate`
# compares with the next finer setting.

fine = vk.RK4(steps=2048)
starts = np.array([[0.45, 0.0], [0.0, 0.0]])
clear, hammering = osc.section_map(starts, periods=400, stepper=fine)
errors = osc.error_estimate([clear, hammering], stepper=fine)
print("running clear: (x, v) =", clear, " error about", errors[0])
print("hammering:     (x, v) =", hammering, " error about", errors[1])

# The motion without contact is that of a linear oscillator: it oscillates about the static offset f₁/ω_n² = 0.2 with
# the amplitude f₀/√((ω_n² − ω²)² + (2ζω_nω)²) = 0.266589, so its distance from the right stop is 0.0335.

clear_orbit = osc.trajectory(clear, periods=1, samples=2048, stepper=fine)
hammering_orbit = osc.trajectory(hammering, periods=1, samples=2048, stepper=fine)
amplitude = np.ptp(clear_orbit.x) / 2
offset = clear_orbit.x[:-1].mean()
print(f"running clear: amplitude {amplitude:.6f} about {offset:.6f}")


# ---------------------------------------------------------------------------------------------------------------------
# 5. Stop hits
#
# A hit is an entry into contact. The hammering state hits the right stop twice per period and never reaches the left
# stop.


def hits(orbit):
    """Count the entries into contact with the right and the left stop."""
    left, right = min(orbit.stops), max(orbit.stops)
    return tuple(int(np.sum(~touching[:-1] & touching[1:])) for touching in (orbit.x > right, orbit.x < left))


print("hits of the right and left stop, running clear:", hits(clear_orbit), " hammering:", hits(hammering_orbit))

# ---------------------------------------------------------------------------------------------------------------------
# 6. Two independent checks
#
# Energy: over one period of a steady state the work of the forcing equals the dissipation. The stops are conservative.


def power_balance(orbit):
    """Return the work of the forcing and the dissipation over one period."""
    numbers = osc.parameters
    push = numbers["excitations.0.amplitude"] * np.cos(numbers["excitations.0.frequency"] * orbit.t)
    damping = 2 * numbers["damping_ratio"] * numbers["natural_frequency"] * orbit.v
    return np.trapezoid(push * orbit.v, orbit.t), np.trapezoid(damping * orbit.v, orbit.t)


for name, orbit in (("running clear", clear_orbit), ("hammering", hammering_orbit)):
    work, loss = power_balance(orbit)
    print(f"{name}: work of the forcing {work:.6f} per period, dissipation {loss:.6f}")

# Areas: because of the divergence above, a small area of the section contracts by exp(−2ζω_n T) per period. The
# derivative of the section map, here by central differences, must have this determinant. Its eigenvalues, the
# multipliers, lie inside the unit circle: both states are stable.


def map_derivative(point, step=1e-5):
    """Return the derivative of the section map at a point."""
    nudges = step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    east, west, north, south = osc.section_map(point + nudges, stepper=fine)
    return np.column_stack([east - west, north - south]) / (2 * step)


clear_derivative, hammering_derivative = map_derivative(clear), map_derivative(hammering)
for name, derivative in (("running clear", clear_derivative), ("hammering", hammering_derivative)):
    multipliers = np.linalg.eigvals(derivative)
    print(f"{name}: areas contract by {np.linalg.det(derivative):.6f} per period; multipliers {multipliers.round(4)}")
print(f"exp(-2 zeta omega_n T) = {np.exp(-2 * 0.01 * osc.period):.6f}")

# ---------------------------------------------------------------------------------------------------------------------
# 7. Noise
#
# With a seed (`rng=`) the same call adds noise of the scene's intensity D. The mass starts on the clear-running motion
# and stays near it for some time. Then the noise drives it out, and it hammers. Another seed gives another exit time.
# Only the hammering motion reaches x < -0.3, which shows when the transition happened.

shaken = osc.trajectory(clear, periods=80, rng=10, stepper=vk.RK4(steps=256))
far_left = shaken.x < -0.3
jump = shaken.t[np.argmax(far_left)] / osc.period if far_left.any() else np.inf
print(f"with noise, it leaves the clear-running motion within {jump:.1f} periods")

# The mean exit time grows like exp(ΔU/D) as D decreases. ΔU is the activation energy, one number for each state.
# `vk.find_structure(osc)` finds the steady states and their basins, and `vibrokit run hertz-0.570` also computes ΔU.


# ---------------------------------------------------------------------------------------------------------------------
# 8. Pictures
#
# Every plotting function draws into the axes that it is given.


def draw_states(axes):
    """Draw the two steady states in the phase plane, their points on the section, and the stops."""
    from vibrokit.plots.portraits import phase_portrait

    for label, (name, orbit) in enumerate((("runs clear", clear_orbit), ("hammers", hammering_orbit))):
        line = phase_portrait(orbit.x, orbit.v, stops=orbit.stops, label=label, ax=axes).line
        line.set_label(name)
        axes.plot(orbit.x[0], orbit.v[0], "o", color=line.get_color(), markeredgecolor="white")
    axes.legend(loc="lower left", fontsize=8)


def draw_jump(axes):
    """Draw displacement against time: first near the clear-running motion, later hammering."""
    axes.plot(shaken.t / osc.period, shaken.x, linewidth=0.8)
    for stop in shaken.stops:
        axes.axhline(stop, color="0.55", linewidth=1.0, linestyle="--")
    axes.set_xlabel(r"time $t / T$")
    axes.set_ylabel(r"displacement $x$ (m)")


def save_pictures(folder):
    """Save both pictures in a folder and print where they are."""
    from matplotlib.figure import Figure

    folder.mkdir(exist_ok=True)
    for draw, name in ((draw_states, "01-steady-states.png"), (draw_jump, "01-jump.png")):
        figure = Figure(figsize=(6.0, 4.2), layout="constrained")
        draw(figure.add_subplot())
        figure.savefig(folder / name, dpi=150)
        print("picture:", folder / name)


if __name__ == "__main__":
    save_pictures(Path.cwd() / "tutorial-pictures")

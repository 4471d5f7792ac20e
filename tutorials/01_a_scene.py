"""A scene, its equations, a trajectory

A mass on a spring hangs between two stops. A constant force pushes it towards the right one, a harmonic force shakes
it, and the stops push back by Hertz's law. For one and the same forcing it can settle into either of two motions: one
that runs clear of the stops and one that hammers the right stop. This tutorial composes that scene from parts, reads
the equations that are derived from it, follows trajectories, and finds both motions on the stroboscopic section.

Run it with ``python tutorials/01_a_scene.py``; it prints what it finds and saves two pictures.
"""

from pathlib import Path

import numpy as np

import vibrokit as vk

# ---------------------------------------------------------------------------------------------------------------------
# 1. The scene
#
# A scene is a sum of parts: x″ + 2ζω_n x′ + ω_n² x = stops + excitations + noise, everything per unit mass. The
# numbers are those of a published example and have no dimension. A stop is a contact law put somewhere: the law says
# how hard it pushes at which depth, the barrier says where it is and on which side of the mass.

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

# The same scene comes with the toolkit, as a file that can be read and changed.

assert osc == vk.load_scene("hertz-0.570")

# Every number has a path. To change one, name it; what comes back is a new oscillator, and the old one is as it was.

for path, value in osc.parameters.items():
    print(f"{path:<28} {value:g}")

gentler = osc.replace({"excitations.0.amplitude": 0.1})

# ---------------------------------------------------------------------------------------------------------------------
# 2. The equations
#
# They are derived, not typed in. With noise in the scene these are Hamilton's equations for the most probable paths:
# p_1 and p_2 are momenta, S the action. With p_1 = p_2 = 0 they are the plain equations of motion. Both stops push the
# mass back: the right one to the left, with a minus sign, the left one to the right.

print(osc.model)

# The pieces are SymPy expressions (in a notebook, `osc.model` alone shows them typeset). A stop that conserves energy
# does not change how fast areas of the phase plane shrink: the divergence of the drift is −2ζω_n everywhere.

divergence = osc.model.jacobian.trace()
print("divergence of the drift:", divergence)

# ---------------------------------------------------------------------------------------------------------------------
# 3. A trajectory
#
# From rest, over 40 periods of the forcing. Time counts from t = 0, where the forcing is at its crest. `RK4` takes a
# fixed number of steps a period and compiles in a second or two; `Order8` and `FreeFlight`, which find every contact to
# ten digits, take longer to compile when they first meet a scene of a new kind.

start = osc.trajectory((0.0, 0.0), periods=40, stepper=vk.RK4(steps=256))
print(f"from rest, x goes from {start.x.min():.3f} to {start.x.max():.3f}; the stops are at -0.5 and 0.5")

# ---------------------------------------------------------------------------------------------------------------------
# 4. The section map, and two steady states
#
# Looked at once per forcing period, at t = 0, T, 2T, …, a periodic motion is a fixed point. `section_map` carries many
# states at once. Slow damping makes slow transients: deviations shrink by exp(−ζω_n T) ≈ 0.9 a period, so 400 periods
# are ample. Two thousand steps per period are more than pictures need, and make the fixed points good to six digits
# and better: `error_estimate` compares with the next finer setting.

fine = vk.RK4(steps=2048)
starts = np.array([[0.45, 0.0], [0.0, 0.0]])
clear, hammering = osc.section_map(starts, periods=400, stepper=fine)
errors = osc.error_estimate([clear, hammering], stepper=fine)
print("running clear: (x, v) =", clear, " error about", errors[0])
print("hammering:     (x, v) =", hammering, " error about", errors[1])

# The motion that touches nothing is that of a linear oscillator, known by heart: it swings about the static offset
# f₁/ω_n² = 0.2 with the amplitude f₀/√((ω_n² − ω²)² + (2ζω_nω)²) = 0.266589, and so comes within 0.0335 of the stop.

clear_orbit = osc.trajectory(clear, periods=1, samples=2048, stepper=fine)
hammering_orbit = osc.trajectory(hammering, periods=1, samples=2048, stepper=fine)
amplitude = np.ptp(clear_orbit.x) / 2
offset = clear_orbit.x[:-1].mean()
print(f"running clear: amplitude {amplitude:.6f} about {offset:.6f}")


# ---------------------------------------------------------------------------------------------------------------------
# 5. Stop hits
#
# A hit is an entry into contact. The hammering state touches the right stop twice in each period, and the left one
# never: it does not get that far to the left.


def hits(orbit):
    """Count the entries into contact with the right and the left stop."""
    left, right = min(orbit.stops), max(orbit.stops)
    return tuple(int(np.sum(~touching[:-1] & touching[1:])) for touching in (orbit.x > right, orbit.x < left))


print("hits of the right and left stop, running clear:", hits(clear_orbit), " hammering:", hits(hammering_orbit))

# ---------------------------------------------------------------------------------------------------------------------
# 6. Two checks that know nothing of the code
#
# Energy: over a period of a steady state, what the forcing puts in is what the damping takes out. The stops give back
# all they take.


def power_balance(orbit):
    """Return the work of the forcing over one period, and what the damping takes."""
    numbers = osc.parameters
    push = numbers["excitations.0.amplitude"] * np.cos(numbers["excitations.0.frequency"] * orbit.t)
    damping = 2 * numbers["damping_ratio"] * numbers["natural_frequency"] * orbit.v
    return np.trapezoid(push * orbit.v, orbit.t), np.trapezoid(damping * orbit.v, orbit.t)


for name, orbit in (("running clear", clear_orbit), ("hammering", hammering_orbit)):
    work, loss = power_balance(orbit)
    print(f"{name}: the forcing puts in {work:.6f} a period, the damping takes {loss:.6f}")

# Areas: the divergence above says that a small area of the section shrinks by exp(−2ζω_n T) a period, at either state.
# The derivative of the section map, by central differences, has that determinant. Its eigenvalues, the multipliers,
# are inside the unit circle: both states are stable.


def map_derivative(point, step=1e-5):
    """Return the derivative of the section map at a point."""
    nudges = step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    east, west, north, south = osc.section_map(point + nudges, stepper=fine)
    return np.column_stack([east - west, north - south]) / (2 * step)


clear_derivative, hammering_derivative = map_derivative(clear), map_derivative(hammering)
for name, derivative in (("running clear", clear_derivative), ("hammering", hammering_derivative)):
    multipliers = np.linalg.eigvals(derivative)
    print(f"{name}: areas shrink by {np.linalg.det(derivative):.6f} a period; multipliers {multipliers.round(4)}")
print(f"exp(-2 zeta omega_n T) = {np.exp(-2 * 0.01 * osc.period):.6f}")

# ---------------------------------------------------------------------------------------------------------------------
# 7. Shaken at random
#
# With a seed (`rng=`) the same call shakes the mass with the intensity D of the scene's noise. It starts on the motion
# that runs clear of the stops, and stays near it for a while; then a run of unlucky pushes carries it over, and it
# hammers. Another seed leaves at another time. Far to the left of where the clear motion turns (x = -0.067) only the
# hammering one goes, so that tells when it jumped.

shaken = osc.trajectory(clear, periods=80, rng=10, stepper=vk.RK4(steps=256))
far_left = shaken.x < -0.3
jump = shaken.t[np.argmax(far_left)] / osc.period if far_left.any() else np.inf
print(f"shaken at random, it leaves the clear motion within {jump:.1f} periods")

# How long it stays on average is the question that the toolkit answers: it grows like exp(ΔU/D) as D falls, with one
# number ΔU, the activation energy, for each state. `vk.find_structure(osc)` finds the steady states of a scene and
# their basins without a guess to start from, and `vibrokit run hertz-0.570` goes on to ΔU.


# ---------------------------------------------------------------------------------------------------------------------
# 8. Pictures
#
# Every picture is a function that draws into axes of yours.


def draw_states(axes):
    """Draw the two steady states in the phase plane, their points on the section, and the stops."""
    from vibrokit.plots.portraits import phase_portrait

    for label, (name, orbit) in enumerate((("runs clear", clear_orbit), ("hammers", hammering_orbit))):
        *_, line = phase_portrait(orbit.x, orbit.v, stops=orbit.stops, label=label, ax=axes)
        line.set_label(name)
        axes.plot(orbit.x[0], orbit.v[0], "o", color=line.get_color(), markeredgecolor="white")
    axes.legend(loc="lower left", fontsize=8)


def draw_jump(axes):
    """Draw displacement against time: near the clear motion first, hammering later."""
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

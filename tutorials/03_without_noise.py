"""What the system does without noise

The stability of a steady state against noise depends on the motion without noise: how many steady states there are,
which starts lead to each of them, and what separates them. This tutorial finds all of this with `find_structure` for
the scene of the first tutorial, checks the numbers independently, computes the smallest kick that leaves each state,
and follows the states as the forcing frequency changes.

Run it with ``python tutorials/03_without_noise.py``. It prints its results and saves four pictures.
"""

from pathlib import Path

import numpy as np

import vibrokit as vk

# ---------------------------------------------------------------------------------------------------------------------
# 1. The structure of a scene
#
# The search integrates a grid of starts until each recurs on the stroboscopic section, and refines the orbits by
# Newton's method. It then computes the attractor of every cell of a grid (the basins), follows the basin boundaries to
# the saddles on them, and grows the manifolds of the saddles. The status lists what was found.

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, rng=0)
print(structure.status)

# ---------------------------------------------------------------------------------------------------------------------
# 2. The attractors
#
# `name` describes what the attractor does. `period` is in forcing periods, `hits` counts the entries into contact with
# each stop per orbit. The largest multiplier is the factor by which a small deviation decreases per period. `residual`
# is the closing error, and `error` the change when the integration tolerance is reduced by a factor of 100.

for a in structure.attractors:
    share = f"{100 * a.basin_fraction:.1f} ± {100 * a.basin_fraction_error:.1f} %"
    print(f"{a.name}: {a.kind}, period {a.period}, hits {dict(a.hits)}, basin {share}")
    print(f"    at {a.points[0]}, largest multiplier {np.abs(a.multipliers).max():.4f}")
    print(f"    largest depth {max(a.peak_depth.values()):.4f}, largest force {max(a.peak_force.values()):.3f}")
    print(f"    residual {a.residual:.1e}, error {a.error:.1e}")

# The clear-running state has no contact. It is the forced motion of a linear oscillator, known in closed form.

clear, hammering = structure.attractors
numbers = osc.parameters
frequency, damping = numbers["excitations.0.frequency"], 2 * numbers["damping_ratio"] * numbers["natural_frequency"]
response = numbers["excitations.0.amplitude"] / (1 - frequency**2 + 1j * damping * frequency)
formula = np.array([numbers["excitations.1.force"] + response.real, (1j * frequency * response).real])
print("clear-running, from the formula:", formula, " difference:", np.abs(clear.points[0] - formula).max())

# ---------------------------------------------------------------------------------------------------------------------
# 3. The saddle
#
# Every path from one state to the other crosses the boundary of their basins. The cheapest path crosses it at a saddle,
# an orbit with one multiplier outside the unit circle: a small deviation in that direction about doubles per period.
# `leads_to` contains the attractors on either side.

(saddle,) = structure.saddles
print(f"saddle of period {saddle.period} at {saddle.points[0]}, between {saddle.leads_to}")
print("    multipliers", saddle.multipliers.real, " residual", saddle.residual)

# Elastic stops dissipate no energy, so areas contract by exp(−2ζω_n T) per period everywhere. The product of the
# multipliers must equal this number at the attractors and at the saddle.

shrinking = float(np.exp(-damping * osc.period))
products = [float(np.prod(orbit.multipliers).real) for orbit in (clear, hammering, saddle)]
print(f"areas contract by {shrinking:.8f} per period; products of multipliers:", np.round(products, 8))

# ---------------------------------------------------------------------------------------------------------------------
# 4. The smallest kick
#
# A state with a large basin can still be close to the basin boundary. The smallest kick that leaves the basin, at the
# least favourable time and direction, measures this distance. It differs from the activation energy: noise leaves the
# basin by many small pushes, each at the right time.

stability = vk.shape_stability(osc, structure)
for s in stability:
    print(
        f"{structure.names[s.label]}: basin {100 * s.basin_fraction:.1f} %, smallest kick {s.any_kick.size:.4f} at "
        f"t = {s.any_kick.time / osc.period:.2f} T; in velocity alone {s.velocity_kick.size:.4f}"
    )

# ---------------------------------------------------------------------------------------------------------------------
# 5. Continuation in the frequency
#
# `continuation` finds the steady states at each value of a parameter, joins them into branches, and locates
# bifurcations. Towards the resonance the amplitude of the clear-running state grows until it grazes the right stop.

sweep = vk.continuation(osc, "excitations.0.frequency", np.linspace(0.57, 0.65, 9), cells=(40, 40), starts=(12, 12))
print(sweep.status)
for bifurcation in sweep.bifurcations:
    print("   ", bifurcation)

# Its amplitude f₀/√((ω_n² − ω²)² + (2ζω_nω)²) about the offset 0.2 reaches the stop at 0.5 when it equals 0.3.

gap = 0.5 - numbers["excitations.1.force"]
square = np.roots([1, damping**2 - 2, 1 - (numbers["excitations.0.amplitude"] / gap) ** 2])
touching = float(np.sqrt(square.min()))
print(f"grazing frequency by the formula: {touching:.10f}")


# ---------------------------------------------------------------------------------------------------------------------
# 6. Pictures
#
# The first picture shows the section: basins in pale colours, attractors and saddle as markers, the stable manifold of
# the saddle (the basin boundary) and its unstable manifold, which leads to the attractors. The others show the motions
# in the phase plane, the branches against the frequency, and the basin fractions.

PICTURES = {
    "03-section.png": structure.plot,
    "03-motions.png": structure.plot_orbits,
    "03-branches.png": sweep.plot,
    "03-basin-fractions.png": sweep.plot_fractions,
}


def save_pictures(folder):
    """Save the pictures in a folder and print where they are."""
    from matplotlib.figure import Figure

    folder.mkdir(exist_ok=True)
    for name, draw in PICTURES.items():
        figure = Figure(figsize=(6.4, 5.0), layout="constrained")
        draw(ax=figure.add_subplot())
        figure.savefig(folder / name, dpi=150)
        print("picture:", folder / name)


if __name__ == "__main__":
    save_pictures(Path.cwd() / "tutorial-pictures")

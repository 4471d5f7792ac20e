"""What the system does without noise

Before asking how stable a steady state is against noise, one has to know the states: how many there are, where each
start leads, and what lies between them. This tutorial lets `find_structure` find all of that for the scene of the first
tutorial, without telling it where to look; reads the numbers; checks them against what can be known otherwise; and sees
how hard a single kick must be, and what becomes of the states as the forcing frequency changes.

Run it with ``python tutorials/03_without_noise.py``; it prints what it finds and saves four pictures.
"""

from pathlib import Path

import numpy as np

import vibrokit as vk

# ---------------------------------------------------------------------------------------------------------------------
# 1. Everything at once
#
# The search starts from a grid of states, follows each until it recurs on the stroboscopic section, and refines what it
# finds by Newton's method. Then it asks of every cell of a grid where it leads (the basins), follows the boundary
# between basins to the saddles on it, and grows the saddles' manifolds. The status says, in words, what was found.

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, rng=0)
print(structure.status)

# ---------------------------------------------------------------------------------------------------------------------
# 2. The attractors
#
# `period` counts forcing periods, `hits` the entries into contact with each stop in one orbit. The largest multiplier
# says by how much a small deviation shrinks per period; `residual` how far the orbit is from closing, and `error` by
# how much it moves if the integration is made a hundred times tighter.

for a in structure.attractors:
    share = f"{100 * a.basin_fraction:.1f} ± {100 * a.basin_fraction_error:.1f} %"
    print(f"attractor {a.label}: {a.kind}, period {a.period}, hits {dict(a.hits)}, basin {share}")
    print(f"    at {a.points[0]}, largest multiplier {np.abs(a.multipliers).max():.4f}")
    print(f"    deepest {max(a.peak_depth.values()):.4f}, hardest push {max(a.peak_force.values()):.3f}")
    print(f"    residual {a.residual:.1e}, moves by {a.error:.1e} when tightened")

# The clear-running state touches nothing, so that it is the forced motion of a linear oscillator, known in closed form.

clear, hammering = structure.attractors
numbers = osc.parameters
frequency, damping = numbers["excitations.0.frequency"], 2 * numbers["damping_ratio"] * numbers["natural_frequency"]
response = numbers["excitations.0.amplitude"] / (1 - frequency**2 + 1j * damping * frequency)
formula = np.array([numbers["excitations.1.force"] + response.real, (1j * frequency * response).real])
print("clear-running, from the formula:", formula, " difference:", np.abs(clear.points[0] - formula).max())

# ---------------------------------------------------------------------------------------------------------------------
# 3. The saddle
#
# Every path from one state to the other crosses the boundary of their basins, and does so most cheaply at a saddle. It
# is an orbit too, of which one multiplier is outside the unit circle: a small deviation along that direction about
# doubles in a period, and `leads_to` says to which attractors it goes on either side.

(saddle,) = structure.saddles
print(f"saddle of period {saddle.period} at {saddle.points[0]}, between {saddle.leads_to}")
print("    multipliers", saddle.multipliers.real, " residual", saddle.residual)

# Elastic stops take no energy, so that areas shrink by exp(−2ζω_n T) a period everywhere: at the attractors and at the
# saddle alike, the product of the multipliers must be that number.

shrinking = float(np.exp(-damping * osc.period))
products = [float(np.prod(orbit.multipliers).real) for orbit in (clear, hammering, saddle)]
print(f"areas shrink by {shrinking:.8f} a period; products of multipliers:", np.round(products, 8))

# ---------------------------------------------------------------------------------------------------------------------
# 4. How hard a kick?
#
# A state with a large basin can still be close to its edge somewhere. The smallest kick that throws it out, at the
# worst moment of its period and in the worst direction, says how close. It is not the activation energy: a single blow
# knows nothing of the many small pushes, each at the right moment, by which noise does it.

stability = vk.shape_stability(osc, structure)
for s in stability:
    print(
        f"attractor {s.label}: basin {100 * s.basin_fraction:.1f} %, smallest fatal kick {s.any_kick.size:.4f} at "
        f"t = {s.any_kick.time / osc.period:.2f} T; in velocity alone {s.velocity_kick.size:.4f}"
    )

# ---------------------------------------------------------------------------------------------------------------------
# 5. As the frequency changes
#
# `continuation` finds the steady states at each value of a parameter, joins them into branches, and locates where a
# branch changes in kind. Nearer to the resonance the clear-running state swings wider, until it grazes the right stop.

sweep = vk.continuation(osc, "excitations.0.frequency", np.linspace(0.57, 0.65, 9), cells=(40, 40), starts=(12, 12))
print(sweep.status)
for bifurcation in sweep.bifurcations:
    print("   ", bifurcation)

# The swing is f₀/√((ω_n² − ω²)² + (2ζω_nω)²) about the offset 0.2; it meets the stop at 0.5 where that is 0.3.

gap = 0.5 - numbers["excitations.1.force"]
square = np.roots([1, damping**2 - 2, 1 - (numbers["excitations.0.amplitude"] / gap) ** 2])
touching = float(np.sqrt(square.min()))
print(f"the formula has it graze at {touching:.10f}")


# ---------------------------------------------------------------------------------------------------------------------
# 6. Pictures
#
# The section: basins in pale colours, attractors and saddle as marks, the saddle's stable manifold (which is the
# boundary between the basins) and its unstable one (which leads to the attractors). Then the motions in the phase
# plane; the branches against the frequency; and how the basins share the region.

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

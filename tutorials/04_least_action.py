"""Activation energies

Weak noise eventually drives a mass out of any steady state. The mean exit time grows like exp(ΔU/D) as the noise
intensity D decreases. ΔU, the activation energy, is the least action of all exit paths, and the path of least action is
the most probable one. This tutorial first computes an energy that is known in closed form, then those of the two states
of the earlier tutorials with their certificates. It shows how a search can miss the cheapest path, computes the energy
of a first contact, and derives the long-term behaviour.

Run it with ``python tutorials/04_least_action.py``. It prints its results and saves four pictures. It takes about half
a minute, and longer the first time, when the equations are compiled.
"""

from pathlib import Path

import numpy as np

import vibrokit as vk

# ---------------------------------------------------------------------------------------------------------------------
# 1. A double well, where the answer is known
#
# Without forcing, the cheapest exit path from a well is the time-reversed relaxation into it: the damping term changes
# its sign. The noise must supply twice the damping force, so the momentum is p₂ = 4ζω_n v. The action of the climb is
# 4ζω_n times the barrier, here 4 × 0.05 × 1/4.

well = vk.load_scene("double-well")
in_the_well = vk.find_structure(well, cells=(60, 60), rng=0)
modest = vk.GraphSearch(nodes=(160, 160))
climb = vk.LeastAction(graph=modest, shooting=None, source=0).run(well, in_the_well)
(energy,) = climb.energies

zeta = well.parameters["damping_ratio"]
exact = 4 * zeta * 0.25
print(f"double well: ΔU = {energy.value:.12f}, exact {exact:.12f}, relative difference {energy.value / exact - 1:.1e}")
assert abs(energy.value / exact - 1) < 1e-6

path = energy.path
along = np.abs(path.p[:, 1] - 4 * zeta * path.q[:, 1]).max() / np.abs(path.p[:, 1]).max()
print(f"    p₂ equals 4ζω_n v along the path, within {along:.0e} of its maximum")

# ---------------------------------------------------------------------------------------------------------------------
# 2. The clear-running and the hammering state
#
# With forcing there is no such formula. `LeastAction` searches exit paths by two independent methods, a graph search
# over the section and shooting, and polishes each path. By default it uses both. Here the graph search alone, on
# 160 × 160 nodes, is sufficient for a first answer. The status lists the findings as sentences.

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, cells=(100, 100), rng=0)
result = vk.LeastAction(graph=modest, shooting=None).run(osc, structure)
print(result.status)
clear = result.energy("clear", "hammering")
for e in result.energies:
    print(f"{result.exit_of(e)}: ΔU = {e.value:.8g}, between {e.lower:.4g} and {e.upper:.8g} ({e.bound})")

# ---------------------------------------------------------------------------------------------------------------------
# 3. The certificate
#
# A polished path solves Hamilton's equations from the attractor to the saddle. The certificate states how well. The
# residual is the largest misfit. The three changes show how the action depends on the distance of the start from the
# attractor, on the length of the path, and on the integration tolerance.

certificate = clear.certificate
print(f"residual {certificate.residual:.0e}; path of {certificate.periods:.0f} periods")
print(f"    from {certificate.start_distance:.0e} off the attractor to {certificate.end_distance:.0e} off the saddle")
print(f"    changes by {certificate.by_start:.0e}, {certificate.by_length:.0e}, {certificate.by_stepper:.0e}")

# The certificate shows that the path is an extremal and that its action has ten digits. It does not exclude a cheaper
# path. The graph search tests this, within its error estimate. The bounds of the energy therefore are much wider than
# the numerical error of the path: everything cheaper that was not excluded lies between them.

print(f"numerical error of the path {clear.numerical_error:.0e}, width of the bounds {clear.upper - clear.lower:.0e}")

# The path ends on the saddle with zero momentum. From there the motion without noise leads to either state.

(saddle,) = structure.saddles
arrival = np.linalg.norm(clear.path.q[-1] - saddle.points[0])
left_over = np.abs(clear.path.p[-1, 1]) / np.abs(clear.path.p[:, 1]).max()
print(f"the path ends {arrival:.0e} from the saddle, with {left_over:.0e} of its largest momentum")

# ---------------------------------------------------------------------------------------------------------------------
# 4. Shooting, and how it can miss the cheapest path
#
# `ActionPlot` starts many extremals near the attractor and records their action when they leave the basin. By default
# the starts cover the two-dimensional manifold on which extremals leave. The published method, the ring, uses points on
# one small circle at one phase of the period. The circle intersects the manifold in a curve, which most paths,
# including the cheapest one, do not cross. More points on the circle do not help.

shots = vk.ActionPlot(source="clear", points=3000).run(osc, structure)
ring = vk.ActionPlot(source="clear", points=20_000, radius=1e-6).run(osc, structure)
for name, found in (("whole domain", shots), ("ring", ring)):
    value = found.energies[0].value
    print(f"{name}: {value:.4g}, {100 * (value / clear.value - 1):.2f} % above the certified path")

# ---------------------------------------------------------------------------------------------------------------------
# 5. First contact
#
# `FirstContact` computes the energy of the first contact with a stop. Until then the clear-running motion is that of a
# linear oscillator, so the energy is known: 2ζω_n³ times the square of the clearance.

few = vk.Shooting(points=500, rounds=4)
touch = (
    vk.LeastAction(shooting=few, graph=None, source="clear", exit=vk.FirstContact("right"))
    .run(osc, structure)
    .energies[0]
)

numbers = osc.parameters
frequency, damping = numbers["excitations.0.frequency"], 2 * numbers["damping_ratio"] * numbers["natural_frequency"]
amplitude = numbers["excitations.0.amplitude"] / abs(1 - frequency**2 + 1j * damping * frequency)
clearance = 0.5 - numbers["excitations.1.force"] - amplitude
by_formula = damping * clearance**2
print(f"first contact with the right stop: {touch.value:.8g}, by the formula {by_formula:.8g}")
print(f"    this is {touch.value / clear.value:.2f} of the energy of leaving the basin: most contacts lead back")

# ---------------------------------------------------------------------------------------------------------------------
# 6. The long term
#
# The energies of all transitions determine which state is the most stable, which is left first, and the exponents of
# the stationary weights. Prefactors are not known here, so that no share of time follows.

transitions = vk.Transitions.of(result)
print(transitions)
intensity = osc.noise.intensity
for e in result.energies:
    print(f"at D = {intensity:g}, ΔU/D = {e.value / intensity:.1f} for {result.exit_of(e)}")
print(transitions.stationary_weights(intensity))


# ---------------------------------------------------------------------------------------------------------------------
# 7. Pictures
#
# The action plot shows the action at the exit against the angle of the start, with jumps where neighbouring starts
# leave after different numbers of periods. The exit paths on the section, one point per period, are spirals that end on
# the saddle. The histories show the momentum p₂, the force that the noise must supply, and the action along both paths.
# The quasi-potential is the least action from the clear-running state to each point: a smooth bowl near the state, and
# folded where paths of different histories meet.

PICTURES = {
    "04-action-plot.png": shots.plot,
    "04-exit-paths.png": result.plot,
    "04-histories.png": result.plot_history,
    "04-quasi-potential.png": lambda: result.plot_quasi_potential("clear"),
}


def save_pictures(folder):
    """Save the pictures in a folder and print where they are."""
    folder.mkdir(exist_ok=True)
    for name, draw in PICTURES.items():
        draw().figure.savefig(folder / name, dpi=150)
        print("picture:", folder / name)


if __name__ == "__main__":
    save_pictures(Path.cwd() / "tutorial-pictures")

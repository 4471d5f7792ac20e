"""How hard is a state to leave?

Weak noise throws a mass out of any steady state in the end, and the time that takes grows like exp(ΔU/D) as the noise
intensity D falls. ΔU, the activation energy, is the least action of all paths that lead out: the path of least action
is the one that noise will take. This tutorial first finds one that is known in closed form; then those of the two
states that the earlier tutorials were about, with the proof that comes along; sees how a search can miss the cheapest
way; asks what it costs merely to touch a stop; and reads what follows for the long run.

Run it with ``python tutorials/04_least_action.py``; it prints what it finds and saves four pictures. It takes half a
minute, more at the very first time, when the equations of motion are compiled.
"""

from pathlib import Path

import numpy as np

import vibrokit as vk

# ---------------------------------------------------------------------------------------------------------------------
# 1. A double well, where the answer is known
#
# Without forcing the cheapest way out of a well is the way in, run backwards in time: with damping −2ζω_n in place of
# 2ζω_n. So the noise has to supply twice what damping takes, the momentum is p₂ = 4ζω_n v, and the action of the whole
# climb is 4ζω_n times the barrier, here 4 × 0.05 × 1/4.

well = vk.load_scene("double-well")
in_the_well = vk.find_structure(well, cells=(60, 60), rng=0)
modest = vk.ActionGraph(cells=(160, 160))
climb = vk.LeastAction(graph=modest, plot=None, source=0).run(well, in_the_well)
(energy,) = climb.energies

zeta = well.parameters["damping_ratio"]
exact = 4 * zeta * 0.25
print(f"double well: ΔU = {energy.value:.12f}, exact {exact:.12f}, relative difference {energy.value / exact - 1:.1e}")
assert abs(energy.value / exact - 1) < 1e-6

path = energy.path
along = np.abs(path.p[:, 1] - 4 * zeta * path.q[:, 1]).max() / np.abs(path.p[:, 1]).max()
print(f"    p₂ is 4ζω_n v all along the path, to {along:.0e} of its largest value")

# ---------------------------------------------------------------------------------------------------------------------
# 2. The clear-running state and the hammering one
#
# With forcing there is no such formula. `LeastAction` looks for ways out in two independent manners, by a graph over
# the section and by shooting, and polishes each that it finds. Both are on by default, and finer than here: a graph of
# 160 × 160 nodes alone is enough for a first answer. `print` on a result shows its status, sentence by sentence.

osc = vk.load_scene("hertz-0.570")
structure = vk.find_structure(osc, cells=(100, 100), rng=0)
result = vk.LeastAction(graph=modest, plot=None).run(osc, structure)
print(result.status)
clear, hammering = result.energies
for e in result.energies:
    print(f"from {e.source} to {e.target}: ΔU = {e.value:.8g}, between {e.lower:.8g} and {e.upper:.8g}")

# ---------------------------------------------------------------------------------------------------------------------
# 3. Why believe it?
#
# A polished path solves Hamilton's equations from the attractor to the saddle, and the certificate says how well. The
# residual is the largest misfit anywhere. The three changes say how the action moves if the path is started ten times
# farther from the attractor, made two periods longer at either end, and integrated more tightly.

proof = clear.certificate
print(f"residual {proof.residual:.0e}; path of {proof.periods:.0f} periods")
print(f"    from {proof.start_distance:.0e} off the attractor to {proof.end_distance:.0e} off the saddle")
print(f"    changes by {proof.by_start:.0e}, {proof.by_length:.0e}, {proof.by_stepper:.0e}")

# That proves that the path is an extremal, and its action right to ten digits. It does not prove that no other path is
# cheaper. For this there is the graph, which depends on no shot: its value, with an error from coarser grids and longer
# steps, is in the status, and the two agree within that error. `vk.ActionGraph()`, the default, has four times as many
# nodes, and its error is several times smaller.

# The path ends on the saddle, and without a momentum: once it is there, chance decides, and noise has nothing to add.

(saddle,) = structure.saddles
arrival = np.linalg.norm(clear.path.q[-1] - saddle.points[0])
left_over = np.abs(clear.path.p[-1, 1]) / np.abs(clear.path.p[:, 1]).max()
print(f"the path ends {arrival:.0e} from the saddle, with {left_over:.0e} of its largest momentum")

# ---------------------------------------------------------------------------------------------------------------------
# 4. Shooting, and how it misses
#
# `ActionPlot` starts many extremals near the attractor, and asks each what it has paid when it leaves. By default its
# starts cover all of the two-dimensional manifold on which extremals leave. The published method, the ring, has points
# on one small circle at one instant of the period. That meets the manifold in a curve, which most paths, the cheapest
# among them, do not cross: more points on the circle do not help.

shots = vk.ActionPlot(source=0, points=3000).run(osc, structure)
ring = vk.ActionPlot(source=0, points=20_000, radius=1e-6).run(osc, structure)
for name, found in (("whole domain", shots), ("ring", ring)):
    value = found.energies[0].value
    print(f"{name}: {value:.4g}, {100 * (value / clear.value - 1):.2f} % dearer than the certified path")

# ---------------------------------------------------------------------------------------------------------------------
# 5. A touch
#
# Does a stop have to be touched at once when the state is left? `FirstContact` asks what the first touch costs. Until
# then the clear-running motion is that of a linear oscillator, so there is a formula again: 2ζω_n³ times the square of
# the gap that it leaves.

few = vk.ActionPlot(points=500, rounds=4)
touch = vk.LeastAction(plot=few, graph=None, source=0, exit=vk.FirstContact("right")).run(osc, structure).energies[0]

numbers = osc.parameters
frequency, damping = numbers["excitations.0.frequency"], 2 * numbers["damping_ratio"] * numbers["natural_frequency"]
swing = numbers["excitations.0.amplitude"] / abs(1 - frequency**2 + 1j * damping * frequency)
gap = 0.5 - numbers["excitations.1.force"] - swing
by_formula = damping * gap**2
print(f"to touch the right stop: {touch.value:.8g}, by the formula {by_formula:.8g}")
print(f"    that is {touch.value / clear.value:.2f} of what leaving costs: most touches lead back")

# ---------------------------------------------------------------------------------------------------------------------
# 6. The long run
#
# Energies from every state to every other say which is the most stable, which is left first, and by what exponents the
# shares of time differ. They are exponents only: of the factors before them nothing is known here, except that they do
# not grow or fall exponentially as the noise gets weaker.

print(result.transitions)
intensity = osc.noise.intensity
for e in result.energies:
    print(f"at D = {intensity:g}, leaving {e.source} takes some factor times exp({e.value / intensity:.1f})")
print(result.transitions.stationary_weights(intensity))


# ---------------------------------------------------------------------------------------------------------------------
# 7. Pictures
#
# The action at the exit against the angle of the start, from which the action plot has its name: a line of least
# values, between jumps where neighbouring starts leave after different numbers of turns. The exit paths on the section,
# one point a period: spirals that end on the saddle. The momentum p₂, which is the push that noise has to give, and
# the action along both: the pushes grow, keep in step with the motion, and fall to nothing at the saddle. Last the
# quasi-potential, the least action from the clear-running state to each point: a smooth bowl below, and folded above,
# where paths of different histories come to one place.

PICTURES = {
    "04-action-plot.png": shots.plot,
    "04-exit-paths.png": result.plot,
    "04-histories.png": result.plot_history,
    "04-quasi-potential.png": lambda: result.plot_quasi_potential(0),
}


def save_pictures(folder):
    """Save the pictures in a folder and print where they are."""
    folder.mkdir(exist_ok=True)
    for name, draw in PICTURES.items():
        draw()[0].get_figure().savefig(folder / name, dpi=150)
        print("picture:", folder / name)


if __name__ == "__main__":
    save_pictures(Path.cwd() / "tutorial-pictures")

"""How the action plot's energies of hertz-0.570 change with points, steps, and the basin grid.

Run by hand: ``python tests/benchmarks/ring_convergence.py [points]``. Prints, for the published ring, each value with
one setting doubled beside the paper's number for the same method; then the same for the whole fundamental domain.
"""

import sys
import time

import vibrokit as vk

PUBLISHED = {"clear-running": 0.000082, "hammering": 0.00107}  # action plot, section 3.2 of the paper


def energies(osc, structure, radius, points, stepper):
    result = vk.ActionPlot(radius=radius, points=points, stepper=stepper).run(osc, structure)
    return {energy.source: energy for energy in result.energies}


def table(osc, radius, points):
    print(f"{'points':>8} {'steps':>6} {'cells':>6}   {'clear-running':>14} {'hammering':>12} {'seconds':>8}")
    settings = [(points, 256, 200), (2 * points, 256, 200), (points, 512, 200), (points, 256, 400)]
    for count, steps, cells in settings:
        structure = vk.find_structure(osc, cells=(cells, cells), saddles=False, manifolds=False, stepper=vk.RK4(steps))
        began = time.perf_counter()
        found = energies(osc, structure, radius, count, vk.RK4(steps))
        values = [f"{found[label].value:.6g}" if label in found else "no exit" for label in (0, 1)]
        seconds = time.perf_counter() - began
        print(f"{count:>8} {steps:>6} {cells:>6}   {values[0]:>14} {values[1]:>12} {seconds:>8.1f}", flush=True)


def main(points: int) -> None:
    osc = vk.load_scene("hertz-0.570")
    print("ring of radius 1e-6")
    table(osc, 1e-6, points)
    print(f"{'published':>22}   {PUBLISHED['clear-running']:>14g} {PUBLISHED['hammering']:>12g}")
    print("whole fundamental domain, points of the first grid")
    table(osc, None, vk.ActionPlot().points)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)

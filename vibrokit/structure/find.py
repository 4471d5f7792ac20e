"""find_structure: attractors, basins, saddles and manifolds of the motion without noise (see `finder`)."""

from __future__ import annotations

import concurrent.futures
from typing import Any

import numpy as np

from vibrokit.construction import called
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.progress import Progress, put_off, working
from vibrokit.results.structure import Structure
from vibrokit.structure.finder import Finder
from vibrokit.structure.validation import Request, check_means, seed_of, stepper_of


@called
def find_structure(
    osc: Oscillator,
    *,
    region: Any = None,
    cells: tuple[int, int] | None = None,
    refine: int = 0,
    margin: int | None = 2,
    starts: tuple[int, int] = (24, 24),
    settling: float = 1e-3,
    budget: int | None = None,
    edge_budget: int | None = None,
    saddles: bool = True,
    manifolds: bool = True,
    stepper: Stepper | str | None = None,
    rng: int | np.random.Generator = 0,
    executor: concurrent.futures.Executor | None = None,
    progress: Progress = None,
    time_limit: float | None = None,
) -> Structure:
    """Find the steady states of the noise-free system, their basins, the saddles between them and their manifolds.

    Starts on a grid are followed until they recur; each orbit is refined by Newton's method on the variational
    equations. What is known in closed form is refined too: equilibria, linear responses, and harmonic balances. Motion
    that does not recur is followed at two accuracies of integration, until the survivors together have gone on for
    200000 periods since the last start settled, or for 20000 periods each. It is an attractor only if it survives both;
    its largest Lyapunov exponent determines its kind. Basins are found on a grid; motion that ends outside is followed
    on, and the region is widened to what it comes to, unless it was given. Saddles are found by tracking the basins'
    boundaries, manifolds from the saddles.

    On Ctrl-C, or when the time limit is reached, what was found so far is returned, marked incomplete. If that is
    during the search for attractors, a finding says what the starts were doing.

    Parameters
    ----------
    osc : Oscillator
    region : Region or ((x_min, x_max), (v_min, v_max)), optional
        Where to search. The default region contains the steady states and the stops with a margin around them, and the
        tops of the potential barriers around the steady states if the grid then still resolves these and the stops. If
        the force of the spring repeats along x, as that of a pendulum does, it contains one copy of each steady state.
        If some motion turns over and over, the default region is one turn wide, and x is taken modulo a turn, as in a
        given region that is no wider. Otherwise, motion that ends at a copy of an attractor elsewhere is counted
        apart.
    cells : (int, int), optional
        Cells of the basin grid in x and v. By default 200 × 200; half or a quarter of that, or less, where transients
        are so long that the next finer grid would take more than 5 · 10⁶ iterations of the section map. The number
        doubles until no attractor lies in a cell of another basin.
    refine : int
        How many times cells near a boundary are split in four; the grid then has ``cells · 2**refine`` cells.
    margin : int, optional
        Cells on every side that must agree before a coarser cell classifies the trajectories that enter it. More is
        safer and slower; None follows every trajectory to its attractor.
    starts : (int, int)
        Starts of the search in x and v.
    settling : float
        Distance, as a fraction of the region's widths in x and v, at which an attractor counts as reached. It is
        reduced to a quarter of the distance between two equilibria that are closer.
    budget : int, optional
        Largest number of periods that a trajectory is followed; by default it depends on the damping, and on the
        lifetime of chaotic transients if there are some.
    edge_budget : int, optional
        Largest number of iterations of the section map that classify states next to basin boundaries, to follow these
        to their saddles; once with the help of the basin grid, and once without where that finds none. By default 10⁷,
        or fewer where a section takes more than 500 steps: 10 to 20 s on two processors.
    saddles, manifolds : bool
        Whether to search for them. Manifolds need saddles.
    stepper : Stepper or str, optional
        For everything, or its text, such as ``"rk4:512"``; by default fixed steps for many trajectories and located
        contacts for orbits.
    rng : int or numpy.random.Generator
        Shifts the grid of starts off the symmetries of the scene by a random fraction of a cell.
    executor : concurrent.futures.Executor, optional
    progress : bool or callable, optional
        True shows progress on standard error; a function is called with each `vibrokit.progress.Update`.
    time_limit : float, optional
        In seconds.

    Returns
    -------
    Structure
        Its `settings` are these arguments: ``find_structure(osc, **structure.settings)`` repeats the call.

    Raises
    ------
    StructureError
        The scene has no damping, or no attractor in the region.
    NoSectionError
        The excitations have no common period.
    """
    chosen = stepper_of(stepper)
    check_means(osc, chosen, executor)
    request = Request(
        region, cells, refine, margin, starts, settling, budget, edge_budget, saddles, manifolds, chosen, seed_of(rng)
    )  # fmt: skip
    return structure_of(osc, request, executor, progress=progress, time_limit=time_limit)


def structure_of(
    osc: Oscillator,
    request: Request,
    executor: concurrent.futures.Executor | None = None,
    *,
    basins: bool = True,
    progress: Progress = None,
    time_limit: float | None = None,
) -> Structure:
    """Return what a request asks for; without basins, the attractors only, and no cell is followed."""
    with working(progress, time_limit) as work:
        with put_off():
            finder = Finder(osc, request, executor)
        finder.run(basins=basins)
        with put_off():
            return finder.structure(work)

"""What was found, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import LEFT, NOT_FOLLOWED, UNSETTLED, Basins
from vibrokit.results.region import Region
from vibrokit.results.saddle import Saddle
from vibrokit.structure.search import Search

_FATES = {UNSETTLED: "did not settle in the time given", LEFT: "left the region", NOT_FOLLOWED: "were not followed"}


def status_of(search: Search, count: int, basins: Basins, missing: str, words: list[str]) -> str:
    """Return what was found and what was not, as sentences.

    Parameters
    ----------
    search : Search
    count : int
        Attractors.
    basins : Basins
    missing : str
        What the work was stopped in; empty if it came to its end.
    words : list of str
        Sentences of the later stages.
    """
    found = [f"The work was stopped before its end; of {missing} some are missing."] if missing else []
    found.append(f"{count} steady state{'s' if count != 1 else ''} found from {search.starts} starts.")
    if search.lost:
        found.append(f"{search.lost} starts ran out of range.")
    found += [*search.words, *(f"{report}." for report in search.survival)]
    found += fates_of(basins)
    return " ".join([*found, *(word for word in words if word)])


def fates_of(basins: Basins) -> list[str]:
    """Return what became of the cells that lead to no attractor, as sentences."""
    shares = [(basins.fraction(label), fate) for label, fate in _FATES.items()]
    return [f"{_percent(share)}% of the cells {fate}." for share, fate in shares if share]


def _percent(share: float) -> str:
    return f"{100 * share:.0f}" if share > 0.0995 else f"{100 * share:.2g}"


def nothing_found(search: Search, region: Region, budget: int, hasty: bool, longest: int) -> str:
    """Return why there is nothing to return, and what to change; `hasty`: the budget is less than the damping asks."""
    advice = "raise budget" if hasty else "widen the region or raise budget"
    if search.lost > search.starts / 2:
        advice = "narrow the region, or look at the signs of the forces, for most motions grow without bound"
    return (
        f"no steady state was found from {search.starts} starts in x ∈ {region.x}, v ∈ {region.v}: none came to an "
        f"orbit of period up to {longest} within {budget} periods, or to a set that lasts, and {search.lost} ran out "
        f"of range; {advice}."
    )


def none_inside(region: Region, attractors: Sequence[Attractor]) -> str:
    """Return that steady states were found, but none where they were looked for."""
    places = ", ".join(f"({a.points[0, 0]:.6g}, {a.points[0, 1]:.6g})" for a in attractors)
    return (
        f"no steady state lies in x ∈ {region.x}, v ∈ {region.v}; those that starts from there come to are at "
        f"{places}. Give a region that holds one, or none."
    )


def lies_in(region: Region, orbit: Attractor | Saddle) -> bool:
    """Whether some of an orbit is in a region, on the section."""
    curve = isinstance(orbit, Attractor) and orbit.kind == "limit cycle"
    points = orbit.orbit if isinstance(orbit, Attractor) and curve else orbit.points[:, :2]
    bounds = region.bounds
    return bool(np.all((points >= bounds[:, 0]) & (points <= bounds[:, 1]), axis=1).any())

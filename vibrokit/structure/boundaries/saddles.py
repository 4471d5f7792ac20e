"""Saddles on the boundaries of basins: where edge tracking comes to, refined, and where their branches lead."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from vibrokit.errors import StructureError
from vibrokit.kernels.single import record
from vibrokit.kernels.stepper import Stepper
from vibrokit.oscillator import Oscillator
from vibrokit.results.attractor import Attractor
from vibrokit.results.basins import Basins
from vibrokit.results.saddle import Saddle
from vibrokit.structure.boundaries.edges import PARTS_OF_A_TURN, EdgeTrack, Straddles, meeting_cells
from vibrokit.structure.boundaries.recurrences import almost_repeats, closing, recurrence, same_place
from vibrokit.structure.boundaries.unstable import (
    branch_fates,
    describe_unstable,
    describe_unstable_cycle,
    refine_unstable,
)
from vibrokit.structure.cycles import refine_cycle
from vibrokit.structure.orbits import EQUAL
from vibrokit.structure.settle import Settler
from vibrokit.symbolic.flow_kind import Flow

_LONGEST_PERIOD = 16
_LOOKS = 4  # sections between two looks for recurrences
_FARTHEST = 1e-2  # of the region's size: where the orbit may be that a motion has come to
_NEAR = 1e-3  # of the region's size: a motion on the boundary that comes so near a saddle on it stays there
_MOST_TRIES = 4
_FEW_POINTS = 12  # last ones of a motion that must all be so near
_SAMPLES = 8192  # of a cycle
_APPROACH = 0.25  # of a motion that does not recur is its way to where it stays
_SEVERAL = 32  # sections after which a few motions go on for each pair of labels
_FEW = 6
_MOST = 128  # motions in all, where states settle within _QUICK sections; fewer where they take longer
_QUICK = 2000
_LONG, _SHORT, _SLOW = 128, 32, 5000
_LEAST_MOTIONS = 16
_BLOCKS = 6  # of a motion, for the standard error
_RESIDUAL = 1e-10

Array = NDArray[np.float64]


def find_saddles(
    osc: Oscillator,
    settler: Settler,
    basins: Basins,
    attractors: tuple[Attractor, ...],
    *,
    carrier: Stepper,
    exact: Stepper,
    rng: np.random.Generator,
    trackers: int = 9,
    sections: int | None = None,
    found: list[Saddle] | None = None,
) -> tuple[tuple[Saddle, ...], str]:
    """Find the saddles on the boundaries between basins by edge tracking.

    Parameters
    ----------
    osc : Oscillator
    settler : Settler
        Says where states lead; one to which a finished grid answers is quick. What is found with it is looked at
        again without those answers where it leaves a boundary unexplained.
    basins : Basins
    attractors : tuple of Attractor
        What the labels stand for.
    carrier : Stepper
        Carries the states on the boundaries.
    exact : Stepper
        Of the variational equations: refines what is found.
    rng : numpy.random.Generator
    trackers : int
        Most motions to follow for each pair of basins that meet.
    sections : int
        How long a motion is followed before it is taken for one that does not repeat; by default 128 sections, or 32
        where states need more than 5000 to settle, for each step on the boundary asks several of them.
    found : list of Saddle, optional
        Is given each saddle as it is found, so that they survive Ctrl-C.

    Returns
    -------
    saddles : tuple of Saddle
        Those of few periods first.
    status : str
        What was found, as sentences.
    """
    settler = dataclasses.replace(settler, stepper=carrier)
    meetings = meeting_cells(basins)
    if not meetings:
        return (), "No two basins meet on the grid, so that there is no boundary to follow."
    length = sections or (_LONG if settler.budget <= _SLOW else _SHORT)
    most = max(_LEAST_MOTIONS, min(_MOST, _MOST * _QUICK // settler.budget))
    longest = sorted(meetings, key=lambda pair: (-len(meetings[pair]), pair))[: most // 2]
    pairs = set(longest)
    search = _Search(osc, settler, attractors, exact, [] if found is None else found)
    if len(meetings) > len(pairs):
        search.words.append(
            f"{len(meetings) - len(pairs)} of {len(meetings)} boundaries, the shortest on the grid, were not followed."
        )
    for asked in (settler, dataclasses.replace(settler, core=None)):
        open_pairs = pairs - search.explained
        if open_pairs:
            each = max(2, min(trackers, most // len(open_pairs)))
            straddles = Straddles.across(asked, basins, each, rng, only=open_pairs)
            search.follow(straddles, length)
    ordered = sorted(search.found, key=lambda s: (s.kind == "chaotic", s.period, tuple(s.points[0])))
    return tuple(ordered), search.status(pairs)


class _Search:
    """Motions on the boundaries, and what they have come to."""

    def __init__(
        self,
        osc: Oscillator,
        settler: Settler,
        attractors: tuple[Attractor, ...],
        exact: Stepper,
        found: list[Saddle],
    ) -> None:
        self.osc = osc
        self.settler = settler
        self.attractors = attractors
        self.exact = exact
        self.found = found
        self.explained: set[tuple[int, int]] = set()
        self.words: list[str] = []
        self.near = _NEAR * settler.region.size
        self._places: list[Array] = []

    def follow(self, straddles: Straddles, sections: int) -> None:
        """Follow motions until each has come to a saddle, or the time is up."""
        tries = np.zeros(len(straddles.origins), dtype=np.int64)
        parts = PARTS_OF_A_TURN if self.osc.autonomous else 1
        for step in range(1, sections * parts + 1):
            if not len(straddles):
                break
            straddles.advance()
            if step % (_LOOKS * parts) == 0:
                arrived = np.array([self._arrived(straddles, n, tries) for n in range(len(straddles))], dtype=bool)
                self._explain(straddles, arrived)
                straddles.keep(~arrived)
            if step == _SEVERAL * parts:
                straddles.keep(_first_few(straddles.end_labels))
        self._describe_wandering(straddles)

    def _explain(self, straddles: Straddles, which: NDArray[np.bool_]) -> None:
        """Note that boundaries lead to what was found: between the labels there, and between those begun with."""
        both = np.concatenate([straddles.end_labels[which], straddles.origins[straddles.numbers[which]]])
        self.explained |= {(min(pair), max(pair)) for pair in both.tolist()}

    def _arrived(self, straddles: Straddles, index: int, tries: NDArray[np.int64]) -> bool:
        """Whether a motion has come to a saddle, known or new."""
        track, number = straddles.track(index), straddles.numbers[index]
        if any(same_place(track.points[-_FEW_POINTS:], places, self.near) for places in self._places):
            return True
        autonomous = self.osc.autonomous
        if tries[number] == _MOST_TRIES and not autonomous:
            return False
        period = recurrence(track.points, self.settler.region.size, 1 if autonomous else _LONGEST_PERIOD)
        try:
            if period:
                tries[number] += 1
                return self._came_to_orbit(track, period)
            return autonomous and self._came_to_cycle(track, straddles.interval)
        except StructureError:
            return False

    def _came_to_orbit(self, track: EdgeTrack, period: int) -> bool:
        here = track.points[-1]
        orbit = refine_unstable(self.osc, here, period, self.exact)
        unstable = np.abs(np.linalg.eigvals(orbit.monodromy)).max() > 1
        if not unstable or np.linalg.norm(orbit.point - here) > _FARTHEST * self.settler.region.size:
            return False
        if any(same_place(orbit.point[None], places, EQUAL * self.settler.region.size) for places in self._places):
            return True
        fates = branch_fates(self.settler, orbit)
        if len(set(fates)) < 2:
            fates = track.labels
        self._add(describe_unstable(self.osc, orbit, self.exact, fates))
        return True

    def _came_to_cycle(self, track: EdgeTrack, interval: float) -> bool:
        size = self.settler.region.size
        guess = closing(track.points, size, interval)
        if guess is None:
            return False
        cycle = refine_cycle(self.osc, guess[0], guess[1], self.exact)
        if np.linalg.norm(cycle.point - guess[0]) > _FARTHEST * size:
            return False
        if any(same_place(cycle.point[None], places, self.near) for places in self._places):
            return True
        self._add(describe_unstable_cycle(self.osc, cycle, self.exact, track.labels))
        spacing = cycle.duration / _SAMPLES
        self._places[-1] = record(self.osc, Flow.STATE, self.exact, cycle.point, 0.0, spacing, _SAMPLES)
        return True

    def _add(self, saddle: Saddle) -> None:
        self.found.append(saddle)
        self._places.append(saddle.points)

    def _describe_wandering(self, straddles: Straddles) -> None:
        """Describe the motions that came to no orbit in the time given, those of each pair of labels together."""
        self._explain(straddles, np.ones(len(straddles), dtype=bool))
        tracks: dict[tuple[int, int], list[EdgeTrack]] = {}
        for track in straddles.tracks():
            tracks.setdefault(track.labels, []).append(track)
        for labels, motions in tracks.items():
            between = self.between(labels)
            wandering = [motion for motion in motions if not self._repeats(motion.points)]
            if len(wandering) < len(motions):
                self.words.append(
                    f"{len(motions) - len(wandering)} motions on the boundary between {between} almost repeat, but "
                    "Newton's method came to no orbit there."
                )
            if wandering and not self.osc.autonomous:
                value, error = _growth(wandering, straddles.interval)
                self.found.append(_chaotic(wandering, value))
                self.words.append(
                    f"Motion on the boundary between {between} does not repeat: the edge state is chaotic, its largest "
                    f"Lyapunov exponent {value:.3g} ± {error:.1g} s⁻¹ (from {len(wandering)} motions)."
                )
            elif wandering:
                self.words.append(f"What attracts on the boundary between {between} was not come to in the time given.")

    def _repeats(self, points: Array) -> bool:
        return almost_repeats(points, _FEW_POINTS, _LONGEST_PERIOD, self.near)

    def between(self, labels: tuple[int, int]) -> str:
        """Name two basins."""
        return " and ".join(
            "what leaves" if label < 0 else f"the basin of {label} ({self.attractors[label].kind})" for label in labels
        )

    def status(self, pairs: set[tuple[int, int]]) -> str:
        """Say what was found, and what was not."""
        orbits = [saddle for saddle in self.found if saddle.kind != "chaotic"]
        count = len(orbits)
        words = [f"{count} unstable orbit{'s' if count != 1 else ''} found on the boundaries between basins."]
        words += self.words
        words += [
            f"No orbit was found on the boundary between {self.between(pair)}: it was lost on the way."
            for pair in sorted(pairs - self.explained)
        ]
        rough = max([saddle.residual for saddle in orbits], default=0.0)
        if rough > _RESIDUAL:
            words.append(f"The largest residual is {rough:.1e}, above {_RESIDUAL:g}; a finer stepper may lower it.")
        return " ".join(words)


def _chaotic(tracks: list[EdgeTrack], exponent: float) -> Saddle:
    """The record of a set that motions on a boundary wander on."""
    return Saddle(
        kind="chaotic",
        period=0,
        duration=np.nan,
        points=np.concatenate([track.points[_way(track) :] for track in tracks]),
        multipliers=np.empty(0, dtype=complex),
        exponents=np.array([exponent], dtype=complex),
        leads_to=tracks[0].labels,
        residual=np.nan,
        error=np.nan,
    )


def _first_few(labels: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Keep a few motions for each pair of labels."""
    seen: dict[tuple[int, ...], int] = {}
    kept = np.zeros(len(labels), dtype=bool)
    for index, pair in enumerate(np.sort(labels, axis=1)):
        name = tuple(int(label) for label in pair)
        seen[name] = seen.get(name, 0) + 1
        kept[index] = seen[name] <= _FEW
    return kept


def _way(track: EdgeTrack) -> int:
    return int(_APPROACH * len(track.points))


def _growth(tracks: list[EdgeTrack], interval: float) -> tuple[float, float]:
    """Mean rate at which neighbours on two sides of a boundary part, and its standard error from blocks of sections."""
    blocks = np.concatenate(
        [[block.mean() for block in np.array_split(track.stretches[_way(track) :], _BLOCKS)] for track in tracks]
    )
    return float(blocks.mean()) / interval, float(blocks.std(ddof=1)) / len(blocks) ** 0.5 / interval

"""Excursions from an attractor's core: where they begin, how often, and how far they lead."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.mfet.importance import Importance
from vibrokit.analyzers.mfet.walk import Walk, Walkers
from vibrokit.kernels.stopping import COMPLETED, REACHED
from vibrokit.kernels.streams import streams_of
from vibrokit.results.basins import NOT_FOLLOWED

NOT_OUT = NOT_FOLLOWED
"""In place of a target: the excursion returned."""

_MORE = 8  # times as many beginnings as are followed are wanted
_PATIENCE = 20  # times as long as it takes if half of all sections are in the core
_AT_ONCE = 8.0  # relaxations between two looks at the excursions
_MOST_VISITS = 64  # the same in states that are looked at
_LONGEST = 10_000.0  # relaxations after which an excursion that neither left nor returned is given up

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


def beginnings(walk: Walk, replicas: int, each: int, wanted: int, *key: int) -> tuple[list[Array], Array]:
    """Return states of the quasi-stationary density in the attractor's core, and ln of the core's probability.

    Every replica has walkers of its own, so that it is independent of the others.

    Parameters
    ----------
    walk : Walk
    replicas : int
    each : int
        Walkers of a replica.
    wanted : int
        States for each replica, drawn from several times as many.
    key : int
        Chooses the random streams.

    Returns
    -------
    states : list of array (wanted, n)
        Empty for a replica that was never seen in the core.
    log_shares : array (replicas,)
    """
    walkers = walk.settled(replicas * each, *key, 0)
    again, owners = walkers.states, np.arange(len(walkers)) // each
    least = math.ceil(2 * _MORE * wanted / each)
    at_once = max(1, min(least, walk.sections_at_once(len(walkers))))
    seen: list[list[Array]] = [[] for _ in range(replicas)]
    counts, total, passed = np.zeros(replicas), np.zeros(replicas), 0
    while passed < least or (counts.min() < _MORE * wanted and passed < _PATIENCE * least):
        ended = walk.advance(walkers, at_once, visits=at_once)
        good = ended.status == COMPLETED
        at_home = walk.at_home(ended.visits) & good[:, None]
        for replica in range(replicas):
            mine = owners == replica
            seen[replica].append(ended.visits[mine][at_home[mine]])
        counts += np.bincount(owners, at_home.sum(axis=1), replicas)
        total += np.bincount(owners, good * float(at_once), replicas)
        passed += at_once
        # A walker that has left, which is rare here, begins again where it was settled.
        walkers = Walkers(np.where(good[:, None], ended.states, again), ended.streams)
    rng = np.random.default_rng(walk.key(*key, 1))
    chosen = []
    for parts in seen:
        pool = np.concatenate(parts)
        chosen.append(pool[rng.choice(len(pool), wanted, replace=len(pool) < wanted)] if len(pool) else pool)
    with np.errstate(divide="ignore"):
        return chosen, np.log(counts / np.maximum(total, 1.0))


class Excursions:
    """Excursions that are followed until they leave or return, and the states at which each came farther than before.

    An excursion begins in the core, on the section, and returns when it is there again on a later section. Its states
    are looked at several times in a relaxation: otherwise strong damping would let it come far between two looks.

    Parameters
    ----------
    walk : Walk
    importance : Importance
    states : array (count, n)
        Where they begin.
    key : int
        Chooses the random streams.

    Attributes
    ----------
    scores : array (count,)
        The largest score of each; infinite for one that has left.
    targets : int64 array (count,)
        Where it led: `NOT_OUT`, a label, or the negative one of an exit that is no attractor.
    """

    def __init__(self, walk: Walk, importance: Importance, states: Array, *key: int) -> None:
        self._walk, self._importance = walk, importance
        self._seed, self._used = walk.key(*key), 0
        self._looks = walk.looks(importance.depth)  # in a section interval
        self._pieces = max(self._looks, walk.checks)
        self._states, self._streams = states.copy(), self._fresh(len(states))
        self._phases = np.zeros(len(states), dtype=np.int64)  # looks since a section
        self.scores = np.full(len(states), -np.inf)
        one = np.ones(len(states), dtype=np.int64)
        importance.records(walk.problem.on_turn(states[:, None]), one, -one, self._looks, self.scores)
        self.targets = np.full(len(states), NOT_OUT, dtype=np.int64)
        begun = zip(self.scores.tolist(), states, strict=True)
        self._records: list[list[tuple[float, Array, int]]] = [[(score, state, 0)] for score, state in begun]

    def follow(self, which: Whole) -> None:
        """Follow some of them to their ends."""
        walk, looks, each = self._walk, self._looks, self._pieces // self._looks
        limit = math.ceil(_LONGEST * walk.relaxation * looks)
        at_once = max(looks, min(_MOST_VISITS, math.ceil(_AT_ONCE * walk.relaxation * looks)))
        passed = 0
        while len(which) and passed < limit:
            which = which[np.argsort(self._phases[which], kind="stable")]  # so that lanes are filled sooner
            phases = self._phases[which]
            begun = Walkers(self._states[which], self._streams[which])
            ended = walk.pieced(begun, at_once * each, self._pieces, phases * each, at_once, each)
            self._states[which], self._streams[which] = ended.states, ended.streams
            highest, counts = self.scores[which], ended.intervals // each
            visits = walk.problem.on_turn(ended.visits)
            scores = self._importance.records(visits, counts, phases, looks, highest)
            self.scores[which] = highest
            rows, places = np.nonzero(np.isfinite(scores))
            at = (phases[rows] + 1 + places) % looks
            found = zip(scores[rows, places].tolist(), ended.visits[rows, places], at.tolist(), strict=True)
            for row, record in zip(which[rows].tolist(), found, strict=True):
                self._records[row].append(record)
            self._phases[which] = (phases + at_once) % looks
            over = ended.status != COMPLETED
            out = over & ~((ended.status == REACHED) & (ended.label == walk.problem.source))
            self.scores[which[out]], self.targets[which[out]] = np.inf, ended.label[out]
            which = which[~over]
            passed += at_once

    def replace(self, which: Whole, parents: Whole, level: float) -> None:
        """Let some begin anew, each where a parent first came above a level, with random streams of their own."""
        self._streams[which] = self._fresh(len(which))
        for place, parent in zip(which.tolist(), parents.tolist(), strict=True):
            above = next((record for record in self._records[parent] if record[0] > level), None)
            if above is None:  # the parent left in one step from below the level
                self.scores[place], self.targets[place] = np.inf, self.targets[parent]
                self._records[place] = []
            else:
                self.targets[place], self._records[place] = NOT_OUT, [above]
                self.scores[place], self._states[place], self._phases[place] = above

    def _fresh(self, count: int) -> NDArray[np.uint64]:
        """Random streams that were not used before."""
        self._used += count
        return streams_of(self._seed, np.arange(self._used - count, self._used))

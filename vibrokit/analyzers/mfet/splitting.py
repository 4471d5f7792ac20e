"""Adaptive multilevel splitting: rates of exits for which direct simulation would take too long.

The rate is that of excursions from the attractor's core, which direct simulation gives, times the probability that an
excursion leaves before it returns. For that probability many excursions are followed; again and again the ones that
came least far are replaced by copies of others from where those came farther (Cérou & Guyader, Stoch. Anal. Appl. 25,
417, 2007). The estimate is unbiased for any importance function (Bréhier, Gazeau, Goudenège, Lelièvre & Rousset, Ann.
Appl. Probab. 26, 3559, 2016).
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from vibrokit.analyzers.checkpoint import Slot
from vibrokit.analyzers.mfet.importance import Importance
from vibrokit.analyzers.mfet.walk import Walk, Walkers
from vibrokit.kernels.stopping import COMPLETED, REACHED
from vibrokit.kernels.streams import streams_of
from vibrokit.progress import report, stage
from vibrokit.results.basins import NOT_FOLLOWED

_REPLICAS = 16  # independent estimates in a batch, which share the calls of the kernel
_WALKERS = 128  # excursions of one estimate; seen: ln of estimates spreads by 0.6 at the depth 25, by 1 or less at 50
_LEVELS = 1000  # at most; a quarter is replaced at each: down to e⁻²⁸⁸
NOT_OUT = NOT_FOLLOWED
"""In place of a target: the excursion returned."""

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class Estimates:
    """Independent estimates of the probability that a section interval begins an excursion that leaves."""

    log_values: Array  # (count,): ln of each; −∞ if no excursion of a replica left
    targets: Whole  # (count, walkers): where the excursions of the last level led

    @property
    def log_mean(self) -> float:
        """ln of their mean."""
        return float(np.logaddexp.reduce(self.log_values) - math.log(len(self.log_values)))

    @property
    def error(self) -> float:
        """Standard error of the mean relative to it; infinite if it is not known."""
        if len(self.log_values) < 2 or not math.isfinite(self.log_mean):
            return math.inf
        ratios = np.exp(self.log_values - self.log_mean)
        return float(ratios.std(ddof=1) / math.sqrt(len(ratios)))

    def shares(self) -> dict[int, tuple[float, float]]:
        """Return the share of each target, and its standard error; empty if no excursion left."""
        if not math.isfinite(self.log_mean):
            return {}
        weights = np.exp(self.log_values - self.log_values.max())
        found = {}
        for target in np.unique(self.targets[self.targets != NOT_OUT]).tolist():
            parts = (self.targets == target).sum(axis=1) / np.maximum((self.targets != NOT_OUT).sum(axis=1), 1)
            share = float((weights * parts).sum() / weights.sum())
            spread = float(np.sqrt((weights**2 * (parts - share) ** 2).sum()) / weights.sum())
            found[target] = share, spread
        return found


class SplittingRun:
    """Batches of replicas, `most` at most, until the relative standard error is as wanted; a slot keeps the batches."""

    def __init__(self, walk: Walk, importance: Importance, wanted: float, most: int, slot: Slot) -> None:
        self.walk, self.importance, self.wanted, self.slot = walk, importance, wanted, slot
        self._most = max(1, most // _REPLICAS)
        known = slot.read(["log_values", "targets"])
        if known is None:
            known = {"log_values": np.empty(0), "targets": np.empty((0, _WALKERS), dtype=np.int64)}
        self.estimates = Estimates(**known)

    @property
    def batches(self) -> int:
        """Batches that are finished."""
        return len(self.estimates.log_values) // _REPLICAS

    def run(self) -> None:
        """Go on until it is done."""
        with stage("splitting", unit="replicas"):
            while self.batches < self._expected():
                report(self.batches * _REPLICAS, self._expected() * _REPLICAS)
                more, known = self._batch(self.batches), self.estimates
                self.estimates = Estimates(
                    np.concatenate([known.log_values, more.log_values]), np.concatenate([known.targets, more.targets])
                )
                self.slot.write(vars(self.estimates))
            report(self.batches * _REPLICAS, self.batches * _REPLICAS)

    def _expected(self) -> int:
        """Batches that are needed in all, by the error so far."""
        if self.batches < 2:
            return min(2, self._most)
        error = self.estimates.error
        needed = math.ceil(self.batches * (error / self.wanted) ** 2) if math.isfinite(error) else 2 * self.batches
        return min(self._most, max(self.batches, needed))

    def _batch(self, number: int) -> Estimates:
        """Estimates of one batch of replicas: a quarter of the excursions of each is replaced, again and again.

        The variance is 1.16 times that of replacing them one by one.
        """
        begun, log_values = beginnings(self.walk, _REPLICAS, _WALKERS, 1, number)
        going = np.flatnonzero(np.isfinite(log_values))
        replicas = np.full((_REPLICAS, _WALKERS), -1)
        replicas[going] = np.arange(len(going) * _WALKERS).reshape(-1, _WALKERS)
        targets = np.full((_REPLICAS, _WALKERS), NOT_OUT, dtype=np.int64)
        if not len(going):
            return Estimates(log_values, targets)
        excursions = Excursions(self.walk, self.importance, np.concatenate([begun[k] for k in going]), 2, number)
        rng = np.random.default_rng(self.walk.key(3, number))
        excursions.follow(replicas[going].ravel())
        for _ in range(_LEVELS):
            replaced = {k: excursions.raised(replicas[k], rng) for k in going.tolist()}
            going = np.array([k for k, some in replaced.items() if len(some)])
            if not len(going):
                break
            log_values[going] += [math.log1p(-len(replaced[k]) / _WALKERS) for k in going.tolist()]
            fresh = np.concatenate(list(replaced.values()))
            excursions.follow(fresh[np.isfinite(excursions.scores[fresh])])
        known = replicas[:, 0] >= 0
        targets[known] = excursions.targets[replicas[known]]
        with np.errstate(divide="ignore"):
            log_values += np.log((targets != NOT_OUT).mean(axis=1))
        return Estimates(log_values, targets)


def beginnings(walk: Walk, replicas: int, wanted: int, *key: int) -> tuple[list[Array], Array]:
    """Return states of the quasi-stationary density in the attractor's core, and ln of the core's probability.

    Every replica has 16 walkers of its own, so that it is independent of the others. Its states are drawn from eight
    times as many, if so many are seen within 20 times the time that it takes where half of all sections are in the
    core. A replica that is never seen there has no states.
    """
    each, pool_size = 16, 8 * wanted
    walkers = walk.settled(replicas * each, *key, 0)
    again, owners = walkers.states, np.arange(len(walkers)) // each
    least = math.ceil(2 * pool_size / each)
    at_once = max(1, min(least, walk.sections_at_once(len(walkers))))
    seen: list[list[Array]] = [[] for _ in range(replicas)]
    counts, total, passed = np.zeros(replicas), np.zeros(replicas), 0
    while passed < least or (counts.min() < pool_size and passed < 20 * least):
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
    `scores` are the largest score of each, infinite for one that has left, and `targets` where it led: `NOT_OUT`, a
    label, or the negative one of an exit that is no attractor.
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
        """Follow some of them to their ends, eight relaxations or 64 states at once, for 10 000 relaxations at most."""
        walk, looks, each = self._walk, self._looks, self._pieces // self._looks
        limit = math.ceil(10_000.0 * walk.relaxation * looks)
        at_once = max(looks, min(64, math.ceil(8.0 * walk.relaxation * looks)))
        stop = dataclasses.replace(walk.stop_or_return, every=self._pieces)
        interval = walk.scene.section_interval / self._pieces
        passed = 0
        while len(which) and passed < limit:
            which = which[np.argsort(self._phases[which], kind="stable")]  # so that lanes are filled sooner
            phases = self._phases[which]
            begun = Walkers(self._states[which], self._streams[which])
            kept = {"phases": phases * each, "visits": at_once, "keep": each}
            ended = walk.moved(begun, at_once * each, stop, interval, **kept)
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

    def raised(self, which: Whole, rng: np.random.Generator) -> Whole:
        """Replace the quarter of some that came least far; return those, none if all have left or came equally far."""
        scores = self.scores[which]
        level = float(np.sort(scores)[len(which) // 4 - 1])
        lost = scores <= level
        if level == np.inf or lost.all():
            return which[:0]
        self._replace(which[lost], rng.choice(which[~lost], int(lost.sum())), level)
        return which[lost]

    def _replace(self, which: Whole, parents: Whole, level: float) -> None:
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

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
from vibrokit.analyzers.mfet.excursions import NOT_OUT, Excursions, beginnings
from vibrokit.analyzers.mfet.importance import Importance
from vibrokit.analyzers.mfet.walk import Walk
from vibrokit.progress import report, stage

_REPLICAS = 16  # independent estimates in a batch, which share the calls of the kernel
_WALKERS = 128  # excursions of one estimate; seen: ln of estimates spreads by 0.6 at the depth 25, by 1 or less at 50
_EACH = 16  # walkers of a replica that show where excursions begin
_REPLACED = 0.25  # of the excursions at once; the variance is 1.16 times that of replacing them one by one
_FEWEST = 2  # batches
_LEVELS = 1000  # at most; a quarter is replaced at each: down to e⁻²⁸⁸

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class Estimates:
    """Independent estimates of the probability that a section interval begins an excursion that leaves.

    Attributes
    ----------
    log_values : array (count,)
        ln of each; −∞ if no excursion of a replica left.
    targets : int64 array (count, walkers)
        Where the excursions of the last level led.
    """

    log_values: Array
    targets: Whole

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
    """Batches of replicas, until the estimate is as exact as wanted.

    Parameters
    ----------
    walk : Walk
    importance : Importance
    wanted : float
        Relative standard error.
    most : int
        Replicas, at most.
    slot : Slot
        Where finished batches are kept.
    """

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
        if self.batches < _FEWEST:
            return min(_FEWEST, self._most)
        error = self.estimates.error
        needed = math.ceil(self.batches * (error / self.wanted) ** 2) if math.isfinite(error) else 2 * self.batches
        return min(self._most, max(self.batches, needed))

    def _batch(self, number: int) -> Estimates:
        """Estimates of one batch of replicas."""
        begun, log_values = beginnings(self.walk, _REPLICAS, _EACH, _WALKERS, 1, number)
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
            replaced, higher = list[Whole](), list[int]()
            for k in going.tolist():
                own = excursions.scores[replicas[k]]
                level = float(np.sort(own)[int(_REPLACED * _WALKERS) - 1])
                lost = own <= level
                if level == np.inf or lost.all():
                    continue
                log_values[k] += math.log1p(-lost.mean())
                parents = rng.choice(replicas[k][~lost], int(lost.sum()))
                excursions.replace(replicas[k][lost], parents, level)
                replaced.append(replicas[k][lost])
                higher.append(k)
            if not replaced:
                break
            going = np.array(higher)
            fresh = np.concatenate(replaced)
            excursions.follow(fresh[np.isfinite(excursions.scores[fresh])])
        known = replicas[:, 0] >= 0
        targets[known] = excursions.targets[replicas[known]]
        with np.errstate(divide="ignore"):
            log_values += np.log((targets != NOT_OUT).mean(axis=1))
        return Estimates(log_values, targets)

"""Occupancies: the share of time spent at each metastable state in the long run, from rates between attractors."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.special import expit, logsumexp

from vibrokit.comparison.markov_chain import log_loss, log_stationary
from vibrokit.construction import called
from vibrokit.errors import StructureError, shown
from vibrokit.results.rated import HELD, METASTABLE, RatedResult
from vibrokit.text_table import power_text, text_table

_FARTHEST = 1e4  # of ln of rates and of odds, in place of infinity: so far beyond those that are known

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@called
def occupancies(result: RatedResult) -> xarray.DataArray:
    """Return the stationary probability of each metastable state, over (intensity, attractor), from rates alone.

    The rates W between the attractors balance: for two attractors W_12 P_1 = W_21 P_2, where W_12 is the rate from 1
    to 2. An attractor is no state of its own if less than half of its core, one standard deviation of the motion that
    noise makes around it, lies in its basin, or if it is left within ten of its relaxation times on average. Those that
    exchange within that time are one state. What is left so soon for other states counts with these, in parts, as its
    exits or its core lead there, and its own probability is NaN.

    Motion that escapes does not come back. If all states are reached far more often than that happens, probabilities
    are conditional on not having escaped.

    Returns
    -------
    xarray.DataArray
        Its coordinate ``state`` over (intensity, attractor) names the attractor that each one counts with, itself if
        it is a state of its own; several, joined by "and", if it is divided between them. Its coordinates ``lower`` and
        ``upper`` are bounds that include the errors of all rates, rates that were not resolved, and all of the
        attractors that are divided. Its coordinate ``log_escape_time`` over intensity is ln of the mean time until
        motion escapes (s), infinite where it never does.

    Raises
    ------
    StructureError
        The result has no rates, or none of the exits of some state at some intensity; or motion escapes from some state
        before it has reached all others, in more than one of ten cases.
    """
    if not isinstance(result, RatedResult):
        raise StructureError(f"occupancies needs a result with rates, as of SGCM or MFET, got {shown(result)}.")
    if not result.rates:
        raise StructureError("the result has no rates; see its findings.")
    return shares_over(result.intensities, balances(result))


def shares_over(intensities: Sequence[float], known: Sequence[Balance]) -> xarray.DataArray:
    """Return the shares that balances give at several noise intensities, as `occupancies` returns them."""
    names = np.array(known[0].names)
    shape = len(intensities), len(names)
    values, lower, upper = (np.full(shape, np.nan) for _ in range(3))
    states = []
    for number, balance in enumerate(known):
        states.append(balance.states)
        heads = np.unique(balance.hosts)
        values[number, heads], lower[number, heads], upper[number, heads] = balance.shares
    both = ("intensity", "attractor")
    coordinates = {
        "intensity": intensities, "attractor": names,
        "state": (both, np.array(states)), "lower": (both, lower), "upper": (both, upper),
        "log_escape_time": ("intensity", [balance.log_escape_time for balance in known]),
    }  # fmt: skip
    return xarray.DataArray(values, coordinates, both, "occupancy")


def shares_text(shares: xarray.DataArray) -> str:
    """Return occupancies as a table: each share with its bounds, or the state that an attractor counts with."""
    names = shares["attractor"].values.tolist()
    rows = [["D", *names]]
    for one in shares:
        cells = zip(one.values, one["lower"].values, one["upper"].values, one["state"].values, names, strict=True)
        rows.append([f"{float(one['intensity']):g}", *(_cell(*cell) for cell in cells)])
    escapes = [power_text(time) for time in shares["log_escape_time"].values.ravel() if math.isfinite(time)]
    until = f"Shares are of the time before motion escapes, after {', '.join(escapes)} s on average."
    return "\n".join([*text_table(rows), *([until] if escapes else [])])


def _cell(share: float, lower: float, upper: float, state: str, name: str) -> str:
    return f"{share:.4g} ({lower:.3g} to {upper:.3g})" if state == name else f"counted with {state}"


@dataclasses.dataclass(frozen=True, eq=False)
class Balance:
    """The balance of rates between attractors at one intensity; those from row to column, in s⁻¹."""

    names: tuple[str, ...]
    log_rates: Array  # ln of the rates; −∞ where none is known
    lower: Array  # their bounds
    upper: Array
    relaxations: Array  # relaxation times of the attractors (s)
    core_shares: Array  # share of the core of row that lies in the basin of column; NaN where it is not known
    log_escapes: Array  # ln of the rates at which the attractors are left for good; −∞ where motion does not escape

    @cached_property
    def held(self) -> Mask:
        """Which attractors noise keeps in their basins: only between these are there rates."""
        held: Mask = ~(np.diagonal(self.core_shares) < HELD)
        return held

    @cached_property
    def log_probabilities(self) -> Array:
        """ln of the probability that the last core that was visited is that of each attractor; −∞ for one not held."""
        found = np.full(len(self.names), -np.inf)
        found[self.held] = self._balanced(self.log_rates)
        return found

    @cached_property
    def log_escape_time(self) -> float:
        """ln of the mean time until motion escapes (s), once it has forgotten its start; infinite if it never does."""
        return -float(logsumexp((self.log_probabilities + self.log_escapes)[self.held]))

    @cached_property
    def hosts(self) -> NDArray[np.int64]:
        """Label of the attractor that each one counts with, or counts with most."""
        found: NDArray[np.int64] = self._heads[self._parts.argmax(axis=1)]
        return found

    @cached_property
    def states(self) -> tuple[str, ...]:
        """The name of the state that each attractor counts with; of all that a tenth of it or more counts with."""
        named = self._parts >= np.minimum(0.1, self._parts.max(axis=1, keepdims=True))
        return tuple(" and ".join(self.names[label] for label in self._heads[each]) for each in named)

    @cached_property
    def _links(self) -> Array:
        """Where each attractor that is no state of its own leads to, by rates or by its core; 0 for all others."""
        to_others = self.held & ~np.eye(len(self.names), dtype=bool)
        by_core = np.where(to_others, np.nan_to_num(self.core_shares), 0.0)
        by_core = np.where(by_core.any(axis=1, keepdims=True), by_core, to_others)  # nothing is known of it
        return np.where(self.held[:, None], np.where(self._quick, np.exp(self.log_rates), 0.0), by_core)

    @cached_property
    def _states(self) -> Array:
        """Which attractors are one state, array (states, count): they exchange, and are left for no other one soon."""
        groups = connected_components(self._links > 0, connection="strong")[1]
        members = groups == np.unique(groups)[:, None]
        return members[~np.array([(self._links[np.ix_(each, ~each)] > 0).any() for each in members])]

    @cached_property
    def _heads(self) -> NDArray[np.int64]:
        """The likeliest attractor of each state, in the order of their labels."""
        return np.sort(np.where(self._states, np.nan_to_num(self.log_probabilities), -np.inf).argmax(axis=1))

    @cached_property
    def _parts(self) -> Array:
        """How much of each attractor counts with each state, array (count, states): by where its exits lead at last."""
        own = self._states[np.argmax(self._states[:, self._heads], axis=0)]
        passing, parts = ~own.any(axis=0), own.T.astype(float)
        leads = self._links[passing] / self._links[passing].sum(axis=1, keepdims=True)
        parts[passing] = np.linalg.solve(np.eye(passing.sum()) - leads[:, passing], leads @ parts)
        return parts

    @cached_property
    def shares(self) -> tuple[Array, Array, Array]:
        """Probabilities of the states, in the order of the labels of their hosts, and lower and upper bounds."""
        self._check_stays()
        parts = self._parts.T
        for members in parts > 0 if len(parts) > 1 else ():
            if not np.isfinite(self.log_rates[np.ix_(members, ~members)]).any():
                listed = ", ".join(self.names[label] for label in np.flatnonzero(members))
                raise StructureError(
                    f"{listed} exchange within their relaxation, and no exit from them to other states was resolved, "
                    "so that their probability is not known; raise the noise intensity, or wait for one of the others "
                    "with exit=LeaveBasin(to=…)."
                )
        exact = self._log_odds(parts, self.log_rates)
        low = self._log_odds(np.floor(parts + 1e-9), self.log_rates)
        high = self._log_odds(np.ceil(parts - 1e-9), self.log_rates)
        down, up = np.zeros(len(parts)), np.zeros(len(parts))
        for place in zip(*np.nonzero(self.lower < self.upper), strict=True):
            moved = []
            for bounds in (self.lower, self.upper):
                rates = self.log_rates.copy()
                rates[place] = bounds[place]
                moved.append(self._log_odds(parts, rates) - exact)
            down = np.hypot(down, np.minimum(np.min(moved, axis=0), 0.0))
            up = np.hypot(up, np.maximum(np.max(moved, axis=0), 0.0))
        return expit(exact), expit(low - down), expit(high + up)

    @cached_property
    def _quick(self) -> Mask:
        """Whether row is left, by any exit, before it is metastable, and column has its part in that."""
        limit = -math.log(METASTABLE) - np.log(self.relaxations)[:, None]
        left = logsumexp(self.log_rates, axis=1, keepdims=True) > limit
        quick: Mask = left & (self.log_rates > limit - math.log(len(self.names)))
        return quick

    def _balanced(self, log_rates: Array) -> Array:
        """ln of the probabilities of those that are held; of motion that has not escaped.

        Motion that escapes is put back where the other motion is: that leaves the distribution of the latter as it is.
        """
        held = np.flatnonzero(self.held)
        names, between = [self.names[label] for label in held], log_rates[np.ix_(held, held)]
        escapes, found = self.log_escapes[held, None], np.zeros(len(held)) - math.log(max(len(held), 1))
        # Each return reduces what is left of its effect by the share that escapes, a tenth.
        for _ in range(12 if np.isfinite(escapes).any() else 1):
            found = log_stationary(np.logaddexp(between, escapes + found), names)
        return found

    def _check_stays(self) -> None:
        """Raise StructureError if motion escapes from some state before it has reached all others."""
        if not np.isfinite(self.log_escapes[self.held]).any():
            return
        labels = self._heads if len(self._heads) > 1 else np.flatnonzero(self.held)
        rates = np.where(self.held, np.column_stack([self.log_rates, self.log_escapes]).T, -np.inf).T
        lost = {way: math.exp(log_loss(rates, *way)) for way in itertools.permutations(labels.tolist(), 2)}
        start, end = max(lost, key=lambda way: lost[way]) if lost else (labels[0], None)
        if end is None or lost[start, end] * METASTABLE > 1.0:
            often = "" if end is None else f", in {lost[start, end]:.0%} of the cases before it is at {self.names[end]}"
            raise StructureError(
                f"motion that leaves {self.names[start]} does not come back{often}, so that no state has a share of "
                "time in the long run; ask how long each lasts."
            )

    def _log_odds(self, parts: Array, log_rates: Array) -> Array:
        """ln of the odds of each state, given how much of each attractor counts with it, shape (states, count)."""
        known = log_rates[np.isfinite(log_rates)]
        ends = known.min(initial=0.0) - _FARTHEST, known.max(initial=0.0) + _FARTHEST
        likely = self._balanced(np.clip(log_rates, *ends))
        with np.errstate(divide="ignore"):
            inside, outside = (
                logsumexp(likely + np.log(np.clip(each[:, self.held], 0.0, 1.0)), axis=1) for each in (parts, 1 - parts)
            )
        odds: Array = np.clip(inside - outside, -_FARTHEST, _FARTHEST)
        return odds


def balances(result: RatedResult) -> list[Balance]:
    """Return the balance at each intensity; raises StructureError where a state has no exit that is known."""
    names, relaxations = result.names, result.relaxations
    if np.isnan(relaxations).any():
        raise StructureError("the result does not say how fast its attractors relax; run the analyzer again.")
    bounds = [np.where(np.eye(len(names), dtype=bool), -np.inf, ends.values) for ends in result.log_rate_bounds]
    analyzed = {rate.source for rate in result.rates}
    found = []
    for number, (intensity, known) in enumerate(zip(result.intensities, result.log_rates.values, strict=True)):
        escapes = np.full(len(names), -np.inf)
        for rate in result.rates:
            if rate.target < 0 and rate.intensity == intensity:
                escapes[rate.source] = np.logaddexp(escapes[rate.source], rate.log_value)
        shares = result.core_shares(intensity)
        one = Balance(names, known, bounds[0][number], bounds[1][number], relaxations, shares, escapes)
        missing = [name for label, name in enumerate(names) if one.held[label] and label not in analyzed]
        if missing:
            raise StructureError(
                f"the result has no rate out of {', '.join(missing)}; run the analyzer without source=, and see the "
                "result's findings."
            )
        found.append(one)
    return found

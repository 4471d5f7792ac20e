"""Occupancies: the share of time spent at each metastable state in the long run, from rates between attractors."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.special import expit, logsumexp

from vibrokit.construction import called
from vibrokit.errors import StructureError, shown
from vibrokit.results.arrays import Arrays
from vibrokit.results.exit_rate import ExitRate
from vibrokit.results.labels import exit_between
from vibrokit.results.rated import HELD, METASTABLE, RatedResult
from vibrokit.text_table import text_table

_NAMED = 0.1  # of the exits of an attractor that is divided: states that fewer lead to are not named with it
_ROUNDING = 1e-9  # of parts of an attractor
_FARTHEST = 1e4  # of ln of rates, in place of infinity: no rate of any unit is as small or as large

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

    Returns
    -------
    xarray.DataArray
        Its coordinate ``state`` over (intensity, attractor) names the attractor that each one counts with, itself if
        it is a state of its own; several, joined by "and", if it is divided between them. Its coordinates ``lower`` and
        ``upper`` are bounds that include the errors of all rates, rates that were not resolved, and all of the
        attractors that are divided.

    Raises
    ------
    StructureError
        The result has no rates, or none of the exits of some state at some intensity; or motion leaves some state for
        good: then no state has a share of time in the long run.
    """
    if not isinstance(result, RatedResult):
        raise StructureError(f"occupancies needs a result with rates, as of SGCM or MFET, got {shown(result)}.")
    if not result.rates:
        raise StructureError("the result has no rates; see its findings.")
    check_returns(result.rates, result.names)
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
    }  # fmt: skip
    return xarray.DataArray(values, coordinates, both, "occupancy")


def shares_text(shares: xarray.DataArray) -> str:
    """Return occupancies as a table: each share with its bounds, or the state that an attractor counts with."""
    names = shares["attractor"].values.tolist()
    rows = [["D", *names]]
    for one in shares:
        cells = zip(one.values, one["lower"].values, one["upper"].values, one["state"].values, names, strict=True)
        rows.append([f"{float(one['intensity']):g}", *(_cell(*cell) for cell in cells)])
    return "\n".join(text_table(rows))


def _cell(share: float, lower: float, upper: float, state: str, name: str) -> str:
    return f"{share:.4g} ({lower:.3g} to {upper:.3g})" if state == name else f"with {state}"


@dataclasses.dataclass(frozen=True, eq=False)
class Balance:
    """The balance of rates between attractors at one intensity.

    Attributes
    ----------
    names : tuple of str
    log_rates, lower, upper : array (count, count)
        ln of the rates (s⁻¹) from row to column, and their bounds; −∞ where no rate is known.
    relaxations : array (count,)
        Relaxation times of the attractors (s).
    core_shares : array (count, count)
        Share of the core of row that lies in the basin of column; NaN where it is not known.
    """

    names: tuple[str, ...]
    log_rates: Array
    lower: Array
    upper: Array
    relaxations: Array
    core_shares: Array

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
    def hosts(self) -> NDArray[np.int64]:
        """Label of the attractor that each one counts with, or counts with most."""
        found: NDArray[np.int64] = self._heads[self._parts.argmax(axis=1)]
        return found

    @cached_property
    def states(self) -> tuple[str, ...]:
        """The name of the state that each attractor counts with; of all that it is divided between."""
        named = self._parts >= np.minimum(_NAMED, self._parts.max(axis=1, keepdims=True))
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
        low = self._log_odds(np.floor(parts + _ROUNDING), self.log_rates)
        high = self._log_odds(np.ceil(parts - _ROUNDING), self.log_rates)
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
        held = np.flatnonzero(self.held)
        return log_stationary(log_rates[np.ix_(held, held)], [self.names[label] for label in held])

    def _log_odds(self, parts: Array, log_rates: Array) -> Array:
        """ln of the odds of each state, given how much of each attractor counts with it, shape (states, count)."""
        likely = self._balanced(np.clip(log_rates, -_FARTHEST, _FARTHEST))
        with np.errstate(divide="ignore"):
            inside, outside = (
                logsumexp(likely + np.log(np.clip(each[:, self.held], 0.0, 1.0)), axis=1) for each in (parts, 1 - parts)
            )
        odds: Array = np.clip(inside - outside, -_FARTHEST, _FARTHEST)
        return odds


def check_returns(rates: Iterable[ExitRate], names: Sequence[str]) -> None:
    """Raise StructureError if motion leaves some attractor for good: then nothing balances in the long run."""
    ends = sorted({(rate.source, rate.target) for rate in rates if rate.target < 0})
    if ends:
        listed = ", ".join(exit_between(names, *way) for way in ends)
        raise StructureError(
            f"motion that leaves does not come back ({listed}), so that no state has a share of time in the long run; "
            "ask how long each lasts."
        )


def balances(result: RatedResult) -> list[Balance]:
    """Return the balance at each intensity; raises StructureError where a state has no exit that is known."""
    if "relaxation_time" not in result.data:
        raise StructureError("the result does not say how fast its attractors relax; run the analyzer again.")
    names, count = result.names, len(result.names)
    data = result.data.transpose("source", "intensity_index", "core_source", "core_label", ...)
    labels, arrays = data["source"].values, Arrays(data)
    intensities = arrays.numbers("rate_intensity", (len(labels), None), finite=False)
    relaxations = arrays.numbers("relaxation_time", (len(labels), count))[0]
    shares = arrays.numbers("core_share", (*intensities.shape, count, count), finite=False)
    bounds = [np.where(np.eye(count, dtype=bool), -np.inf, ends.values) for ends in result.log_rate_bounds]
    found = []
    for number, (intensity, known) in enumerate(zip(result.intensities, result.log_rates.values, strict=True)):
        place = tuple(np.argwhere(intensities == intensity)[0])
        one = Balance(names, known, bounds[0][number], bounds[1][number], relaxations, shares[place])
        missing = [name for label, name in enumerate(names) if one.held[label] and label not in labels]
        if missing:
            raise StructureError(
                f"the result has no rate out of {', '.join(missing)}; run the analyzer without source=, and see the "
                "result's findings."
            )
        found.append(one)
    return found


def log_stationary(log_rates: Array, names: Sequence[str]) -> Array:
    """Return ln of the stationary probabilities of a Markov chain, from ln of its rates, shape (n, n).

    By elimination without subtractions (Grassmann, Taksar & Heyman, Oper. Res. 33, 1107, 1985), in logarithms: rates of
    1e-400 are as good as any. Raises StructureError if a state is never left.
    """
    rates = np.array(log_rates, dtype=float)
    np.fill_diagonal(rates, -np.inf)
    count = len(rates)
    left = np.full(count, -np.inf)
    for k in range(count - 1, 0, -1):
        left[k] = logsumexp(rates[k, :k])
        if not np.isfinite(left[k]):
            raise StructureError(f"no exit from {names[k]} was resolved, so that its probability is not known.")
        through = rates[:k, k, None] + rates[None, k, :k] - left[k]
        rates[:k, :k] = np.logaddexp(rates[:k, :k], through)
    found = np.zeros(count)
    for k in range(1, count):
        found[k] = logsumexp(found[:k] + rates[:k, k]) - left[k]
    stationary: Array = found - logsumexp(found)
    return stationary

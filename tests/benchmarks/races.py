"""Races: in every round all contestants run one after another, so that ratios compare neighbours in time."""

import time

import numpy as np


def race(contestants, rounds):
    """What each contestant returned, called with the number of each round; every second round runs backwards."""
    outcomes = {name: [] for name in contestants}
    for number in range(rounds):
        names = list(contestants)
        for name in names if number % 2 else reversed(names):
            outcomes[name].append(contestants[name](number))
    return outcomes


def timed(work, *given):
    """What some work returns, and its seconds."""
    began = time.perf_counter()
    return work(*given), time.perf_counter() - began


def quartiles(values, digits=2):
    """Text of the median, and of the quartiles beside it."""
    low, middle, high = np.percentile(values, [25, 50, 75])
    return f"{middle:9.{digits}f}{f'{low:.{digits}f}-{high:.{digits}f}':>16}"


def report(costs, reference, unit, more=None):
    """Print a row for each contestant: its costs, their ratios to those of the reference, and some text.

    `costs` has a number for each round; `more` has what stands at the ends of the rows, by name.
    """
    print(f"{'':34}{unit:>25}{'over ' + reference:>25}")
    for name, values in costs.items():
        ratios = np.divide(values, costs[reference])
        print(f"{name:34}{quartiles(values)}{quartiles(ratios)}{(more or {}).get(name, '')}", flush=True)


def table(costs, reference, more=None):
    """The same as rows of a CSV file: medians and quartiles of the costs, and of their ratios to the reference's."""
    rows = []
    for name, values in costs.items():
        row = {"contestant": name}
        for column, numbers in (("cost", values), ("ratio", np.divide(values, costs[reference]))):
            low, middle, high = np.percentile(numbers, [25, 50, 75])
            row |= {column: f"{middle:.3g}", f"{column}_25": f"{low:.3g}", f"{column}_75": f"{high:.3g}"}
        rows.append(row | (more or {}).get(name, {}))
    return rows


def fastest(costs, beginning):
    """The contestant with the lowest median, of those whose names begin so."""
    return min((name for name in costs if name.startswith(beginning)), key=lambda name: np.median(costs[name]))

"""Shares of time in each state from one result: by rates, by the density, by energies alone."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from vibrokit.comparison.occupancies import balances
from vibrokit.comparison.quantities import Kind, Quantity
from vibrokit.comparison.stationary import StationaryDensity
from vibrokit.comparison.transitions import Transitions
from vibrokit.errors import StructureError
from vibrokit.results.rated import RatedResult
from vibrokit.results.result import Result
from vibrokit.results.sgcm import SGCMResult


def state_quantities(result: Result, method: str) -> list[Quantity]:
    """Return the shares of time by the balance of rates, by the stationary density, and exponents by energies."""
    found = []
    if isinstance(result, RatedResult) and result.rates:
        found += _shares(result, method)
    if isinstance(result, SGCMResult):
        found += _density_shares(result, method)
    if any(energy.target >= 0 for energy in result.energies):
        found += _exponents(result, method)
    return found


def _shares(result: RatedResult, method: str) -> list[Quantity]:
    found = []
    try:
        known = balances(result)
    except StructureError:  # not every state was analyzed
        return []
    for intensity, balance in zip(result.intensities, known, strict=True):
        try:
            with np.errstate(invalid="ignore"):  # where no attractor is a state of its own
                shares, heads = np.array(balance.shares), np.unique(balance.hosts)
        except StructureError:  # an exit is not known at this intensity, or motion escapes
            continue
        for label, ends in zip(heads.tolist(), shares.T.tolist(), strict=True):
            if not any(map(math.isnan, ends)):
                found.append(Quantity(Kind.OCCUPANCY, label, None, method, intensity, *ends))
    return found


def _density_shares(result: SGCMResult, method: str) -> list[Quantity]:
    """Shares at each intensity at which all states have densities and exits."""
    found = []
    for number in range(result.data.sizes.get("intensity_index", 0)):
        one = dataclasses.replace(result, data=result.data.isel(intensity_index=[number]))
        if len(one.intensities) == 1:
            found += _density_shares_at(one, method)
    return found


def _density_shares_at(result: SGCMResult, method: str) -> list[Quantity]:
    try:
        density = StationaryDensity.of(result)
    except StructureError:
        return []
    section, found = result.section, []
    places = [
        np.clip(((nodes - low) / (high - low) * count).astype(int), 0, count - 1)
        for nodes, (low, high), count in zip((density.x, density.v), section.bounds, section.labels.shape, strict=True)
    ]
    labels = section.labels[np.ix_(*places)]
    for intensity, logs in zip(density.intensities.tolist(), density.log_density, strict=True):
        weights = np.exp(logs - logs.max())
        for label in range(len(section.names)):
            share = float(weights[labels == label].sum() / weights.sum())
            ends = share, math.nan, math.nan
            found.append(Quantity(Kind.DENSITY_SHARE, label, None, method, intensity, *ends))
    return found


def _exponents(result: Result, method: str) -> list[Quantity]:
    """Exponents of the shares at the intensities of the rates, or at that of the scene."""
    own = float((result.scene.get("noise") or {}).get("intensity", 0.0))
    intensities = result.intensities if isinstance(result, RatedResult) else [own]
    try:
        transitions = Transitions.of(result)
    except StructureError:  # bounds that do not enclose their energies
        return []
    if not transitions.known:
        return []
    found = []
    for intensity in intensities:
        if intensity > 0:
            weights = transitions.stationary_weights(intensity)
            rows = zip(weights.exponents.tolist(), weights.lower.tolist(), weights.upper.tolist(), strict=True)
            for label, ends in enumerate(rows):
                found.append(Quantity(Kind.WEIGHT_EXPONENT, label, None, method, intensity, *ends))
    return found

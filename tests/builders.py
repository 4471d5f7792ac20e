"""Records made by hand, with every kind of part, and a plug-in that is not installed."""

import contextlib
import dataclasses
import io
import json
from collections.abc import Mapping
from importlib.metadata import EntryPoint
from typing import Any, ClassVar, Self

import numpy as np
import pytest
import xarray

from vibrokit import registry
from vibrokit.analyzers.analyzer import Analysis, Analyzer
from vibrokit.analyzers.problem import ExitProblem
from vibrokit.plots.artists import Artists
from vibrokit.plots.axes import axes_or_new
from vibrokit.progress import Stats
from vibrokit.registry import Group
from vibrokit.results.arrays import Arrays
from vibrokit.results.attractor import Attractor, Survival
from vibrokit.results.basins import ESCAPED, NOT_FOLLOWED, UNSETTLED, Basins
from vibrokit.results.codes import Code
from vibrokit.results.continuation import Bifurcation, Continuation, SteadyStates
from vibrokit.results.data import joined as joined_data
from vibrokit.results.energy import ActivationEnergy, Bound, Certificate, ExitPath
from vibrokit.results.finding import Finding
from vibrokit.results.least_action import LeastActionResult
from vibrokit.results.record import Record
from vibrokit.results.region import Region
from vibrokit.results.result import Result
from vibrokit.results.saddle import Manifold, ManifoldEnd, Saddle
from vibrokit.results.section import Section
from vibrokit.results.structure import Structure

REGION = Region((-0.75, 0.8), (-1 / 3, 0.1 + 0.2))
SCENE = {
    "natural_frequency": 1.0,
    "damping_ratio": 0.01,
    "barriers": [
        {"law": {"name": "hertz", "stiffness": 50.0}, "position": 0.5, "side": "right"},
        {"law": {"name": "hertz", "stiffness": 50.0}, "position": -0.5, "side": "left"},
    ],
    "noise": {"name": "white", "intensity": 2e-5},
}
PROVENANCE = {
    "scene": SCENE,
    "settings": {"cells": [40, 30], "margin": None, "graph": {"nodes": [360, 360]}, "tolerance": float("inf")},
    "stats": Stats(
        trajectories=2**40, intervals=12, steps=3, newton_iterations=4, seconds={"basins": 1 / 3, "compiling": 0.0}
    ),
    "complete": False,
    "seed": 2**63 + 12345,
    "seconds": 12.25,
    "versions": {"python": "3.11.2", "vibrokit": "0.1"},
}


# Structures


def circle(radius: float, samples: int = 64) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, samples + 1)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def attractor(label: int, kind: str, period: int, **changes) -> Attractor:
    common = {
        "name": f"«{kind}»-{label}",
        "duration": period * 11.0,
        "points": circle(0.1 * (label + 1))[: max(1, period)],
        "orbit": circle(0.1 * (label + 1), 40 + label),
        "multipliers": np.array([0.3 - 0.4j, 0.3 + 0.4j]),
        "exponents": np.array([-0.01 + 0.5j, complex(-np.inf, np.pi)]),  # a multiplier of 0 has the rate −∞
        "exponent_error": 0.0,
        "hits": {"left": 0.0, "right": 8.0},
        "peak_depth": {"left": 0.0, "right": 0.1 + 0.2},
        "peak_force": {"left": 0.0, "right": 1 / 3},
        "basin_fraction": 0.1,
        "basin_fraction_error": 0.003,
        "residual": 1e-15,
        "error": 3e-11,
    }
    return Attractor(label=label, kind=kind, period=period, **(common | changes))


def survival(stepper: str) -> Survival:
    lives = np.array([17, -1, 2**40, -1, 450])  # longer than 32 bits
    return Survival(stepper, 5, 20000, 2, np.inf, np.nan, lives)


def chaotic(label: int) -> Attractor:
    never = {"duration": np.nan, "multipliers": np.empty(0, complex), "residual": np.nan, "error": np.nan}
    proof = (survival("RK4(steps=512)"), survival("FreeFlight(tolerance=1e-10)"))
    rate = {"exponents": np.array([0.0375 + 0j]), "exponent_error": 0.0003}
    sample = np.random.default_rng(0).normal(size=(200, 2))
    return attractor(label, "chaotic", 0, points=sample, survival=proof, **never, **rate)


def full_structure() -> Structure:
    """A structure with every kind of attractor, saddle, manifold and cell."""
    attractors = (
        attractor(0, "periodic", 1, hits={}, peak_depth={}, peak_force={}),
        attractor(1, "periodic", 4),
        chaotic(2),
        attractor(3, "equilibrium", 1, duration=0.0, hits={"left": 0.0}),
        attractor(4, "limit cycle", 1),
        attractor(5, "quasiperiodic", 0, multipliers=np.empty(0, complex), survival=(survival("RK4(steps=256)"),)),
    )
    two = np.array([5.0 + 0j, -0.2 + 0j])
    rates = np.log(two)
    saddles = (
        Saddle("saddle", 1, 11.0, circle(0.2)[:1], circle(0.2)[:4], two, rates, (0, 1), 1e-13, 1e-12),
        Saddle("flip saddle", 2, 22.0, circle(0.3)[:2], circle(0.3)[:1], -two, rates, (1, 1), 1e-13, 1e-12),
        Saddle("repeller", 1, 11.0, circle(0.4)[:1], circle(0.4)[:1], two, rates, (UNSETTLED, ESCAPED), 1e-13, 1e-12),
        Saddle(
            "chaotic",
            0,
            np.nan,
            circle(0.35),
            np.empty((0, 2)),
            np.empty(0, complex),
            np.array([0.1 + 0j]),
            (0, 2),
            np.nan,
            np.nan,
        ),
        Saddle("saddle", 1, 11.0, circle(0.35)[:1], circle(0.35)[:1], two, rates, (0, 2), 1e-13, 1e-12, embedded=True),
    )
    manifolds = (
        Manifold(0, 0, True, 1, circle(0.5, 300), ManifoldEnd.LEAVES_REGION),
        Manifold(0, 0, False, -1, circle(0.25, 30), ManifoldEnd.AT_REST),
        Manifold(1, 1, False, 1, np.empty((0, 2)), ManifoldEnd.TOO_EXTREME),
    )
    labels = np.arange(-3, 6, dtype=np.int16)[np.random.default_rng(1).integers(0, 9, (40, 30))]
    findings = (
        Finding.of(Code.STEADY_STATES, count=6, starts=100),
        Finding.of(Code.CHAOTIC_EDGE, 0, 2, exponent=0.1 + 0.2, error=float("nan"), count=3, orbits=1),
        Finding.of(Code.STOPPED, 1, 0, stage="manifolds", reason="time limit"),
    )
    return Structure(
        attractors=attractors,
        saddles=saddles,
        manifolds=manifolds,
        basins=Basins(REGION, labels),
        survival=(survival("RK4(steps=256)"),),
        settling=1e-3,
        budget=500,
        stepper="rk4:256",
        shift=2.5,
        findings=findings,
        **PROVENANCE,
    )


def empty_structure() -> Structure:
    """A structure in which nothing was found."""
    nothing = {"attractors": (), "saddles": (), "manifolds": (), "survival": (), "findings": (), "seed": None}
    labels = np.full((2, 3), NOT_FOLLOWED, dtype=np.int16)
    return dataclasses.replace(full_structure(), basins=Basins(REGION, labels), scene={}, **nothing)


# Results

CERTIFICATE = Certificate(1e-12, 1e-5, 2e-5, 61.5, -1e-13, 3e-14, -2e-12, 0.25)
UNSURE = Certificate(1e-10, 1e-4, 0.0, 12.0, np.nan, 0.0, 1e-12, np.nan)


def spiral(turns: int = 12) -> ExitPath:
    t = np.linspace(0, 11.0 * turns, 16 * turns + 1)
    growth = np.exp(0.05 * (t - t[-1]))
    q = np.stack([0.3 + growth * np.cos(t), growth * np.sin(t)], axis=1)
    return ExitPath(t, q, 1e-3 * q, 1e-4 * growth**2, np.arange(0, len(t), 16))


def energy(source: int, target: int, value: float, **changes) -> ActivationEnergy:
    common = {
        "lower": value - 1e-9, "upper": value + 1e-9, "method": "least action", "bound": Bound.CERTIFIED,
        "numerical_error": 1e-13, "residual": 1e-11,
    }  # fmt: skip
    return ActivationEnergy(source=source, target=target, value=value, **(common | changes))


def section() -> Section:
    labels = np.random.default_rng(0).integers(-3, 3, (20, 16)).astype(np.int16)
    curve = circle(1.0, 200)
    return Section(
        labels=labels,
        bounds=np.array([[-1.0, 1.0], [-0.9, 0.1 + 0.2]]),
        points=(np.array([[0.3, 0.0]]), curve[:4], 0.4 * curve[:60]),
        names=("clear", "hammering-period-4", "chaotic"),
        saddles=(np.array([[0.9, 0.0]]), curve[7:9]),
        chaotic=(0.5 * curve[:50],),
        stable=(curve, curve[:30] - 0.1),
    )


def potential() -> xarray.Dataset:
    """A quasi-potential as a graph search lays it out, for one attractor."""
    psi = np.random.default_rng(1).exponential(size=(20, 16))
    psi[psi > 2] = np.nan
    return xarray.Dataset(
        {"quasi_potential": (("node_x", "node_v"), psi, {"long_name": "quasi-potential", "units": "m2 s-3"})},
        coords={
            "quasi_potential_x": ("node_x", np.linspace(-1, 1, 20), {"long_name": "displacement", "units": "m"}),
            "quasi_potential_v": ("node_v", np.linspace(-0.9, 0.3, 16), {"long_name": "velocity", "units": "m s-1"}),
        },
    )


def full_result() -> LeastActionResult:
    """A result with paths, brackets, branches, certificates and a quasi-potential."""
    energies = (
        energy(
            0, 1, 9e-5, path=spiral(), saddle=0, certificate=CERTIFICATE,
            sensitivity={"damping_ratio": 9e-3, "barriers.0.position": -0.0},
            sensitivity_error={"damping_ratio": 1e-12, "barriers.0.position": 0.0},
        ),
        energy(1, 0, 1e-3, lower=5e-4, upper=np.inf, certificate=UNSURE, saddle=1, method="«graph» and polish"),
        energy(2, -1, 3e-4, lower=np.nan, path=spiral(3), bound=Bound.BRACKET, numerical_error=np.nan),
    )  # fmt: skip
    branches = (*energies, energy(0, 1, 1.1e-4, path=spiral(5), saddle=1, certificate=CERTIFICATE, proposed_by="graph"))
    made = LeastActionResult(energies=energies, branches=branches, section=section(), **PROVENANCE)
    joined = joined_data({2: potential()}, made.names)
    return dataclasses.replace(made, data=joined, findings=(Finding.of(Code.NO_EXIT_FOUND, 1),))


def empty_result() -> LeastActionResult:
    """A result without attractors."""
    bare = Section(np.full((2, 3), -1, dtype=np.int16), np.array([[0.0, 1.0], [0.0, 1.0]]), (), ())
    return dataclasses.replace(
        full_result(), energies=(), branches=(), section=bare, data=xarray.Dataset(), findings=()
    )  # fmt: skip


def rated_result(kind, times, intensities, error=0.05, **changes):
    """A result with rates: `times` has ln τ at each intensity by (source, target); NaN where no rate is known.

    `error` is the standard error of ln τ; intervals are 1.96 of it on each side. `relaxation` is the relaxation time of
    all attractors, `held` the share of each core in its own basin, `event` what counts; the rest goes to the result.
    """
    own = changes.pop("section", section())
    relaxation, held = changes.pop("relaxation", 1.0), changes.pop("held", 1.0)
    event, count = changes.pop("event", "commitment"), len(own.names)
    data = {}
    for source in sorted({source for source, _ in times}):
        targets = [target for start, target in times if start == source]
        logs = -np.array([times[source, target] for target in targets], dtype=float).T
        errors = np.broadcast_to(error, logs.shape)
        shares = np.broadcast_to(np.where(np.eye(count), held, 0.0), (len(intensities), count, count))
        both = ("intensity_index", "exit_index")
        data[source] = xarray.Dataset(
            {
                "log_rate": (both, logs),
                "log_rate_error": (both, np.where(np.isnan(logs), np.nan, errors)),
                "log_rate_lower": (both, logs - 1.96 * errors),
                "log_rate_upper": (both, logs + 1.96 * errors),
                "rate_target": ("exit_index", np.array(targets)),
                "rate_intensity": ("intensity_index", np.array(intensities, dtype=float)),
                "rate_method": ("intensity_index", np.array(["made"] * len(intensities))),
                "rate_event": ((), event),
                "relaxation_time": ("core_source", np.full(count, relaxation)),
                "core_share": (("intensity_index", "core_source", "core_label"), shares),
            }
        )
    common = {"energies": (), "scene": SCENE, "settings": {"analyzer": kind.kind}, **changes}
    return kind(section=own, data=joined_data(data, own.names), **common)


# Continuations


def full_continuation() -> Continuation:
    """A continuation with a value at which nothing was found."""
    one = attractor(0, "periodic", 1, survival=(survival("RK4(steps=256)"),))
    other = attractor(-1, "chaotic", 0, basin_fraction=np.nan, basin_fraction_error=np.nan)
    return Continuation(
        parameter="excitations.0.frequency",
        symbol="omega",
        unit="rad s^-1",
        region=REGION,
        states=(
            SteadyStates(0.1 + 0.2, (one, other), (0, 1), (Finding.of(Code.STEADY_STATES, count=2, starts=9),)),
            SteadyStates(0.5, (), (), (Finding.of(Code.NOTHING_AT, value=0.5, reason="it diverged."),)),
            SteadyStates(0.75, (attractor(0, "periodic", 2),), (0,)),
        ),
        branch_names=("clear", "chaotic – «outer»"),
        bifurcations=(
            Bifurcation("grazing", 1 / 3, 1e-9, 0, 1, np.array([0.1 + 0.2, 0.5]), "left"),
            Bifurcation("Neimark–Sacker", 0.6, 0.0, 1, 2, np.array([0.1, 0.2])),
        ),
        **PROVENANCE,
    )


# Comparing and damaging


def assert_same(old, new, where=""):
    """Both are of one type and equal in every attribute; arrays to the last bit."""
    assert type(old) is type(new), where
    if dataclasses.is_dataclass(old):
        for field in dataclasses.fields(old):
            assert_same(getattr(old, field.name), getattr(new, field.name), f"{where}.{field.name}")
    elif isinstance(old, xarray.Dataset):
        xarray.testing.assert_identical(plain(old), plain(new))
    elif isinstance(old, np.ndarray):
        assert (old.dtype, old.shape) == (new.dtype, new.shape), where
        assert old.tobytes() == new.tobytes(), where
    elif isinstance(old, Mapping):
        assert set(old) == set(new), where
        for key in old:
            assert_same(old[key], new[key], f"{where}.{key}")
    elif isinstance(old, tuple | list):
        assert len(old) == len(new), where
        for index, pair in enumerate(zip(old, new, strict=True)):
            assert_same(*pair, f"{where}[{index}]")
    else:
        assert repr(old) == repr(new), where  # NaN too


def plain(dataset: xarray.Dataset) -> xarray.Dataset:
    """A dataset with types that do not depend on whether it was in a file: texts as objects, numbers of 64 bits."""
    wide = {"i": np.int64, "U": object, "O": object, "T": object}
    return dataset.map(lambda a: a.astype(wide.get(a.dtype.kind, a.dtype))).assign_coords(
        {name: a.astype(wide.get(a.dtype.kind, a.dtype)) for name, a in dataset.coords.items()}
    )


def rewritten(content: bytes, change) -> bytes:
    """A file whose arrays and provenance `change` has changed."""
    asis = {"mask_and_scale": False, "decode_times": False, "decode_timedelta": False}
    data = xarray.load_dataset(io.BytesIO(content), engine="scipy", **asis).drop_encoding()
    header = json.loads(data.attrs["vibrokit"])
    data = change(data, header)
    data.attrs["vibrokit"] = json.dumps(header)
    return bytes(data.to_netcdf(engine="scipy"))


def drop(name):
    return lambda data, header: data.drop_vars(name)


def put(name, place, value):
    """Overwrite one entry of an array."""

    def change(data, header):
        values = data[name].values.copy()
        values[place] = value
        return data.assign({name: (data[name].dims, values)})

    return change


def replaced(name, values, *dimensions):
    return lambda data, header: data.assign({name: (dimensions or data[name].dims, np.array(values))})


def say(key, value):
    """Put another value into the provenance; `...` takes the entry out."""

    def change(data, header):
        header.pop(key) if value is ... else header.update({key: value})
        return data

    return change


@contextlib.contextmanager
def plug_in():
    """A plug-in is installed: its analyzer and its records are registered."""
    real = registry._entry_points
    added = [EntryPoint(one.kind, f"{__name__}:{one.__name__}", Group.RECORDS) for one in (ShadeResult, CountRecord)]
    added.append(EntryPoint("toy", f"{__name__}:Toy", Group.ANALYZERS))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "_entry_points", lambda group: [*real(group), *(e for e in added if e.group == group)])
        yield


# Records of a plug-in


class ShadeResult(Result):
    """A result with a picture of its own."""

    kind: ClassVar[str] = "shade"

    def plot(self, ax: Any = None) -> Artists:
        """Draw the least action of each start."""
        axes = axes_or_new(ax)
        axes.plot(self.data["angle"].sel(source=0))
        return Artists(axes)


class CountRecord(Record):
    """A record that is not a result."""

    kind: ClassVar[str] = "count"

    counts: tuple[int, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return ()

    def plot(self, ax: Any = None) -> Artists:
        """Draw nothing."""
        return Artists(axes_or_new(ax))

    def to_dataset(self) -> xarray.Dataset:
        return xarray.Dataset({"count": ("place", np.array(self.counts, dtype=np.int64))})

    @classmethod
    def from_dataset(cls, dataset: xarray.Dataset, **provenance: Any) -> Self:
        return cls(counts=tuple(Arrays(dataset).wholes("count", (None,)).tolist()), **provenance)


class Toy(Analyzer):
    """An analyzer that invents its numbers; attractors have different numbers of starts."""

    result: ClassVar[type[Result]] = ShadeResult

    points: int = 4
    pair: tuple[int, int] = (3, 5)

    def analyze(self, problem: ExitProblem) -> Analysis:
        source, count = problem.source, self.points + problem.source
        found = energy(source, 1 - source, 1e-4 * (1 + source), path=spiral(3 + source), method="toy")
        angle = ("start", np.linspace(0, 1, count), {"long_name": "angle of the start", "units": "rad"})
        data = xarray.Dataset({"angle": angle, "hit": ("start", np.arange(count)), "best": ((), 0.1 + 0.2)})
        return Analysis((found,), data, branches=(found,))

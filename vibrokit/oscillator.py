"""Oscillator: a scene with its equations and its integration."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import math
from functools import cached_property
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibrokit.construction import called
from vibrokit.errors import IntegrationError, ParameterError, SceneError, TooManyStepsError, shown
from vibrokit.measured.real_array import real_array
from vibrokit.parts.parameter import Parameter
from vibrokit.parts.scene import Scene
from vibrokit.results.trajectory import Trajectory
from vibrokit.symbolic.flow_kind import Flow

if TYPE_CHECKING:
    from vibrokit.kernels.stepper import Stepper
    from vibrokit.symbolic.model import Model

_MOST_SAMPLES = 10**8
_MOST_PERIODS = 10**15
# Times of a force in an interval from which on it may be what needs 200 000 attempts at steps. Order8 gave up after
# 15 100 (tolerance 1e-15) to 740 000 times (1e-2) of oscillation in a linear or a Hertz contact, and after 540 000 or
# more at rest in a damped one.
_FAST = 10_000.0
_PERIODS = Parameter("periods", "", "", "", above=0)
_DURATION = Parameter("duration", "", "", "s", above=0)
_START_TIME = Parameter("start_time", "", "", "s")

Array = NDArray[np.float64]
Rng = int | np.random.Generator | None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Oscillator(Scene):
    """A vibro-impact oscillator: x″ + c x′ + spring + friction = stops + Σ excitations + noise, per unit mass.

    Parameters as for `Scene`: c is `damping`, or 2ζω_n; the spring is κ x with `stiffness` κ, or ω_n² x.
    The equations are derived on first access, and code is compiled on first integration.

    Examples
    --------
    >>> import vibrokit as vk
    >>> osc = vk.Oscillator(
    ...     natural_frequency=1.0, damping_ratio=0.01,
    ...     barriers=(vk.Barrier(vk.Hertz(stiffness=50.0), position=0.5, side="right"),),
    ...     excitations=(vk.Harmonic(amplitude=0.18, frequency=0.57),))
    >>> osc.section_map([[0.0, 0.0]], periods=100)  # doctest: +SKIP
    """

    @cached_property
    def model(self) -> Model:
        """The derived equations; displayed as LaTeX in a notebook."""
        from vibrokit.symbolic.model import Model

        return Model(self)

    @called
    def trajectory(
        self,
        state: ArrayLike,
        periods: float | None = None,
        *,
        duration: float | None = None,
        samples: int = 256,
        start_time: float = 0.0,
        stepper: Stepper | None = None,
        rng: Rng = None,
    ) -> Trajectory:
        """Integrate one trajectory and return it at equally spaced times.

        Parameters
        ----------
        state : array_like (n,)
            Initial state (x, v), then extra noise states.
        periods : float, optional
            Length in forcing periods (units of 2π/ω_n without forcing). Give either this or `duration`.
        duration : float, optional
            Length in time (s).
        samples : int
            Points per period, or per 2π/ω_n without forcing.
        start_time : float
            Initial time (s), which sets the phase of the forcing.
        stepper : Stepper, optional
            By default the choice of `vibrokit.kernels.choice` for single trajectories.
        rng : int or numpy.random.Generator, optional
            Seed of the noise. By default the trajectory is noise-free.

        Returns
        -------
        Trajectory

        Raises
        ------
        IntegrationError
            The state became infinite or NaN; the error has the time and the last finite state.
        TooManyStepsError
            The state is finite, but the steps that a force requires are too short; the error also has its time.
        """
        from vibrokit.kernels.choice import single_stepper
        from vibrokit.kernels.named import check_stepper
        from vibrokit.kernels.single import recorded

        start = self._checked_states(state, 1)[0]
        start_time = _START_TIME.checked("trajectory", start_time)
        length, count = self._sampling(periods, duration, samples)
        flow = Flow.STATE if rng is None else self._noisy()
        check_stepper(stepper)
        chosen = stepper or single_stepper(self, flow)
        seed = None if rng is None else seed_from(rng)
        path, status = recorded(self, flow, chosen, start, start_time, length / count, count, seed=seed)
        times: Array = start_time + length / count * np.arange(count + 1, dtype=float)
        if len(path) <= count:
            raise self._ended_early(flow, chosen, path[-1], times[len(path) - 1 : len(path) + 1], status)
        return Trajectory(times, path, tuple(barrier.position for barrier in self.barriers))

    @called
    def section_map(
        self,
        states: ArrayLike,
        periods: int = 1,
        *,
        stepper: Stepper | None = None,
        rng: Rng = None,
        executor: concurrent.futures.Executor | None = None,
    ) -> Array:
        """Map states on the section t = 0 to states on the section some periods later.

        Parameters
        ----------
        states : array_like (count, n)
        periods : int
            Number of forcing periods, or of units of 2π/ω_n without forcing.
        stepper : Stepper, optional
            By default the choice of `vibrokit.kernels.choice` for ensembles.
        rng : int or numpy.random.Generator, optional
            Seed of the noise. By default the map is noise-free.
        executor : concurrent.futures.Executor, optional
            Runs blocks of trajectories; threads by default.

        Returns
        -------
        array (count, n)

        Raises
        ------
        NoSectionError
            The excitations have no common period.
        IntegrationError
            A state became infinite or NaN; the error has the trajectory, the time and the last finite state.
        TooManyStepsError
            A state is finite, but the steps that a force requires are too short.
        """
        from vibrokit.kernels.choice import ensemble_stepper
        from vibrokit.kernels.ending import ending
        from vibrokit.kernels.ensemble import run_ensemble
        from vibrokit.kernels.named import check_stepper
        from vibrokit.kernels.stopping import STALLED
        from vibrokit.kernels.streams import streams_of
        from vibrokit.kernels.tasks import check_executor

        starts = self._checked_states(states, 2)
        if isinstance(periods, bool) or not isinstance(periods, Integral) or not 0 <= periods <= _MOST_PERIODS:
            raise ParameterError(
                f"section_map: periods must be a whole number from 0 to {_MOST_PERIODS}, got {shown(periods)}."
            )
        flow = Flow.STATE if rng is None else self._noisy()
        check_stepper(stepper)
        chosen = stepper or ensemble_stepper(self, flow)
        check_executor(executor)
        streams = None if rng is None else streams_of(seed_from(rng), np.arange(len(starts)))
        ended = run_ensemble(self, flow, chosen, starts, int(periods), streams=streams, executor=executor)
        failed = np.flatnonzero(ended.intervals < periods)
        if failed.size:
            first = failed[0]
            time = float(ended.intervals[first] * self.section_interval)
            last = tuple(float(value) for value in ended.states[first])
            _, border = ending(self, flow, chosen, ended.states[first], time, self.section_interval)
            if ended.status[first] == STALLED and not border:
                who = f"{failed.size} of {len(starts)} trajectories did not end; the first, number {first}, needs"
                raise self._stalled(who, time, last, self.section_interval)
            raise IntegrationError(
                f"{failed.size} of {len(starts)} trajectories {'ended' if border else 'diverged'}; the first, number "
                f"{first} from {tuple(starts[first].tolist())}, in the period after t = {time:g}, after the state "
                f"{last}{', at ' + border if border else ''}; {_AT_BORDER if border else _advice(chosen)}",
                time,
                last,
            )
        return ended.states

    @called
    def error_estimate(self, states: ArrayLike, periods: int = 1, *, stepper: Stepper | None = None) -> Array:
        """Estimate the error of `section_map` for each state by comparison with the next finer stepper.

        Returns
        -------
        array (count,)
            Distance between the two results.
        """
        from vibrokit.kernels.choice import ensemble_stepper
        from vibrokit.kernels.named import check_stepper

        check_stepper(stepper)
        chosen = stepper or ensemble_stepper(self, Flow.STATE)
        coarse = self.section_map(states, periods, stepper=chosen)
        fine = self.section_map(states, periods, stepper=chosen.refined())
        return np.linalg.norm(coarse - fine, axis=1)

    def _ended_early(self, flow: Flow, stepper: Stepper, state: Array, between: Array, status: int) -> IntegrationError:
        """Return the error of a trajectory that ends between two samples, after a state, with the cause."""
        from vibrokit.kernels.ending import ending
        from vibrokit.kernels.stopping import STALLED
        from vibrokit.kernels.vector_field import VectorField

        since, until = between.tolist()
        last = tuple(state.tolist())
        when, border = ending(self, flow, stepper, state, since, until - since)
        if border:
            text = f"the trajectory ended at t = {when:.6g}, at {border}, after the sample {last}; {_AT_BORDER}"
            return IntegrationError(text, when, last)
        if not np.isfinite(VectorField(self).rate(state, since)).all():
            return IntegrationError(f"at t = {since:.6g} the trajectory came to {last}, {_NO_VALUE}", since, last)
        if status == STALLED:
            return self._stalled("the trajectory needs", since, last, until - since)
        text = (
            f"the trajectory diverged between t = {since:g} and {until:g}, after the state {last}; {_advice(stepper)}"
        )
        return IntegrationError(text, since, last)

    def _stalled(self, who: str, time: float, state: tuple[float, ...], interval: float) -> TooManyStepsError:
        """Return the error of motion that needs too many steps in an interval after a state, with their cause."""
        from vibrokit.kernels.ending import fastest_force
        from vibrokit.kernels.located import MOST_STEPS

        force = fastest_force(self, np.array(state))
        where = f"{who} more than {MOST_STEPS:.0f} steps in the {interval:g} s after t = {time:g}, at the state {state}"
        if force is None or interval < _FAST * force.time:
            advice = "it may run off to infinity in a finite time: check the signs of the forces"
            return TooManyStepsError(f"{where}; {advice}.", time, state, math.inf, False)
        advice = "give the friction a smooth form that is wider in v" if force.friction else "take a softer law"
        cause = f"{force.words}, a time of {force.time:.3g} s, and no step may be much longer"
        message = f"{where}: {cause}; {advice}, or follow the motion for shorter intervals."
        return TooManyStepsError(message, time, state, force.time, force.friction)

    def _noisy(self) -> Flow:
        if self.noise is None:
            raise SceneError("rng was given, but the scene has no noise; add a noise model or omit rng.")
        return Flow.NOISY

    def _checked_states(self, states: ArrayLike, dimensions: int) -> Array:
        size = 2 + len(self.noise.extra_states if self.noise else ())
        try:
            checked = np.atleast_2d(real_array(states))
        except (TypeError, ValueError, OverflowError) as error:
            raise ParameterError(
                f"states must be an array of numbers of shape (count, {size}), or one state: {error}."
            ) from error
        if checked.ndim != 2 or checked.shape[1] != size or (dimensions == 1 and len(checked) != 1):
            wanted = f"{size} numbers" if dimensions == 1 else f"an array of shape (count, {size})"
            raise ParameterError(f"states must be {wanted}, got the shape {np.shape(states)}.")
        if not np.isfinite(checked).all():
            row = checked[~np.isfinite(checked).all(axis=1)][0]
            raise ParameterError(f"states must be finite, got {tuple(row.tolist())}.")
        return checked

    def _sampling(self, periods: float | None, duration: float | None, samples: int) -> tuple[float, int]:
        """Length of a trajectory (s), and number of samples after the initial one."""
        if (periods is None) == (duration is None):
            raise ParameterError("trajectory: give either periods or duration.")
        if isinstance(samples, bool) or not isinstance(samples, Integral) or not 1 <= samples <= _MOST_SAMPLES:
            raise ParameterError(
                f"trajectory: samples must be a whole number from 1 to {_MOST_SAMPLES}, got {shown(samples)}."
            )
        if duration is not None:
            length = _DURATION.checked("trajectory", duration)
        else:
            length = _PERIODS.checked("trajectory", periods) * self.section_interval
        count = length / self.time_unit * int(samples)
        if count > _MOST_SAMPLES:
            raise ParameterError(
                f"trajectory: at most {_MOST_SAMPLES} samples are allowed, got {count:.0f}; give a shorter length or "
                f"fewer samples per period than {samples}."
            )
        return length, max(1, math.ceil(count - 1e-9))

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}


_NO_VALUE = "where a force has no value: a formula is 0/0 there, infinite or not real; write it without that division."
_AT_BORDER = "no motion goes on from there: start elsewhere, follow it for a shorter time, or put a stop before it."


def _advice(stepper: Stepper) -> str:
    return f"check the signs of the forces, or choose a finer stepper than {stepper}."


def check_oscillator(osc: Any) -> None:
    """Raise SceneError unless a value is an oscillator."""
    if not isinstance(osc, Oscillator):
        raise SceneError(
            f"the scene must be an Oscillator, got {shown(osc)}; compose one, or load a bundled one with load_scene."
        )


def seed_from(rng: int | np.random.Generator) -> int:
    """Return the seed of a family of random streams, one per trajectory."""
    return int(generator_from(rng).integers(2**63))


def generator_from(rng: int | np.random.Generator) -> np.random.Generator:
    """Return the generator of a seed, or the given generator; ParameterError for anything else."""
    try:
        if isinstance(rng, bool):
            raise TypeError("bool")
        return np.random.default_rng(rng)
    except (TypeError, ValueError) as error:
        raise ParameterError(
            f"rng must be a whole number, at least 0, or a numpy.random.Generator, got {shown(rng)}."
        ) from error

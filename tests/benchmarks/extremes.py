"""What holds at the extremes, at what error, and what is refused.

Run by hand: ``python -m tests.benchmarks.extremes`` from the checkout. Errors are against closed forms or quadrature
at 50 digits, so they are independent of every stepper.
"""

import math
import time
import warnings
from collections.abc import Callable

import numpy as np

import vibrokit as vk
from tests.extremes.exact import exact_period

CYCLES = 10
STEPPERS = (vk.FreeFlight(tolerance=1e-12), vk.Order8(tolerance=1e-12), vk.RK4(steps=256))


def outcome(work: Callable[[], float]) -> str:
    """Error and time of a piece of work, or why it was refused."""
    began = time.perf_counter()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            error = work()
        mark = " (warned)" if caught else ""
        return f"{error:.1e}{mark} {time.perf_counter() - began:.2f} s"
    except vk.errors.VibrokitError as refusal:
        return f"refused: {type(refusal).__name__}"


def row(name: str, work: Callable[[object], float]) -> None:
    """Print one line: the case, and the outcome with each stepper."""
    cells = [outcome(lambda stepper=stepper: work(stepper)) for stepper in STEPPERS]
    print(f"{name:<48}" + "".join(f"{cell:<26}" for cell in cells), flush=True)


def stop_scene(law: object, place: float = 0.3) -> vk.Oscillator:
    return vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, barriers=(vk.Barrier(law, place, "right"),))


def back(law: object, power: float, excess: float) -> Callable[[object], float]:
    """Distance from the start after whole exact periods."""
    place = 0.3
    start = np.array([0.0, place * (1 + excess)])
    period = exact_period(law.stiffness, power, place, start[1])
    osc = stop_scene(law, place)

    def work(stepper: object) -> float:
        path = osc.trajectory(start, duration=CYCLES * period, samples=1, stepper=stepper)
        return float(np.abs(path.states[-1] - start).max())

    return work


def zero_gap(stiffness: float) -> Callable[[object], float]:
    osc = vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.0,
        barriers=tuple(vk.Barrier(vk.Hertz(stiffness), 0.0, side) for side in ("right", "left")),
    )
    half = exact_period(stiffness, 1.5, 0.0, 0.8) - math.pi

    def work(stepper: object) -> float:
        path = osc.trajectory([0.0, 0.8], duration=2 * CYCLES * half, samples=1, stepper=stepper)
        return float(np.abs(path.states[-1] - [0.0, 0.8]).max())

    return work


def forced(damping: float, frequency: float, periods: int) -> Callable[[object], float]:
    """Distance from the closed form of the forced linear motion after many periods."""
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=damping, excitations=(vk.Harmonic(0.1, frequency),))
    duration = periods * osc.section_interval
    if damping == 0 and frequency == 1:
        start, exact = np.zeros(2), np.array([0.05 * duration * math.sin(duration), 0.05 * duration])
    else:
        response = 0.1 / (1 - frequency**2 + 2j * damping * frequency)
        start = exact = np.array([response.real, (1j * frequency * response).real])

    def work(stepper: object) -> float:
        end = osc.section_map(start[None], periods, stepper=stepper)[0]
        return float(np.abs(end - exact).max() / max(1.0, np.abs(exact).max()))

    return work


def noise(intensity: float) -> Callable[[object], float]:
    """Relative error of the stationary variance, in standard errors."""
    damping, count = 0.1, 20_000
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=damping, noise=vk.WhiteNoise(intensity))

    def work(stepper: object) -> float:
        x = osc.section_map(np.zeros((count, 2)), 20, rng=1, stepper=stepper)[:, 0]
        return abs(x.var() / (intensity / (4 * damping)) - 1) / math.sqrt(2 / count)

    return work


def main() -> None:
    print(f"{'error and time with':<48}" + "".join(f"{stepper!s:<26}" for stepper in STEPPERS))
    for name, make, power in (("Hertz", vk.Hertz, 1.5), ("linear", vk.Linear, 1.0)):
        for exponent in range(0, 13, 2):
            row(f"{name}, k = 1e{exponent}, {CYCLES} hits", back(make(10.0**exponent), power, 1.0))
    for excess in (1e-2, 1e-4, 1e-6, 1e-8):
        for stiffness in (1.0, 1e6, 1e12):
            row(f"grazing, speed excess {excess:g}, Hertz k = {stiffness:g}", back(vk.Hertz(stiffness), 1.5, excess))
    for stiffness in (1.0, 1e6, 1e12):
        row(f"zero gap, Hertz k = {stiffness:g}", zero_gap(stiffness))
    for damping in (1e-4, 0.01, 0.5, 1.0, 2.0):
        row(f"forced, ζ = {damping:g}, 100 periods", forced(damping, 0.57, 100))
    row("resonance, ζ = 0, 100 periods", forced(0.0, 1.0, 100))
    row("forced, ζ = 0.01, 10⁶ periods", forced(0.01, 0.57, 10**6))
    for intensity in (1e-12, 1e-6, 1e-2, 10.0):
        row(f"noise, D = {intensity:g} (error in standard errors)", noise(intensity))


if __name__ == "__main__":
    main()

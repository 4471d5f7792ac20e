"""Extreme scenes for activation energies, what should hold in each, and exact energies where a closed form has them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator

from scipy.optimize import brentq

import vibrokit as vk
from tests.scenes import double_well

Law = Callable[[float], vk.Hertz | vk.Linear]
LAWS: dict[str, tuple[Law, float]] = {"hertz": (vk.Hertz, 1.5), "linear": (vk.Linear, 1.0)}  # and power of the depth

STIFFNESSES = tuple(10.0**power for power in range(9))
DAMPINGS = (1e-4, 1e-3, 1e-2, 0.1, 0.5, 1.0, 2.0)
DISTANCES = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
_TILT_FOLD = 2 / math.sqrt(27)  # push at which the left well of −x²/2 + x⁴/4 and the hilltop merge
# Forcing amplitude at which the hammering orbit and the saddle merge, k = 50 (`vk.continuation`, to 1e-11).
_AMPLITUDE_FOLDS = {"hertz": 0.08508815832266657, "linear": 0.06694271549514016}

# Clear motion of hertz-0.570 in closed form, 0.2 + Re(_STEADY exp(0.57 i t)), and how far to the right it comes.
_STEADY = 0.18 / (1 - 0.57**2 + 2j * 0.01 * 0.57)
_REACH = 0.2 + abs(_STEADY)


@dataclasses.dataclass(frozen=True)
class ActionScene:
    """A scene, what should hold there, and the energies from its attractors, by growing x, where they are known."""

    name: str
    oscillator: vk.Oscillator
    holds: str
    exact: tuple[float, ...] = ()
    contact: float | None = None  # least action to the first touch of a stop
    region: tuple[tuple[float, float], tuple[float, float]] | None = None  # to look in, where all is small


def pressed_wells(law: str, stiffnesses=STIFFNESSES, dampings=(0.05,)) -> Iterator[ActionScene]:
    """Double well with a stop at x = ½, inside the right well, whose rest position is pressed against it.

    ΔU = 4ζ × barrier whatever the stop: ζ from the left, 4ζ max(−V) from the right, where V has the stop's energy.
    As k grows the right well's bottom comes to a corner at ½, with 4ζ · 7/64 in the limit.
    """
    make, power = LAWS[law]
    for k in stiffnesses:
        for damping in dampings:
            bottom = _bottom(k, power)
            yield ActionScene(
                f"pressed well, {law}, k={k:g}, zeta={damping:g}",
                _well(damping, (vk.Barrier(make(k), 0.5, "right"),)),
                "both energies are 4 zeta times the barrier, stop or no stop",
                (damping, -4 * damping * bottom),
            )


def damped_wells() -> Iterator[ActionScene]:
    """Double well without stops: ζ from either side, and symmetric."""
    for damping in DAMPINGS:
        holds = "zeta from either well; at 1e-4 a path takes thousands of turns, beyond 1 the ends are stiff"
        yield ActionScene(f"double well, zeta={damping:g}", _well(damping), holds, (damping, damping))


def tilted_wells(damping: float = 0.05) -> Iterator[ActionScene]:
    """A push that all but closes the left well: attractor and saddle as near each other as √distance."""
    for distance in DISTANCES:
        push = _TILT_FOLD * (1 - distance)
        roots = [2 / math.sqrt(3) * math.cos((math.acos(push / _TILT_FOLD) - 2 * math.pi * n) / 3) for n in range(3)]
        left, top, right = sorted(roots)
        width, rate = top - left, math.sqrt((top - left) * math.sqrt(3))  # between the two, and of the motion there
        drop = [_difference(top, x, push) for x in (left, right)]
        yield ActionScene(
            f"tilted well, {distance:g} from its fold",
            _well(damping, (), (vk.Constant(push),)),
            "4 zeta times the barriers, the left one as distance**1.5; or attractors too close to be told apart, and "
            "that said",
            tuple(4 * damping * d for d in drop),
            region=((left - 2 * width, top + 2 * width), (-2 * rate * width, 2 * rate * width)),
        )


def forced(law: str) -> Iterator[ActionScene]:
    """hertz-0.570 over stiffness and damping; nothing is known exactly; what holds is bounds and self-consistency."""
    for k in STIFFNESSES:
        yield ActionScene(
            f"forced, {law}, k={k:g}",
            paper_scene(law, stiffness=k),
            "certified, or said not to be; soft stops may leave one attractor, and then leaving it is refused; stiff "
            "ones have many, and short contacts that a grid of basins can miss",
        )
    for damping in DAMPINGS:
        yield ActionScene(
            f"forced, {law}, zeta={damping:g}",
            paper_scene(law, damping=damping),
            "small damping has many attractors and slow paths, and energies of the order of zeta; from 0.1 up "
            "one attractor is left, and leaving it is refused",
        )


def near_fold(law: str = "hertz") -> Iterator[ActionScene]:
    """Hammering orbit and saddle of hertz-0.570 about to merge as the forcing gets weaker."""
    for distance in DISTANCES:
        yield ActionScene(
            f"near the fold, {law}, {distance:g}",
            paper_scene(law, amplitude=_AMPLITUDE_FOLDS[law] * (1 + distance)),
            "the hammering orbit's energy goes to 0 as distance**1.5, clear's does not; the slow multiplier is "
            "1 - O(sqrt(distance)), so unhyperbolic to rounding at 1e-8: refused with the reason, never a wrong number",
        )


def near_grazing(law: str) -> Iterator[ActionScene]:
    """The clear orbit a given distance short of the stop and past it."""
    for distance in (*DISTANCES, *(-d for d in DISTANCES)):
        yield ActionScene(
            f"near grazing, {law}, gap {distance:g}",
            paper_scene(law, clearance=_REACH + distance),
            "the energy to leave the basin changes continuously with the gap; the exact quadratic form of the "
            "attractor holds within the gap only"
            + (" and the linear law's slope jumps at the orbit" if law == "linear" else ""),
        )


def first_contact(law: str) -> Iterator[ActionScene]:
    """The same, looked at within some gaps of the clear orbit: the first touch of a stop."""
    for distance in DISTANCES:
        around = 5 * distance
        yield ActionScene(
            f"first contact, {law}, gap {distance:g}",
            paper_scene(law, clearance=_REACH + distance),
            "2 zeta gap**2 exactly while the gap is positive",
            contact=2 * 0.01 * distance**2,
            region=tuple((place - around, place + around) for place in (_STEADY.real + 0.2, -0.57 * _STEADY.imag)),
        )


def scenes() -> Iterator[ActionScene]:
    """All of them."""
    yield from damped_wells()
    yield from tilted_wells()
    for law in LAWS:
        yield from pressed_wells(law)
        yield from pressed_wells(law, (1e4,), DAMPINGS)
        yield from forced(law)
        yield from near_grazing(law)
        yield from first_contact(law)
    for law in _AMPLITUDE_FOLDS:
        yield from near_fold(law)


def paper_scene(law: str, *, stiffness=50.0, damping=0.01, amplitude=0.18, clearance=0.5) -> vk.Oscillator:
    """hertz-0.570 with things changed."""
    make, _ = LAWS[law]
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=damping,
        barriers=tuple(vk.Barrier(make(stiffness), s * clearance, n) for s, n in ((1, "right"), (-1, "left"))),
        excitations=(vk.Harmonic(amplitude, 0.57), vk.Constant(0.2)),
        noise=vk.WhiteNoise(2e-5),
    )


def _well(damping, barriers=(), excitations=()) -> vk.Oscillator:
    return double_well(damping_ratio=damping, barriers=barriers, excitations=excitations, noise=vk.WhiteNoise(0.01))


def _bottom(k: float, power: float) -> float:
    """V at the bottom of the right well of −x²/2 + x⁴/4 with a stop of a power law at ½, found from the depth there."""

    def slope(depth: float) -> float:
        return (0.5 + depth) ** 3 - 0.5 - depth + k * depth**power

    depth = brentq(slope, 0.0, 0.5, xtol=1e-300, rtol=1e-15)
    x = 0.5 + depth
    return x**4 / 4 - x**2 / 2 + k * depth ** (power + 1) / (power + 1)


def _difference(top: float, x: float, push: float) -> float:
    """V(top) − V(x) of −x²/2 + x⁴/4 − push·x: two Gauss points are exact for the cubic V′, and nothing cancels."""
    half, middle = (top - x) / 2, (top + x) / 2
    return half * sum(y**3 - y - push for y in (middle - half / math.sqrt(3), middle + half / math.sqrt(3)))

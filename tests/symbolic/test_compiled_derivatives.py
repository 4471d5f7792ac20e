"""Every compiled right-hand side against 50-digit central differences of forces written here by hand."""

import dataclasses
import importlib.util
import inspect
from collections.abc import Callable
from functools import cache

import mpmath
import numpy as np
import pytest
from mpmath import mpf

import vibrokit as vk
from tests.layers import slow
from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.kernels.vector_field import VectorField
from vibrokit.symbolic.flow_kind import Flow
from vibrokit.symbolic.source import SceneText
from vibrokit.symbolic.symbols import code_name, parameter_symbols
from vibrokit.testing.compiled import Pieces

DIGITS = 160  # so that second differences are good to 50
TOLERANCE = 1e-12
STOP = 0.5
DEPTHS = (1e-9, 1e-6, 1e-3, 0.037, 0.25, 1.0)
FORCING = 0.137
MOMENTA = (0.7, -1.3)


@dataclasses.dataclass(frozen=True)
class Case:
    """A scene and the same physics by hand.

    Attributes
    ----------
    scene : Oscillator
    acceleration : callable
        x″ without forcing, of mpmath numbers x and v.
    amplitude : callable
        g(x, v).
    points : list of (x, v)
    """

    scene: vk.Oscillator
    acceleration: Callable
    amplitude: Callable
    points: list


def stop(law, side, **more):
    return vk.Barrier(law, STOP if side == "right" else -STOP, side, **more)


def oscillator(*stops, noise=None, **more):
    return vk.Oscillator(
        natural_frequency=1.1,
        damping_ratio=0.03,
        barriers=stops,
        excitations=(vk.Harmonic(0.18, 0.57),),
        noise=noise or vk.WhiteNoise(0.013),
        **more,
    )


def damped(x, v):
    return -2 * mpf(0.03) * mpf(1.1) * v - mpf(1.1) ** 2 * x


def one(x, v):
    return mpf(1)


def with_stops(law, *sides):
    """x″ of the linear oscillator with a stop `law(depth, rate)` on some sides, 0 when apart."""

    def acceleration(x, v):
        total = damped(x, v)
        if "right" in sides and x > mpf(STOP):
            total -= law(x - mpf(STOP), v)
        if "left" in sides and x < -mpf(STOP):
            total += law(-mpf(STOP) - x, -v)
        return total

    return acceleration


def touching(*sides, rates=(0.4, -0.7)):
    signs = [1.0 if side == "right" else -1.0 for side in sides]
    apart = [(0.0, 0.3), (0.31, -0.2), (np.nextafter(STOP, 0.0), 0.4)]
    return [(sign * (STOP + depth), sign * rate) for sign in signs for depth in DEPTHS for rate in rates] + [
        (signs[0] * x, v) for x, v in apart
    ]


def hertz(depth, rate):
    return mpf(50.0) * depth ** mpf(1.5)


def linear(depth, rate):
    return mpf(47.0) * depth


def hunt_crossley(depth, rate):
    return mpf(50.0) * depth ** mpf(1.5) * (1 + mpf(0.75) * rate)


def never_pulling(law):
    return lambda depth, rate: max(law(depth, rate), mpf(0))


def quintic_with_damping(x, v):
    return -2 * mpf(0.03) * mpf(1.1) * v - (mpf(0.8) * x + mpf(0.3) * x**5 + mpf(0.2) * v**3 + mpf(0.1) * x**2 * v)


def power_of_a_length(x, v):
    return -2 * mpf(0.03) * mpf(1.1) * v + mpf(0.8) * abs(x / mpf(1.3)) ** mpf(2.5) * mpmath.sign(x)


def duffing(x, v):
    return -2 * mpf(0.03) * mpf(1.1) * v - (mpf(-1.2) * x + mpf(0.7) * x**3)


def varied(x, v):
    return 1 + mpf(0.4) * x**2 + mpf(0.25) * mpmath.sin(v)


FREE = [(0.0, 0.3), (0.7, -0.4), (-1.3, 1.9), (2.1, 0.05)]
FORMULA = "k*depth**1.5*(1 + c*rate)"


def custom():
    return vk.CustomLaw(FORMULA, k=50.0, c=0.75)


# Rates of -1.7 make 1 + 0.75 rate negative: the law would pull, and the stop lets go.
# Lanes without noise compute what those with noise do. `VectorField` is for derivatives and for momenta alone, and
# covariances are held against SciPy in tests/kernels/test_covariance.py.
FLOWS = [Flow.NOISY, Flow.STATE_REVERSED, Flow.HAMILTONIAN_VARIATIONAL]
CASES = {
    "hertz": Case(
        oscillator(stop(vk.Hertz(50.0), "right"), stop(vk.Hertz(50.0), "left")),
        with_stops(hertz, "right", "left"), one, touching("right", "left"),
    ),
    "linear": Case(
        oscillator(stop(vk.Linear(47.0), "left")), with_stops(linear, "left"), one, touching("left"),
    ),
    "hunt-crossley": Case(
        oscillator(stop(custom(), "right"), stop(custom(), "left")),
        with_stops(never_pulling(hunt_crossley), "right", "left"), one,
        touching("right", "left", rates=(0.4, -0.7, -1.7)),
    ),
    "adhesive": Case(
        oscillator(stop(custom(), "right", adhesive=True)),
        with_stops(hunt_crossley, "right"), one, touching("right", rates=(0.4, -1.7)),
    ),
    "cubic": Case(oscillator(spring=vk.CubicSpring(-1.2, 0.7)), duffing, one, FREE),
    "custom spring": Case(
        oscillator(
            spring=vk.CustomSpring("a*x + b*x**5 + c*v**3 + d*x**2*v", a=0.8, b=0.3, c=0.2, d=0.1)
        ),
        quintic_with_damping, one, FREE,
    ),
    "power of a length": Case(
        oscillator(spring=vk.CustomSpring("a*abs(x/b)**2.5*sign(x/b)", a=0.8, b=-1.3)), power_of_a_length, one, FREE,
    ),
    "varied noise": Case(
        oscillator(
            stop(vk.Hertz(50.0), "right"),
            noise=vk.StateDependentNoise(0.013, "1 + a*x**2 + b*sin(v)", a=0.4, b=0.25),
        ),
        with_stops(hertz, "right"), varied, touching("right", rates=(0.4,)),
    ),
}  # fmt: skip


def first(function, point, index):
    """∂function/∂point[index] by a central difference, with a step far below any depth."""
    step = mpf(10) ** -40
    up, down = list(point), list(point)
    up[index] += step
    down[index] -= step
    return (function(*up) - function(*down)) / (2 * step)


def gradient(function, point):
    return [first(function, point, index) for index in range(len(point))]


def by_hand(case, forcing=FORCING):
    """Drift, Hamiltonian and action rate of a case."""

    def drift(x, v):
        return case.acceleration(x, v) + mpf(forcing)

    def hamiltonian(x, v, p, r):
        return p * v + r * drift(x, v) + (r * case.amplitude(x, v)) ** 2 / 2

    def action_rate(x, v, p, r):
        return (r * case.amplitude(x, v)) ** 2 / 2

    return drift, hamiltonian, action_rate


def expected(case, flow, x, v):
    """What the flow's rates should be; the matrix of the variational flow starts as the identity."""
    drift, hamiltonian, action_rate = by_hand(case)
    if flow is Flow.NOISY:
        return [v, drift(x, v)]
    if flow is Flow.STATE_REVERSED:  # v is −dx/dt here, and the acceleration is the same
        return [v, drift(x, -v)]
    point = (x, v, *map(mpf, MOMENTA))

    def rates(*at):
        h_x, h_v, h_p, h_r = gradient(hamiltonian, at)
        return [h_p, h_r, -h_x, -h_v]

    rows = [entry for row in range(4) for entry in gradient(lambda *at, row=row: rates(*at)[row], point)]
    return [*rates(*point), action_rate(*point), *rows]


@cache
def compiled(name, flow):
    """The compiled right-hand side of lanes, and the values of the parameters that it takes."""
    scene = CASES[name].scene
    module = kernel_for(scene, flow, Pieces()).module
    values = dict(zip(map(code_name, parameter_symbols(scene).values()), theta_of(scene), strict=True))
    names = list(inspect.signature(module.derivative.py_func).parameters)
    return module, [values[name] for name in names[names.index("f") + 1 :]]


def start(flow, x, v):
    """The variables of a flow at a point, its matrix the identity."""
    return [x, v, *MOMENTA, 0.0, *np.eye(4).ravel()] if flow.has_momenta else [x, v]


def relative_errors(found, exact):
    assert len(found) == len(exact)
    errors = []
    for value, target in zip(found, exact, strict=True):
        small = abs(target) < mpf(10) ** -30  # differences leave zeros of this size
        errors.append(float(abs(mpf(value)) if small else abs((mpf(value) - target) / target)))
    return errors


LAYERED = [name if name in ("hertz", "adhesive", "varied noise") else slow(name) for name in CASES]


@pytest.mark.parametrize("name", CASES)
def test_lanes_without_noise_have_the_code_of_those_with_it(name):
    assert SceneText(CASES[name].scene, Flow.STATE).derivative == SceneText(CASES[name].scene, Flow.NOISY).derivative


@pytest.mark.parametrize("flow", FLOWS, ids=lambda flow: flow.value)
@pytest.mark.parametrize("name", CASES)
def test_lanes(name, flow):
    case = CASES[name]
    module, values = compiled(name, flow)
    with mpmath.workdps(DIGITS):
        for x, v in case.points:
            found = module.derivative(*start(flow, x, v), FORCING, *values)
            errors = relative_errors(found, expected(case, flow, mpf(x), mpf(v)))
            assert max(errors) <= TOLERANCE, f"at x = {x!r}, v = {v}, entry {int(np.argmax(errors))}"


@pytest.mark.parametrize("flow", FLOWS, ids=lambda flow: flow.value)
@pytest.mark.parametrize("name", ["hertz", "linear", "hunt-crossley"])
def test_lanes_exactly_at_touch(name, flow):
    """At depth 0 nothing pushes yet, and no derivative is infinite."""
    free = dataclasses.replace(CASES[name], acceleration=damped)
    module, values = compiled(name, flow)
    with mpmath.workdps(DIGITS):
        for x in (STOP, -STOP):
            found = module.derivative(*start(flow, x, 0.4), FORCING, *values)
            assert max(relative_errors(found, expected(free, flow, mpf(x), mpf(0.4)))) <= TOLERANCE


@pytest.mark.parametrize("name", LAYERED)
def test_located(name, tmp_path):
    """The form in which the caller says which stops push; the law is then taken as it is, pulling or not."""
    case, flow = CASES[name], Flow.HAMILTONIAN_VARIATIONAL
    if name == "hunt-crossley":
        case = dataclasses.replace(case, acceleration=with_stops(hunt_crossley, "right", "left"))
    text = SceneText(case.scene, flow)
    path = tmp_path / f"located_{name.replace(' ', '_').replace('-', '_')}.py"
    path.write_text("\n\n".join([text.preamble, text.constants, text.forcing, text.rhs]))
    specification = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    theta, time = theta_of(case.scene), np.arccos(FORCING / 0.18) / 0.57
    found = np.empty(len(text.variables))
    with mpmath.workdps(DIGITS):
        for x, v in case.points:
            depths = [barrier.sign * (x - barrier.position) for barrier in case.scene.barriers]
            module.rhs(time, np.array(start(flow, x, v)), np.array([d > 0.0 for d in depths]), theta, found)
            exact = expected(case, flow, mpf(x), mpf(v))
            errors = relative_errors(np.delete(found, 1), [*exact[:1], *exact[2:]])
            assert max(errors) <= TOLERANCE, f"at x = {x!r}, v = {v}"
            assert abs(mpf(found[1]) - exact[1]) <= TOLERANCE * max(1, abs(exact[1]))  # cos(arccos) rounds, too


@pytest.mark.parametrize("name", LAYERED)
def test_vector_field(name):
    """b, its Jacobian and Hamilton's equations, at many states and one time; then at a time for each."""
    case, time = CASES[name], 7.7
    field, states = VectorField(case.scene), np.array(case.points)
    momenta = np.tile(MOMENTA, (len(states), 1))
    rates, jacobians = field.rate(states, time), field.jacobian(states, time)
    hamiltonian_rates = field.hamiltonian_rate(states, momenta, time)
    with mpmath.workdps(DIGITS):
        drift, hamiltonian, _ = by_hand(case, mpf(0.18) * mpmath.cos(mpf(0.57) * mpf(time)))
        for (x, v), rate, jacobian, found in zip(case.points, rates, jacobians, hamiltonian_rates, strict=True):
            acceleration = drift(mpf(x), mpf(v))
            h_x, h_v, _, h_r = gradient(hamiltonian, (mpf(x), mpf(v), *map(mpf, MOMENTA)))
            exact = [mpf(0), mpf(1), *gradient(drift, (mpf(x), mpf(v))), mpf(v), -h_x, -h_v]
            assert max(relative_errors([*jacobian.ravel(), found[0], *found[2:]], exact)) <= TOLERANCE
            assert rate[0] == v
            for value, target in ((rate[1], acceleration), (found[1], h_r)):  # the terms of a force may cancel
                assert abs(mpf(value) - target) <= TOLERANCE * max(1, abs(target))
    np.testing.assert_array_equal(field.rate(states[0], time), rates[0])
    np.testing.assert_array_equal(field.jacobian(states[None], time), jacobians[None])
    times = np.linspace(0.0, 5.0, len(states))
    alone = [field.hamiltonian_rate(*each) for each in zip(states, momenta, times, strict=True)]
    np.testing.assert_array_equal(field.hamiltonian_rate(states, momenta, times), alone)


def test_the_force_of_each_excitation():
    forces = vk.Harmonic(0.18, 0.57, 0.4), vk.Constant(0.2), vk.Harmonic(0.3, 1.14)
    field = VectorField(vk.Oscillator(natural_frequency=1.1, damping_ratio=0.03, excitations=forces))
    with mpmath.workdps(DIGITS):
        for t in (0.0, 0.3, 7.7):
            first_tone = mpf(0.18) * mpmath.cos(mpf(0.57) * mpf(t) + mpf(0.4))
            second_tone = mpf(0.3) * mpmath.cos(mpf(1.14) * mpf(t))
            for index, exact in enumerate((first_tone, mpf(0.2), second_tone)):
                assert abs(field.excitation(index, t) - exact) <= 4e-16


@pytest.mark.parametrize("name", CASES)
def test_noise(name):
    """Amplitude √D g, and its slope in v where it has one."""
    case = CASES[name]
    module, _ = compiled(name, Flow.NOISY)
    theta = theta_of(case.scene)

    def size(x, v):
        return mpmath.sqrt(mpf(0.013)) * case.amplitude(x, v)

    with mpmath.workdps(DIGITS):
        for x, v in case.points:
            exact, slope = size(mpf(x), mpf(v)), first(size, (mpf(x), mpf(v)), 1)
            assert max(relative_errors([module.amplitude(x, v, theta)], [exact])) <= TOLERANCE
            if case.amplitude is one:
                assert "def slope" not in kernel_for(case.scene, Flow.NOISY, vk.RK4()).source
            else:
                assert max(relative_errors([module.slope(x, v, theta)], [slope])) <= TOLERANCE


def test_forcing():
    module, _ = compiled("hertz", Flow.NOISY)
    theta = theta_of(CASES["hertz"].scene)
    with mpmath.workdps(DIGITS):
        for t in (0.0, 0.3, 7.7):
            exact = mpf(0.18) * mpmath.cos(mpf(0.57) * mpf(t))
            assert abs(module.forcing(t, theta) - exact) <= 4e-16

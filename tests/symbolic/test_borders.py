"""Poles and edges of domains are found from formulas; what is no border is not taken for one."""

import math

import pytest
import sympy

import vibrokit as vk
from tests.scenes import scene
from vibrokit.kernels.choice import ensemble_stepper
from vibrokit.kernels.kernel import kernel_for
from vibrokit.parts.formula_expression import expression
from vibrokit.symbolic.borders import borders_of
from vibrokit.symbolic.flow_kind import Flow

X, V = sympy.symbols("x v", real=True)
NAMES = {name: sympy.Symbol(name, real=True) for name in ("a", "b", "c", "d", "h", "k", "n")} | {"x": X, "v": V}
STEPPERS = (vk.RK4(), vk.RK8(), vk.Order8())


def borders(formula):
    """The gauges of a formula, each with its sign chosen by SymPy's order."""
    found = borders_of(expression(formula, NAMES), (X, V))
    return {(str(max(b.gauge, -b.gauge, key=str)), b.pole) for b in found}


@pytest.mark.parametrize(
    ("formula", "gauges"),
    [
        ("k*x - a/(h - x)**2", {("h - x", True)}),
        ("a/(h - x)**2 - a/(h + x)**2", {("h - x", True), ("h + x", True)}),
        ("a/(h**2 - 2*h*x + x**2)", {("h - x", True)}),  # a double zero changes no sign before it is factored
        ("x/(1 - x**2/h**2)", {("h - x", True), ("h + x", True)}),
        ("a/x**3 - b/x**9", {("x", True)}),
        ("a/abs(h - x)**2.5", {("h - x", True)}),
        ("log(abs(x))", {("x", True)}),
        ("tan(k*x)", {("cos(k*x)", True)}),
        ("1/(1 - abs(x))", {("Abs(x) - 1", True)}),
        ("1/(h - x - b*v)", {("b*v - h + x", True)}),
        ("1/(1 - v)", {("v - 1", True)}),
        ("x**-1.5", {("x", False)}),
        ("log(h + x)", {("h + x", False)}),
        ("x/sqrt(1 - x**2)", {("x**2 - 1", False)}),
        ("x**(1/3)", {("x", False)}),
        ("sin(x)/x + 1/(2 - x)", {("x - 2", True)}),
    ],
)
def test_borders(formula, gauges):
    expected = {
        (str(max((g := sympy.sympify(text, {s: NAMES[s] for s in NAMES})), -g, key=str)), p) for text, p in gauges
    }
    assert borders(formula) == expected


@pytest.mark.parametrize(
    "formula",
    [
        "k*x + x**3", "1/(1 + x**2)", "1/(1 + x + x**2)", "x/sqrt(x**2 + v**2)", "a/max(d - x, 0.3)**2", "1/cosh(x)",
        "1/max(abs(x), 1e-3)", "sqrt(abs(x))", "k*abs(x)**n*sign(x)", "sin(x)/x", "(1 - cos(x))/x**2", "tanh(k*x)/x",
        "(x**2 - 1)/(x - 1)", "x*log(abs(x))", "x/abs(x)", "x/tanh(x)", "v/abs(v)", "exp(-x**2)/(2 + sin(x))",
    ],
)  # fmt: skip
def test_no_borders(formula):
    assert not borders(formula)


def test_a_guard_that_sympy_cannot_judge_is_no_border_at_its_value():
    """The attraction of a cantilever's tip (San Paulo & García 2002) is cut off at the distance a₀ of two atoms."""
    spring = vk.CustomSpring("w2*x - a/max(d-x,a0)**2", w2=3.55e12, a=2.960881e-17, d=8.5e-9, a0=0.3e-9)
    model = vk.Oscillator(natural_frequency=1.885e6, damping_ratio=1 / 600, spring=spring).model
    assert not model.domain
    assert not model.conditions
    assert model.domain.around(0.0) == (-math.inf, math.inf)


@pytest.mark.parametrize("stepper", STEPPERS, ids=lambda stepper: stepper.name)
@pytest.mark.parametrize("formula", ["x + x**3", "x/(1 + x**2)", "x + sin(x)/x", "x/sqrt(1 + x**2)"])
def test_scenes_without_poles_have_no_trace_of_them(formula, stepper):
    source = kernel_for(scene(spring=vk.CustomSpring(formula)), Flow.STATE, stepper).scene.source
    assert "crossed" not in source
    assert "BORDERED = False" in source


@pytest.mark.parametrize("stepper", STEPPERS, ids=lambda stepper: stepper.name)
def test_scenes_with_poles_watch_them(stepper):
    source = kernel_for(scene(spring=vk.CustomSpring("x - 0.1/(1 - x)**2")), Flow.STATE, stepper).scene.source
    assert "crossed" in source


def intervals(formula, low=-math.inf, high=math.inf, stop=(), **values):
    return scene(*stop, spring=vk.CustomSpring(formula, **values)).model.domain.intervals(low, high)


def test_intervals_follow_the_parameters():
    assert intervals("x - a/(g - x)**2", a=1.0, g=2.5) == [(-math.inf, 2.5), (2.5, math.inf)]
    assert intervals("x - a/(g - x)**2", a=1.0, g=2.5, low=-1.0, high=1.0) == [(-1.0, 1.0)]
    assert intervals("sqrt(b - x**2)", b=4.0) == [pytest.approx((-2.0, 2.0))]
    assert intervals("log(x)") == [(0.0, math.inf)]
    half = 0.5 * math.pi
    assert intervals("tan(x)", low=-4.0, high=2.0) == [
        pytest.approx(each) for each in ((-4.0, -half), (-half, half), (half, 2.0))
    ]
    place = intervals("x/(exp(x) - 3)", low=-9.0, high=9.0)[0][1]
    assert place == pytest.approx(math.log(3.0), rel=1e-14)
    assert intervals("x/(exp(x) - 3)", low=-1.0, high=place) == [(-1.0, place)]  # as a region that ends at it


def test_the_interval_around_a_place():
    domain = scene(spring=vk.CustomSpring("1/(x - 1) + 1/(x + 2)")).model.domain
    assert domain.around(0.0) == pytest.approx((-2.0, 1.0))
    assert domain.around(1.0) == pytest.approx((1.0, math.inf))  # at a border: that on the right
    assert scene(spring=vk.CustomSpring("log(x - 3)")).model.domain.around(0.0) == pytest.approx((3.0, math.inf))


def test_a_law_ends_where_a_stop_is_full():
    stop = vk.Barrier(vk.CustomLaw("k*depth/(1 - depth/full)", k=10.0, full=0.1), -0.5, "left")
    (low, high), *_ = scene(stop).model.domain.intervals(-0.7, 1.0)[1:]
    assert (low, high) == pytest.approx((-0.6, 1.0))


def test_the_model_shows_where_forces_have_values():
    model = scene(spring=vk.CustomSpring("x - a/(g - x)**2", a=1.0, g=2.5), noise=vk.WhiteNoise(1e-3)).model
    assert str(model).splitlines()[-1].endswith("≠ 0")
    assert r"\neq" in model.latex
    assert "≠" not in str(scene(spring=vk.CustomSpring("x + x**3"), noise=vk.WhiteNoise(1e-3)).model)


def test_a_guard_at_its_value_leaves_fixed_steps():
    guarded = vk.CustomSpring("x - a/max(1 - x, least)**2", a=0.1, least=0.2)
    assert isinstance(ensemble_stepper(scene(spring=guarded), Flow.STATE), vk.RK4)
    assert isinstance(ensemble_stepper(scene(spring=vk.CustomSpring("x - a/(1 - x)**2", a=0.1)), Flow.STATE), vk.Order8)


def test_poles_of_the_noise_end_noisy_motion_only():
    osc = scene(noise=vk.StateDependentNoise(1e-3, "1/(2 - x)"))
    assert not osc.model.borders
    assert [border.pole for border in osc.model.noise_borders] == [True]
    assert "crossed" in kernel_for(osc, Flow.NOISY, vk.RK4()).scene.source
    assert "crossed" not in kernel_for(osc, Flow.STATE, vk.RK4()).scene.source

"""The derived equations are the paper's (20)-(22), typed in by hand, in each region of the motion.

The paper's (2) prints -k_l (x + b_l)^(3/2) for the left stop; both stops push the mass back, so here it is
+k_l (-b_l - x)^(3/2). Its b_l > 0 is the distance to the left stop: the stop's position is -b_l.
"""

import pytest
import sympy
from sympy import Rational, cos, symbols

import vibrokit as vk

q1, q2, p1, p2, t = symbols("q1 q2 p1 p2 t", real=True)
zeta, omega_n, f0, f1, omega, k_l, k_r, b_l, b_r = symbols("zeta omega_n f0 f1 omega k_l k_r b_l b_r", positive=True)
depth = sympy.Symbol("depth", positive=True)

LAWS = {"hertz": (vk.Hertz, Rational(3, 2)), "linear": (vk.Linear, Rational(1))}
REGIONS = ("apart", "right", "left")


def paper_force(region, power):
    """F(q1) of (2), both stops pushing back."""
    return {"apart": sympy.Integer(0), "right": -k_r * (q1 - b_r) ** power, "left": k_l * (-b_l - q1) ** power}[region]


def paper_acceleration(region, power):
    return -(omega_n**2) * q1 - 2 * zeta * omega_n * q2 + paper_force(region, power) + f0 * cos(omega * t) + f1


def paper_hamiltonian(region, power):
    """(20)"""
    return p2**2 / 2 + p1 * q2 + paper_acceleration(region, power) * p2


def paper_equations(region, power):
    """(21)"""
    slope = sympy.diff(paper_force(region, power), q1)
    return {
        "x": q2,
        "v": paper_acceleration(region, power) + p2,
        "p_1": (omega_n**2 - slope) * p2,
        "p_2": -p1 + 2 * zeta * omega_n * p2,
    }


PAPER_ACTION_RATE = p2**2 / 2  # (22)


def scene(law):
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.01,
        barriers=(vk.Barrier(law(50.0), 0.5, "right"), vk.Barrier(law(40.0), -0.4, "left")),
        excitations=(vk.Harmonic(0.18, 0.57), vk.Constant(0.2)),
        noise=vk.WhiteNoise(2e-5),
    )


def in_the_paper_s_words(model, expression, region):
    """Rename our symbols to the paper's, and keep the branch of each stop that holds in a region."""
    ours = dict(zip(model.state + model.momenta, (q1, q2, p1, p2), strict=True)) | {model.time: t}
    names = {
        "natural_frequency": omega_n,
        "damping_ratio": zeta,
        "barriers.0.position": b_r,
        "barriers.0.law.stiffness": k_r,
        "barriers.1.position": -b_l,
        "barriers.1.law.stiffness": k_l,
        "excitations.0.amplitude": f0,
        "excitations.0.frequency": omega,
        "excitations.0.phase": sympy.Integer(0),
        "excitations.1.force": f1,
    }
    ours |= {model.symbols[path]: name for path, name in names.items()}
    place = {"apart": (b_r - b_l) / 2, "right": b_r + depth, "left": -b_l - depth}[region]
    chosen = expression.xreplace(ours).replace(
        lambda node: isinstance(node, sympy.Piecewise), lambda node: branch(node, place)
    )
    return chosen.subs(q1, place)


def branch(piecewise, place):
    """The value of a stop's force where q1 is at `place`; b_l, b_r, depth are positive."""
    for value, condition in piecewise.args:
        holds = condition
        for node in condition.atoms(sympy.core.relational.Relational):
            holds = holds.xreplace({node: node.func(sympy.expand((node.lhs - node.rhs).subs(q1, place)), 0)})
        if holds == sympy.true:
            return value
        assert holds == sympy.false, f"{holds} is undecided"
    raise AssertionError(piecewise)


@pytest.fixture(scope="module", params=LAWS)
def case(request):
    law, power = LAWS[request.param]
    return scene(law).model, power


def difference(model, ours, paper, region):
    place = {"apart": (b_r - b_l) / 2, "right": b_r + depth, "left": -b_l - depth}[region]
    return sympy.simplify(in_the_paper_s_words(model, ours, region) - paper.subs(q1, place))


@pytest.mark.parametrize("region", REGIONS)
def test_hamiltonian(case, region):
    model, power = case
    assert difference(model, model.hamiltonian, paper_hamiltonian(region, power), region) == 0


@pytest.mark.parametrize("region", REGIONS)
def test_hamilton_s_equations(case, region):
    model, power = case
    paper = paper_equations(region, power)
    assert {str(variable) for variable in model.equations} == set(paper)
    for variable, rate in model.equations.items():
        assert difference(model, rate, paper[str(variable)], region) == 0, variable


@pytest.mark.parametrize("region", REGIONS)
def test_equations_follow_from_the_shown_hamiltonian(case, region):
    model, _ = case
    h = model.hamiltonian
    derived = {q: sympy.diff(h, p) for q, p in zip(model.state, model.momenta, strict=True)}
    derived |= {p: -sympy.diff(h, q) for q, p in zip(model.state, model.momenta, strict=True)}
    for variable, rate in model.equations.items():
        assert sympy.simplify(in_the_paper_s_words(model, rate - derived[variable], region)) == 0


def test_action_rate(case):
    model, _ = case
    assert sympy.simplify(in_the_paper_s_words(model, model.action_rate, "apart") - PAPER_ACTION_RATE) == 0


def test_action_rate_is_the_lagrangian_along_the_equations(case):
    model, _ = case
    legendre = sum(p * model.equations[q] for q, p in zip(model.state, model.momenta, strict=True)) - model.hamiltonian
    for region in REGIONS:
        assert sympy.simplify(in_the_paper_s_words(model, legendre - model.action_rate, region)) == 0


@pytest.mark.parametrize("region", ["right", "left"])
def test_both_stops_push_the_mass_back(case, region):
    """The sign that (2) gets wrong under the 3/2 power, where it would not even be real."""
    model, _ = case
    acceleration = in_the_paper_s_words(model, model.drift[1], region)
    apart = paper_acceleration("apart", 1).subs(q1, {"right": b_r + depth, "left": -b_l - depth}[region])
    push = sympy.simplify(acceleration - apart)
    assert push.is_negative if region == "right" else push.is_positive

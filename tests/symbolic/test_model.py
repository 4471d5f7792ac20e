"""What the model shows: equations as a person would write them, in text and in LaTeX, and what it derives of laws."""

import pytest
import sympy

import vibrokit as vk
from tests.scenes import scene
from vibrokit.errors import DerivationError

RIGHT = vk.Barrier(vk.Hertz(50.0), 0.5, "right")
LEFT = vk.Barrier(vk.Hertz(50.0), -0.5, "left")
FORCES = (vk.Harmonic(0.18, 0.57), vk.Constant(0.2))


@pytest.fixture(scope="module")
def paper():
    return vk.load_scene("hertz-0.570").model


def test_text(paper):
    assert str(paper).splitlines() == [
        "x' = v",
        "v' = f_0*cos(omega*t + phi) + f_1 + p_2 + (k_l*(b_l - x)**(3/2) if x < b_l else 0) + "
        "(-k_r*(x - b_r)**(3/2) if x > b_r else 0) - omega_n**2*x - 2*omega_n*v*zeta",
        "p_1' = omega_n**2*p_2 - p_2*(-3*k_l*sqrt(b_l - x)/2 if x < b_l else 0) - "
        "p_2*(-3*k_r*sqrt(x - b_r)/2 if x > b_r else 0)",
        "p_2' = 2*omega_n*p_2*zeta - p_1",
        "S' = p_2**2/2",
        "H = p_1*v + p_2**2/2 + p_2*(f_0*cos(omega*t + phi) + f_1 + (k_l*(b_l - x)**(3/2) if x < b_l else 0) + "
        "(-k_r*(x - b_r)**(3/2) if x > b_r else 0) - omega_n**2*x - 2*omega_n*v*zeta)",
    ]


def test_latex(paper):
    latex = paper._repr_latex_()
    assert latex.startswith(r"$\displaystyle \begin{aligned}\dot{x} &= v\\ \dot{v} &= ")
    assert latex.endswith(r"\dot{S} &= \frac{p_{2}^{2}}{2}\end{aligned}$")
    assert r"- k_{r} \left(x - b_{r}\right)^{\frac{3}{2}} & \text{for}\: x > b_{r} \\0 & \text{otherwise}" in latex
    assert r"k_{l} \left(b_{l} - x\right)^{\frac{3}{2}} & \text{for}\: x < b_{l}" in latex
    assert latex.count(r"\begin") == latex.count(r"\end")
    assert latex.count("{") == latex.count("}")


def test_text_is_arithmetic_that_agrees_with_the_expressions(paper):
    """The text, run as Python, gives the numbers of the expressions."""
    values = {"omega_n": 1.1, "zeta": 0.2, "b_r": 0.5, "k_r": 50.0, "b_l": -0.4, "k_l": 30.0, "f_0": 0.18}
    values |= {"omega": 0.57, "phi": 0.3, "f_1": 0.2, "t": 0.7, "v": 0.9, "p_1": 0.01, "p_2": -0.03}
    texts = dict(line.split("' = ") for line in str(paper).splitlines() if "'" in line)
    functions = {"cos": lambda a: float(sympy.cos(a)), "sqrt": lambda a: a**0.5}
    for x in (0.0, 0.62, -0.71):
        point = values | {"x": x}
        for variable, rate in paper.equations.items():
            exact = rate.subs({symbol: point[str(symbol)] for symbol in rate.free_symbols})
            assert eval(texts[str(variable)], functions, point) == pytest.approx(float(exact), rel=1e-13)


def test_without_noise_the_equations_of_motion_and_no_momenta():
    model = scene(RIGHT, excitations=FORCES).model
    assert [str(variable) for variable in model.equations] == ["x", "v"]
    assert model.momenta == ()
    assert "p_" not in str(model)
    assert "H =" not in str(model)
    assert model.diffusion == sympy.zeros(2)


def test_without_forcing_no_time():
    model = scene(RIGHT, LEFT, noise=vk.WhiteNoise(1e-3)).model
    assert model.forcing == 0
    assert model.time not in model.hamiltonian.free_symbols


def test_a_clamped_law_says_when_it_pushes():
    model = scene(vk.Barrier(vk.KelvinVoigt(50.0, 3.0), 0.5, "right")).model
    assert "if (x > b) & (c*v + k*(x - b) > 0) else 0" in str(model)
    adhesive = scene(vk.Barrier(vk.KelvinVoigt(50.0, 3.0), 0.5, "right", adhesive=True)).model
    assert "& (" not in str(adhesive)


@pytest.mark.parametrize(
    ("law", "derived"),
    [
        (vk.Hertz(50.0), {"conservative": True, "jumps": False, "clamped": False, "root": 2, "smooth": True}),
        (vk.Linear(50.0), {"conservative": True, "jumps": False, "clamped": False, "root": 1, "smooth": True}),
        (
            vk.CustomLaw("k*depth**1.5*(1 + c*rate)", k=50.0, c=0.2),
            {"conservative": False, "jumps": False, "clamped": True, "root": 2, "smooth": True},
        ),
        (
            vk.KelvinVoigt(50.0, 0.2),
            {"conservative": False, "jumps": True, "clamped": True, "root": 1, "smooth": True},
        ),
        (vk.CustomLaw("k*depth**1.3", k=50.0), {"conservative": True, "jumps": False, "smooth": False}),
    ],
    ids=["hertz", "linear", "hunt-crossley", "kelvin-voigt", "power 1.3"],
)
def test_what_is_derived_of_a_law(law, derived):
    contact = scene(vk.Barrier(law, 0.5, "right")).model.contacts[0]
    assert {name: getattr(contact, name) for name in derived} == derived


def test_jacobian_of_the_drift():
    model = scene(spring=vk.CubicSpring(-1.0, 1.0)).model
    x, _ = model.state
    alpha, beta = model.symbols["spring.linear"], model.symbols["spring.cubic"]
    omega_n, zeta = model.symbols["natural_frequency"], model.symbols["damping_ratio"]
    assert sympy.simplify(model.jacobian - sympy.Matrix([[0, 1], [-alpha - 3 * beta * x**2, -2 * zeta * omega_n]])) == (
        sympy.zeros(2)
    )


def test_diffusion_of_state_dependent_noise():
    model = scene(noise=vk.StateDependentNoise(1e-3, "1 + c*x**2", c=0.5)).model
    x, _ = model.state
    c = model.symbols["noise.c"]
    assert sympy.simplify(model.diffusion - sympy.diag(0, (1 + c * x**2) ** 2)) == sympy.zeros(2)


def test_symbols_are_distinct_and_tell_sides_and_indices():
    model = scene(RIGHT, LEFT, excitations=(*FORCES, vk.Harmonic(0.1, 1.14))).model
    names = [str(symbol) for symbol in model.symbols.values()]
    assert len(set(names)) == len(names)
    assert {"k_r", "k_l", "b_r", "b_l", "f_0", "f_1", "f_2", "omega_0", "omega_2"} <= set(names)


def test_constants_named_like_variables_of_the_equations_are_renamed():
    model = scene(spring=vk.CustomSpring("a*x + S*x**3 + t*v", a=1.0, S=0.3, t=0.1)).model
    assert len({*model.symbols.values(), *model.state, model.time}) == len(model.symbols) + 3


def own_law(force):
    class Law(vk.ContactLaw):
        stiffness: float = vk.parameter("k", "s^-2", minimum=0)

    Law.force = force
    Law.__abstractmethods__ = frozenset()
    return Law(1.0)


@pytest.mark.parametrize(
    ("force", "said"),
    [
        (lambda self, depth, rate: 1.0 if depth > 1 else 0.0, "TypeError.*without branches"),
        (lambda self, depth, rate: None, "Law.force"),
        (lambda self, depth, rate: "self.stiffness", "Law.force"),
        (lambda self, depth, rate: sympy.Symbol("c") * depth, "uses c"),
        (lambda self, depth, rate: 1 / 0, "ZeroDivisionError"),
    ],
    ids=["branch", "nothing", "text", "stranger", "division"],
)
def test_formulas_that_cannot_be_derived(force, said):
    with pytest.raises(DerivationError, match=said):
        _ = scene(vk.Barrier(own_law(force), 0.5, "right")).model.drift


def test_a_force_that_varies_must_have_a_period():
    class Ramp(vk.Excitation):
        slope: float = vk.parameter("r", "m s^-3")

        def force(self, t):
            return self.slope * t

        @property
        def period(self):
            return None

    with pytest.raises(DerivationError, match=r"Ramp\.period is None.*depends on time.*math\.inf"):
        _ = scene(excitations=[Ramp(0.1)]).model.drift

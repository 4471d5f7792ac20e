"""For every check there is a part that is broken in just that way, and the check catches it."""

import dataclasses

import pytest
import sympy

from tests.conformance import broken, broken_forcing
from tests.layers import long
from vibrokit import Constant, CubicSpring, DryFriction, Harmonic, Hertz, ParametricStiffness, WhiteNoise
from vibrokit.errors import UnknownNameError
from vibrokit.kernels import kernel, store
from vibrokit.symbolic import equations
from vibrokit.testing import (
    ConformanceError,
    check,
    check_contact_law,
    contact_law_checks,
    excitation_checks,
    friction_checks,
    noise_model_checks,
    part_checks,
    spring_checks,
)

KINDS = [
    (contact_law_checks, broken.LAWS),
    (spring_checks, broken.SPRINGS),
    (friction_checks, broken.FRICTIONS),
    (excitation_checks, [*broken.EXCITATIONS, *broken_forcing.EXCITATIONS]),
    (noise_model_checks, broken.NOISE_MODELS),
]
CASES = [
    pytest.param(
        checks, name, part, id=f"{getattr(part, '__name__', part)}-{name}",
        marks=[pytest.mark.slow] * (part is broken.DependsOnTheProcess),  # no cache has its code
    )
    for checks, cases in KINDS
    for name, part in cases
]  # fmt: skip


def failure(perform):
    try:
        perform()
    except ConformanceError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(("checks", "name", "part"), CASES)
def test_caught(checks, name, part):
    by_name = dict(checks(part))
    with pytest.raises(ConformanceError) as caught:
        by_name[name]()
    text = str(caught.value)
    assert text[0].isupper(), text
    assert text.endswith("."), text
    assert name == "formula" or text != failure(by_name["formula"])  # the check is reached


@pytest.mark.parametrize(("name", "law", "wrong"), broken.MISLED, ids=[name for name, *_ in broken.MISLED])
def test_a_wrong_derivation_is_caught(name, law, wrong, tmp_path, monkeypatch):
    """With a cache of its own: the code is that of no scene."""
    derived = equations.derive_contact
    monkeypatch.setattr(equations, "derive_contact", lambda *of: dataclasses.replace(derived(*of), **wrong))
    monkeypatch.setattr(store, "cache_directory", lambda: tmp_path)
    kernel._KERNELS.clear()
    with pytest.raises(ConformanceError, match="deriv"):
        dict(contact_law_checks(law))[name]()
    kernel._KERNELS.clear()


@pytest.mark.parametrize(
    ("checks", "part"), [(contact_law_checks, Hertz), (spring_checks, CubicSpring), (noise_model_checks, WhiteNoise)]
)
def test_a_wrong_derivative_is_caught(checks, part, monkeypatch):
    """SymPy derives all formulas that are allowed, so that it is misled here."""
    derivative = part_checks.derivative
    monkeypatch.setattr(part_checks, "derivative", lambda *given: derivative(*given) + sympy.Rational(1, 10**9))
    with pytest.raises(ConformanceError, match="by finite differences"):
        dict(checks(part))["derivatives"]()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("checks", "part"),
    [
        (contact_law_checks, Hertz),
        (spring_checks, CubicSpring),
        (excitation_checks, Constant),
        (noise_model_checks, WhiteNoise),
    ],
)
def test_wrong_code_is_caught(checks, part, monkeypatch):
    """Code is made from the formula, so that here another formula is the reference."""
    expression = part_checks.PartChecks.expression
    other = sympy.Rational(10**9 + 1, 10**9)
    monkeypatch.setattr(part_checks.PartChecks, "expression", lambda *given: other * expression(*given))
    with pytest.raises(ConformanceError, match=r"^Compiled, "):
        dict(checks(part))["compiled"]()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("checks", "part"),
    [
        (contact_law_checks, Hertz),
        (spring_checks, CubicSpring),
        (friction_checks, DryFriction),
        (excitation_checks, Harmonic),
        (excitation_checks, ParametricStiffness),
    ],
)
def test_a_wrong_motion_is_caught(checks, part, monkeypatch):
    """The motion is that of the formula, so that here another formula is the reference."""
    expression = part_checks.PartChecks.expression
    monkeypatch.setattr(part_checks.PartChecks, "expression", lambda *given: 1.001 * expression(*given))
    with pytest.raises(ConformanceError, match="but its formula gives"):
        dict(checks(part))["motion"]()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "column", "rates", "said"),
    [
        long("motion", (0, 0, 0, 1), (1, 1.001), "but its formula gives"),
        ("compiled", (0, 0, 0, 1), (1, 1.001), "the rate of w "),
        ("compiled", (0, 0, 1, 0), (1, 1), "the amplitude of NarrowBand"),
        ("diffusion", (0, 1, 0, 0), (1, 1), "the square of its amplitude"),
    ],
)
def test_wrong_extra_states_are_caught(name, column, rates, said, tmp_path, monkeypatch):
    """The derivation is misled: the rates are other ones, or the noise drives another state."""
    drift = equations.Equations._extra_drift.func
    amplitude = equations.Equations.amplitude.func
    wrong_drift = lambda of: tuple(r * rate for r, rate in zip(rates, drift(of), strict=True))  # noqa: E731
    wrong_amplitude = lambda of: sympy.Matrix(column) * sum(amplitude(of))  # noqa: E731
    monkeypatch.setattr(equations.Equations, "_extra_drift", property(wrong_drift))
    monkeypatch.setattr(equations.Equations, "amplitude", property(wrong_amplitude))
    monkeypatch.setattr(store, "cache_directory", lambda: tmp_path)
    kernel._KERNELS.clear()
    with pytest.raises(ConformanceError, match=said):
        dict(noise_model_checks(broken_forcing.NarrowBand))[name]()
    kernel._KERNELS.clear()


def test_every_check_of_a_law_has_a_law_that_it_catches():
    caught = (
        {name for name, _ in broken.LAWS} | {name for name, *_ in broken.MISLED} | {"derivatives", "compiled", "motion"}
    )
    assert {name for name, _ in contact_law_checks(Hertz)} == caught


@pytest.mark.parametrize(
    ("checks", "good", "caught"),
    [
        (spring_checks, CubicSpring, broken.SPRINGS),
        (excitation_checks, Constant, [*broken.EXCITATIONS, *broken_forcing.EXCITATIONS]),
        (noise_model_checks, WhiteNoise, broken.NOISE_MODELS),
    ],
)
def test_every_check_of_another_kind_has_a_part_that_it_catches(checks, good, caught):
    general = {name for name, _ in broken.LAWS} | {"derivatives", "compiled", "motion"}  # shared by all kinds, one code
    assert {name for name, _ in checks(good)} <= {name for name, _ in caught} | general


def test_all_failures_are_reported_at_once_and_one_cause_once():
    with pytest.raises(
        ConformanceError, match=r"UsesStrangeSymbol, a contact law, fails \d+ of \d+ checks\.\nform"
    ) as caught:
        check_contact_law(broken.UsesStrangeSymbol)
    assert str(caught.value).count("temperature") == 1
    assert "not checked, because 'formula' failed." in str(caught.value)


def test_the_wrong_kind_is_refused():
    with pytest.raises(TypeError, match="subclass of ContactLaw, got <class"):
        check_contact_law(CubicSpring)


def test_unknown_name_suggests_the_nearest():
    with pytest.raises(UnknownNameError, match="no part 'herz' to check; the nearest is 'hertz'"):
        check("herz")

"""Every registered part, built in or of an installed plug-in, conforms; so do formulas."""

import dataclasses
import math

import pytest

import vibrokit as vk
from tests.conformance.broken_forcing import NarrowBand, SquareWave
from tests.layers import long
from tests.scenes import Coloured
from vibrokit import testing
from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.excitation import Excitation
from vibrokit.parts.friction import Friction
from vibrokit.parts.noise import NoiseModel
from vibrokit.parts.spring import Spring
from vibrokit.registry import Group, load_all
from vibrokit.results.rated import RatedResult

pytestmark = pytest.mark.slow

LONG = ("pulse-train-motion", "pulse-train-period", "filtered-compiled")


def marks(part, name, check):
    """A second process takes seconds to import: of one contact law and one noise model it is no long test.

    Parts of plug-ins take longer than a group may; each plug-in's own tests check one.
    """
    brief = name in ("hertz", "white") if check == "another process" else f"{name}-{check}" not in LONG
    return () if part.is_ours() and brief else pytest.mark.long


KINDS = [
    (Group.CONTACT_LAWS, ContactLaw, testing.contact_law_checks),
    (Group.SPRINGS, Spring, testing.spring_checks),
    (Group.FRICTIONS, Friction, testing.friction_checks),
    (Group.EXCITATIONS, Excitation, testing.excitation_checks),
    (Group.NOISE_MODELS, NoiseModel, testing.noise_model_checks),
]
REGISTERED = [
    pytest.param(make, id=f"{group.noun}-{name}-{check}", marks=marks(part, name, check))
    for group, kind, checks in KINDS
    for name, part in load_all(group, kind).items()
    for check, make in checks(part, rng=1)
]


@pytest.mark.parametrize("make", REGISTERED)
def test_registered(make):
    make()


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, id=name) for name, kind in load_all(Group.ANALYZERS, Analyzer).items()]
)
def test_analyzers_answer_what_an_assessment_asks(kind):
    fields = {field.name: field for field in dataclasses.fields(kind)}
    assert kind.takes_intensities == ("intensities" in fields)
    if kind.takes_intensities:
        assert issubclass(kind.result, RatedResult)
        assert fields["intensities"].default is None
        assert kind(intensities=(2e-3, 1e-3)).intensities == (2e-3, 1e-3)
    for accuracy in (1e-3, 0.03, 0.1, 0.9):
        assert type(kind().for_accuracy(accuracy)) is kind


LAWS = [
    vk.Hertz(stiffness=1e6),
    vk.CustomLaw("k*depth + c*rate", k=20.0, c=0.3),
    vk.CustomLaw("k*(exp(60*depth) - 1)", k=0.5),
    vk.CustomLaw("k*depth**1.3*(1 + c*tanh(rate)/4)", k=20.0, c=1.0),
    vk.CustomLaw("pi*k*depth*exp(1)*sin(depth + pi/7)", k=20.0),
    vk.CustomLaw("k*sqrt(depth) + theta*depth*tanh(rate)", k=20.0, theta=1.0),
    vk.CustomLaw("k*max(depth - gap, 0) + p_1*depth**2 + c0*asin(depth/2)", k=20.0, gap=0.01, p_1=3.0, c0=1.5),
]
SPRINGS = [
    vk.CustomSpring("c0*x + c1*sin(c0*x)*v**2 + p_1*x**3 + f1*cos(v)", c0=1.0, c1=0.3, p_1=0.2, f1=0.1),
    vk.CustomSpring("k*abs(x)*x + max(x, v, 0.1)", k=1.0),
]
NOISES = [vk.StateDependentNoise(1e-2, "1 + a*x*v", a=0.4), vk.StateDependentNoise(1e-2, "2 + cos(depth*x)", depth=0.4)]
EXAMPLES = [
    *((testing.contact_law_checks, part) for part in LAWS[:3]),
    *(long(testing.contact_law_checks, part) for part in LAWS[3:]),
    *((testing.spring_checks, part) for part in SPRINGS),
    *((testing.noise_model_checks, part) for part in NOISES),
]


@pytest.mark.parametrize(("checks", "part"), EXAMPLES, ids=lambda value: repr(value) if "=" in repr(value) else "")
def test_examples(checks, part):
    for name, make in checks(part, rng=2):
        if name != "another process":  # checked for every class above, and slow
            make()


@pytest.mark.long
def test_report_reads_as_a_table():
    report = testing.check("linear")  # a law and a spring
    assert report.passed
    assert report.lines[0] == "Linear, a contact law"
    assert "LinearSpring, a spring" in report.lines
    assert "  ok      leading power: 1" in report.lines


class Pulse(vk.Excitation):
    """An excitation that never repeats."""

    amplitude: float = vk.parameter("f", "m s^-2")
    width: float = vk.parameter("tau", "s", above=0)

    def force(self, t):
        return self.amplitude / (1 + (t / self.width) ** 2)

    @property
    def period(self):
        return math.inf


@pytest.mark.long
def test_excitation_that_never_repeats():
    testing.check_excitation(Pulse)


@pytest.mark.long
def test_excitation_that_jumps():
    testing.check_excitation(SquareWave)


@pytest.mark.long
@pytest.mark.parametrize("noise", [Coloured, NarrowBand])
def test_noise_with_states_of_its_own(noise):
    testing.check_noise_model(noise)

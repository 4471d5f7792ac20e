"""Bad parts and scenes: each is refused with one clear sentence that names what, its value, and what is allowed."""

import math
import os
import subprocess
import sys
from functools import partial

import numpy as np
import pytest

import vibrokit as vk
from tests.refusals import quickest_refusal
from vibrokit.errors import IntegrationError, NoSectionError, ParameterError, SceneError, StepperError, VibrokitError

GOOD = {"natural_frequency": 1.0, "damping_ratio": 0.1}


def scene(**more):
    return vk.Oscillator(**(GOOD | more))


def stop(side, position=0.5, law=None):
    return vk.Barrier(law or vk.Hertz(50.0), position, side)


def refused(kind, make, limit=math.inf):
    """What was said, within `limit` seconds: one line, one sentence or two, ended by a period."""
    said, seconds = quickest_refusal(kind, make)
    assert seconds < limit
    assert "\n" not in said
    assert said.endswith(".")
    assert len(said) < 600
    return said


LOW, POSITIVE = "must be a finite number at least 0", "must be a finite number greater than 0"
NO_NUMBERS = [
    "1", None, [1.0], (1.0,), {"a": 1}, True, 1j, b"1", object(), float, np.ones(3), "9" * 10000, [[[[1]]]] * 9,
]  # fmt: skip


@pytest.mark.parametrize(
    "value", [value for value in NO_NUMBERS if value is not None], ids=lambda value: f"{type(value).__name__}"
)
@pytest.mark.parametrize("name", ["natural_frequency", "damping_ratio", "stiffness", "damping"])
def test_numbers_of_the_scene(name, value):
    said = refused(ParameterError, lambda: scene(**{name: value}))
    assert said.startswith(f"scene: {name} {LOW}, got ")


RELATIVE = "but that is relative to a natural frequency, and the scene has none; give damping (s^-1) in its place."
CUBIC = vk.CubicSpring(linear=1.0, cubic=2.0)


@pytest.mark.parametrize(
    ("numbers", "kind", "said"),
    [
        (
            {"damping": 0.1},
            SceneError,
            "it has neither natural_frequency nor stiffness nor a spring; give one of them, or natural_frequency = 0 "
            "for a mass without a spring.",
        ),
        (
            {"natural_frequency": 1.0},
            SceneError,
            "it has neither damping_ratio nor damping; give one of them, 0 for no damping.",
        ),
        (
            {"natural_frequency": 2.0, "stiffness": 4.0, "damping": 0.1},
            SceneError,
            "natural_frequency = 2 and stiffness = 4 are both given, and stiffness is the square of "
            "natural_frequency; give one of them.",
        ),
        (
            {"natural_frequency": 2.0, "damping_ratio": 0.0, "damping": 0.1},
            SceneError,
            "damping_ratio = 0 and damping = 0.1 are both given, and damping is 2 damping_ratio natural_frequency; "
            "give one of them.",
        ),
        ({"natural_frequency": 0.0, "damping_ratio": 0.1}, ParameterError, f"damping_ratio is 0.1, {RELATIVE}"),
        ({"stiffness": 0.0, "damping_ratio": 0.1}, ParameterError, f"damping_ratio is 0.1, {RELATIVE}"),
        ({"spring": CUBIC, "damping_ratio": 0.1}, ParameterError, f"damping_ratio is 0.1, {RELATIVE}"),
        (
            {"spring": CUBIC, "stiffness": 4.0, "damping": 0.1},
            SceneError,
            "stiffness = 4 is given and a spring besides, CubicSpring, which takes the place of the linear one; give "
            "one of them.",
        ),
    ],
)
def test_numbers_that_do_not_fit_together(numbers, kind, said):
    assert refused(kind, lambda: vk.Oscillator(**numbers)) == f"scene: {said}"


def test_a_name_that_may_be_of_the_scene_or_of_a_part():
    osc = scene(barriers=(stop("right"),))
    assert refused(ParameterError, lambda: osc.replace(stiffness=60.0)) == (
        "scene: 'stiffness' may be that of the scene, in place of natural_frequency, or barriers.0.law.stiffness; give "
        "the full path of the latter, or natural_frequency=None besides for the former."
    )
    assert osc.replace({"barriers.0.law.stiffness": 60.0}).parameters["barriers.0.law.stiffness"] == 60.0
    assert osc.replace(stiffness=60.0, natural_frequency=None).stiffness == 60.0


@pytest.mark.parametrize(
    ("make", "said"),
    [
        *(
            (partial(scene, natural_frequency=bad), f"scene: natural_frequency {LOW}, got {bad:g}.")
            for bad in (-1.0, math.nan, math.inf)
        ),
        *(
            (partial(scene, damping_ratio=bad), f"scene: damping_ratio {LOW}, got {bad:g}.")
            for bad in (-0.01, math.nan, -math.inf)
        ),
        (lambda: vk.Hertz(-50.0), f"Hertz: stiffness {LOW}, got -50."),
        (lambda: vk.Linear(math.nan), f"Linear: stiffness {LOW}, got nan."),
        (lambda: vk.WhiteNoise(-2e-5), f"WhiteNoise: intensity {LOW}, got -2e-05."),
        (lambda: vk.WhiteNoise(math.nan), f"WhiteNoise: intensity {LOW}, got nan."),
        (lambda: vk.Harmonic(0.1, 0.0), f"Harmonic: frequency {POSITIVE}, got 0."),
        (lambda: vk.Harmonic(math.inf, 1.0), "Harmonic: amplitude must be a finite number, got inf."),
        (lambda: vk.SupportMotion(1e-3, -2.0), f"SupportMotion: frequency {POSITIVE}, got -2."),
        (
            lambda: vk.SupportAcceleration(math.nan, 1.0),
            "SupportAcceleration: amplitude must be a finite number, got nan.",
        ),
        (lambda: vk.CustomLaw("k*depth", k=math.nan), "CustomLaw: k must be a finite number, got nan."),
        (lambda: vk.CubicSpring(1.0, "b"), "CubicSpring: cubic must be a finite number, got 'b'."),
    ],
)
def test_ranges(make, said):
    assert refused(ParameterError, make) == said


@pytest.mark.parametrize(
    "changes", [3, "noise", [("damping_ratio", 0.1)], {3: 0.1}, {"": 0.1}, {"ratio": 0.1}, {None: 1}]
)
def test_changes_that_name_no_parameter(changes):
    refused(ParameterError, lambda: scene().replace(changes))


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"damping_ratio": -1.0}, ParameterError),
        ({"noise": 0.1}, SceneError),
        ({"barriers": vk.Hertz(1.0)}, SceneError),
        ({"barriers": [stop("left", 1.0), stop("right", 0.0)]}, SceneError),
        ({"intensity": 0.1}, ParameterError),
        ({"position": 0.1}, ParameterError),
    ],
    ids=str,
)
def test_keywords_of_replace(change, kind):
    refused(kind, lambda: scene(barriers=[stop("left", -0.5), stop("right", 0.5)]).replace(**change))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: scene(barriers=[stop("left", -0.5), stop("left", -0.7)]), "got 2 on the left side, at -0.5, -0.7"),
        (
            lambda: scene(barriers=[stop("left", 0.25), stop("right", -0.75)]),
            "the left stop, at 0.25, is to the right of the right stop, at -0.75",
        ),
        (lambda: scene(barriers=stop("right")), "a single Barrier"),
        (lambda: scene(excitations=vk.Constant(1.0)), "a single Constant"),
    ],
)
def test_parts_that_do_not_fit_together(make, said):
    assert said in refused(SceneError, make)


def test_a_zero_gap_is_legal():
    assert len(scene(barriers=[stop("left", 0.25), stop("right", 0.25)]).barriers) == 2


@pytest.mark.parametrize(
    "value", [3, None, "stop", b"stop", object(), vk.Barrier, vk.Hertz(1.0), [vk.Hertz(1.0)], [[]]]
)
@pytest.mark.parametrize("name", ["barriers", "excitations"])
def test_what_is_no_sequence_of_parts(name, value):
    said = refused(SceneError, lambda: scene(**{name: value}))
    assert said.startswith(f"scene: {name} ")
    assert {"barriers": "Barrier", "excitations": "Excitation"}[name] in said


@pytest.mark.parametrize("value", [0.1, "white", vk.WhiteNoise, [vk.WhiteNoise(0.1)], vk.Hertz(1.0)])
@pytest.mark.parametrize(("name", "kind"), [("noise", "NoiseModel"), ("spring", "Spring")])
def test_what_is_no_part(name, kind, value):
    said = refused(SceneError, lambda: scene(**{name: value}))
    assert said.startswith(f"scene: {name} must be of type {kind}, got ")


ATTACKS = {
    "attribute": "depth.__class__",
    "dunder": "__import__('os').system('touch FILE')",
    "call": "open('FILE', 'w')",
    "getattr": "getattr(depth, 'x')",
    "comprehension": "sum([open('FILE','w') for i in (1,)])",
    "lambda": "(lambda: open('FILE','w'))()",
    "walrus": "(x := open('FILE','w'))",
    "f-string": "f'{open(1)}'",
    "subscript": "().__class__.__bases__[0]",
    "eval": "eval('open(1)')",
    "statement": "depth; import os",
    "newline": "depth\nimport os",
    "null byte": "depth\0",
    "power tower": "9**9**9**9",
    "hidden tower": "((9**60)**60)**60",
    "growing powers": "((((depth**9)**9)**9)**9)**9",
    "factorial": "factorial(99999)",
    "megabyte": "1+" * 500_000 + "1",
    "parentheses": "(" * 100_000 + "1" + ")" * 100_000,
    "signs": "-" * 1_900 + "depth",
    "digits": "9" * 1_900,
    "exponent": "1e999999999",
    "shift": "1 << 10**9",
    "unicode": "ｄｅｐｔｈ",
    "unknown": "stiffness*depth",
    "keyword": "depth if depth else 0",
    "comparison": "depth > 0",
    "text": "'depth'",
    "star": "max(*depth)",
    "keyword argument": "max(depth, key=abs)",
    "imaginary": "1j*depth",
    "division": "1/0*depth",
    "root of a negative": "sqrt(-1)*depth",
}


@pytest.mark.parametrize("text", ATTACKS.values(), ids=ATTACKS)
def test_formulas_that_would_run_code_or_never_end(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = refused(VibrokitError, lambda: vk.CustomLaw(text), limit=0.1)
    assert said.startswith("The formula ")
    assert not os.listdir(tmp_path)


def test_refusing_a_formula_does_not_load_sympy():
    code = (
        "import sys, vibrokit as vk\n"
        "try:\n    vk.CustomLaw('__import__(1)')\n"
        "except ValueError: print('sympy' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


class TestIntegration:
    runaway = scene(spring=vk.CubicSpring(1.0, -1.0))

    def test_a_trajectory_that_runs_away(self):
        with pytest.raises(IntegrationError) as error:
            self.runaway.trajectory((3.0, 1.0), periods=3, stepper=vk.RK4())
        said = str(error.value)
        assert "\n" not in said
        assert said.endswith(".")
        assert f"t = {error.value.time:g}" in said
        assert str(error.value.state) in said
        assert 0.0 < error.value.time < 2.0
        assert all(map(math.isfinite, error.value.state))

    def test_one_of_an_ensemble(self):
        with pytest.raises(IntegrationError, match=r"1 of 3 .* number 1 from \(3\.0, 1\.0\), .* t = 0,.*\.$") as error:
            self.runaway.section_map([[0.0, 0.0], [3.0, 1.0], [0.1, 0.0]], periods=3, stepper=vk.RK4())
        assert error.value.time == 0.0
        assert error.value.state == (3.0, 1.0)

    @pytest.mark.parametrize(
        "states",
        [[[0.0, math.nan]], [[math.inf, 0.0]], "ab", [["a", "b"]], [[1, 2, 3]], [1.0], None, [[[0.0, 0.0]]], {}],
    )
    def test_states(self, states):
        assert "state" in refused(ParameterError, lambda: scene().section_map(states))

    @pytest.mark.parametrize("periods", [-1, 1.5, "2", None, True, math.nan, [1]])
    def test_periods(self, periods):
        said = refused(ParameterError, lambda: scene().section_map([[0.0, 0.0]], periods))
        assert said.startswith("section_map: periods must be a whole number from 0 to 1000000000000000, got ")

    @pytest.mark.parametrize(
        ("arguments", "name"),
        [
            *(({}, "periods or duration"), ({"periods": 1, "duration": 1.0}, "periods or duration")),
            *(({"periods": bad}, "periods") for bad in (0, "2")),
            *(({"duration": bad}, "duration") for bad in (-1.0, math.inf, math.nan)),
            *(({"periods": 1, "samples": bad}, "samples") for bad in (0, 2.5)),
            ({"periods": 1, "start_time": math.nan}, "start_time"),
            ({"periods": 1e12}, "samples"),
        ],
    )
    def test_trajectory_arguments(self, arguments, name):
        said = refused(ParameterError, lambda: scene().trajectory((0.0, 0.0), **arguments))
        assert said.startswith("trajectory: ")
        assert name in said

    def test_noise_that_is_not_there(self):
        said = refused(SceneError, lambda: scene().section_map([[0.0, 0.0]], rng=1))
        assert "no noise" in said

    def test_no_section(self):
        osc = scene(excitations=(vk.Harmonic(0.1, 1.0), vk.Harmonic(0.1, math.e)))
        assert "no common period" in refused(NoSectionError, lambda: osc.section_map([[0.0, 0.0]]))

    @pytest.mark.parametrize("stepper", ["rk4", 256, vk.RK4])
    def test_what_is_no_stepper(self, stepper):
        said = refused(StepperError, lambda: scene().section_map([[0.0, 0.0]], stepper=stepper))
        assert "stepper must be a Stepper" in said
        assert repr(stepper)[:20] in said

    @pytest.mark.parametrize("steps", [0, -1, 2.5, "256", True, None, 10**9])
    def test_steps(self, steps):
        assert refused(StepperError, lambda: vk.RK4(steps=steps)).startswith("RK4: steps must be ")

"""Parts: abstract or final, frozen, checked, and all that a user's own part gets for nothing."""

import copy
import dataclasses
import math
import pickle
from abc import ABC

import numpy as np
import pytest
import sympy

import vibrokit as vk
from vibrokit.errors import ArgumentError, FormulaError, ParameterError, SceneError, VibrokitError
from vibrokit.parts.formula_part import FormulaPart
from vibrokit.parts.part import Part

PARTS = {
    "hertz": vk.Hertz(stiffness=50.0),
    "linear": vk.Linear(stiffness=1e-3),
    "custom law": vk.CustomLaw("k*depth**1.5 + c*depth*rate", k=50.0, c=0.1),
    "linear spring": vk.LinearSpring(stiffness=-2.0),
    "cubic spring": vk.CubicSpring(linear=-1.0, cubic=1.0),
    "custom spring": vk.CustomSpring("x + e*x**5", e=0.2),
    "harmonic": vk.Harmonic(amplitude=0.18, frequency=0.57, phase=0.1),
    "constant": vk.Constant(force=-0.2),
    "white noise": vk.WhiteNoise(intensity=2e-5),
    "state-dependent noise": vk.StateDependentNoise(1e-4, "1 + c*x**2", c=0.5),
}
parts = pytest.mark.parametrize("part", PARTS.values(), ids=PARTS)


class Cubic(vk.ContactLaw):
    """As a user writes one."""

    stiffness: float = vk.parameter("k", "m^-2 s^-2", minimum=0)
    bias: float = vk.parameter("e", "", minimum=-1, maximum=1, default=0.5)

    def force(self, depth, rate):
        return self.stiffness * depth**3 * (1 + self.bias)


@dataclasses.dataclass(frozen=True)
class Decorated(vk.ContactLaw):
    """The same with an explicit decorator."""

    stiffness: float = vk.parameter("k", "m^-2 s^-2", minimum=0)
    bias: float = vk.parameter("e", "", minimum=-1, maximum=1, default=0.5)

    def force(self, depth, rate):
        return self.stiffness * depth**3 * (1 + self.bias)


OWN = pytest.mark.parametrize("own", [Cubic, Decorated])


class TestAbstractOrFinal:
    @parts
    def test_no_finished_part_can_be_inherited_from(self, part):
        finished = type(part)
        with pytest.raises(TypeError) as refused:
            type("Mine", (finished,), {})
        said = str(refused.value)
        kinds = (vk.ContactLaw, vk.Spring, vk.Tone, vk.Excitation, vk.StationaryNoise, vk.NoiseModel)
        kind = next(base for base in kinds if isinstance(part, base))
        assert said.startswith(f"Mine inherits from {finished.__name__}, ")
        assert f"inherit from {kind.__name__} " in said

    def test_neither_can_a_user_s_own(self):
        with pytest.raises(TypeError, match=r"Mine inherits from Cubic.*inherit from ContactLaw"):
            type("Mine", (Cubic,), {})

    @pytest.mark.parametrize("kind", [Part, vk.ContactLaw, vk.Spring, vk.Excitation, vk.NoiseModel])
    def test_abstract_parts_make_no_objects(self, kind):
        with pytest.raises(TypeError):
            kind(1.0)

    def test_a_part_without_its_formula_stays_abstract(self):
        class Unfinished(vk.ContactLaw):
            stiffness: float = vk.parameter("k", "s^-2")

        with pytest.raises(TypeError, match=r"does not define force"):
            Unfinished(1.0)

        class Finished(Unfinished):
            def force(self, depth, rate):
                return self.stiffness * depth

        assert Finished(2.0).parameters == {"stiffness": 2.0}
        with pytest.raises(TypeError, match=r"Mine inherits from Finished, .*inherit from Unfinished"):
            type("Mine", (Finished,), {})

    @pytest.mark.parametrize(
        "decorate", [lambda cls: cls, dataclasses.dataclass(frozen=True)], ids=["bare", "decorated"]
    )
    def test_a_family_may_share_fields_and_a_formula(self, decorate):
        @decorate
        class Family(vk.ContactLaw, ABC):
            stiffness: float = vk.parameter("k", "s^-2", minimum=0)

            def force(self, depth, rate):
                return self.stiffness * depth * self.shape(rate)

        @decorate
        class Member(Family):
            softness: float = vk.parameter("c", "s m^-1", default=0.25)

            def shape(self, rate):
                return 1 + self.softness * rate

        member = Member(2.0)
        assert [(d.symbol, d.unit, d.minimum) for d in member.declared()] == [("k", "s^-2", 0), ("c", "s m^-1", None)]
        with pytest.raises(ParameterError, match=r"Member: stiffness must be .*, got -1\."):
            Member(-1.0)


class TestFrozen:
    @pytest.mark.parametrize("part", [*PARTS.values(), Cubic(1.0), Decorated(1.0)], ids=[*PARTS, "own", "decorated"])
    def test_no_field_can_be_set(self, part):
        for field in (*(f.name for f in dataclasses.fields(part)), "new"):
            with pytest.raises(dataclasses.FrozenInstanceError):
                setattr(part, field, 1.0)

    def test_barriers_and_scenes_too(self):
        barrier = vk.Barrier(vk.Hertz(1.0), 0.5, "right")
        with pytest.raises(dataclasses.FrozenInstanceError):
            barrier.position = 1.0
        with pytest.raises(dataclasses.FrozenInstanceError):
            vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1).damping_ratio = 1.0


@parts
class TestValues:
    def test_a_part_is_its_values(self, part):
        twin = type(part)(**part.parameters)
        assert twin == part
        assert hash(twin) == hash(part)
        assert eval(repr(part), vars(vk) | {type(part).__name__: type(part)}) == part
        assert copy.copy(part) == copy.deepcopy(part) == part.replace() == part
        assert all(part != other for other in PARTS.values() if other is not part)
        for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
            back = pickle.loads(pickle.dumps(part, protocol))
            assert back == part
            assert back.parameters == part.parameters

    def test_replace(self, part):
        for name, value in part.parameters.items():
            if isinstance(value, float):
                changed = part.replace(**{name: value + 0.5})
                assert changed != part
                assert changed.parameters == part.parameters | {name: value + 0.5}
        with pytest.raises(ParameterError) as refused:
            part.replace(stifness=1.0)
        assert "has no parameter 'stifness'" in str(refused.value)
        assert any(name in str(refused.value) for name in part.parameters)

    def test_every_parameter_is_declared_with_unit_and_symbol(self, part):
        constants = dict(part.constants) if isinstance(part, FormulaPart) else {}  # a formula says nothing of units
        for declared in part.declared():
            assert (declared.unit is None) == (declared.name in constants)
            assert declared.symbol


def test_laws_of_one_stiffness_and_another_kind_differ():
    assert vk.Hertz(50.0) != vk.Linear(50.0)


BAD_NUMBERS = {
    "negative": (-1.5, "-1.5"),
    "nan": (math.nan, "nan"),
    "infinite": (math.inf, "inf"),
    "text": ("50", "'50'"),
    "nothing": (None, "None"),
    "bool": (True, "True"),
    "list": ([50.0], r"\[50.0\]"),
    "nested": ({"k": [[1]]}, r"\{'k': \[\[1\]\]\}"),
    "array": (np.arange(3.0), r"array\(\[0\., 1\., 2\.\]\)"),
    "complex": (1j, "1j"),
    "huge integer": (10**400, "one above 1.8e308"),
    "unprintable integer": (10**5000, "one above 1.8e308"),
    "symbol": (sympy.Symbol("k"), "k"),
    "class": (float, "<class 'float'>"),
}


class TestChecks:
    @pytest.mark.parametrize(("value", "given"), BAD_NUMBERS.values(), ids=BAD_NUMBERS)
    @pytest.mark.parametrize(
        ("make", "owner", "name"),
        [
            (vk.Hertz, "Hertz", "stiffness"),
            (vk.Linear, "Linear", "stiffness"),
            (vk.WhiteNoise, "WhiteNoise", "intensity"),
            (lambda value: vk.StateDependentNoise(value, "1 + x"), "StateDependentNoise", "intensity"),
            (Cubic, "Cubic", "stiffness"),
            (Decorated, "Decorated", "stiffness"),
        ],
        ids=["hertz", "linear", "noise", "state-dependent", "own", "own decorated"],
    )
    def test_name_value_and_range_are_said(self, make, owner, name, value, given):
        with pytest.raises(
            ParameterError, match=rf"^{owner}: {name} must be a finite number at least 0, got {given}\.$"
        ):
            make(value)

    @pytest.mark.parametrize("value", [0, 0.0, -1.0, math.nan])
    def test_a_frequency_is_positive(self, value):
        with pytest.raises(ParameterError, match=r"^Harmonic: frequency must be a finite number greater than 0, got"):
            vk.Harmonic(0.1, value)

    def test_both_ends_of_a_range_are_said(self):
        with pytest.raises(ParameterError, match=r"^Cubic: bias must be .* at least -1 and at most 1, got 3\.$"):
            Cubic(1.0, 3)

    @pytest.mark.parametrize("value", [5, 5.0, np.float64(5), np.float32(5), np.int64(5)])
    def test_any_real_number_becomes_a_float(self, value):
        assert type(vk.Hertz(value).stiffness) is float
        assert repr(vk.Hertz(value)) == "Hertz(stiffness=5.0)"

    @pytest.mark.parametrize("edge", [0.0, -0.0, 5e-324, 1.7e308])
    def test_edges_are_allowed(self, edge):
        assert vk.Hertz(edge).stiffness == edge

    def test_the_class_says_what_it_needs(self):
        with pytest.raises(TypeError, match="stiffness"):
            vk.Hertz()
        with pytest.raises(TypeError, match="stifness"):
            vk.Hertz(stifness=1.0)

    def test_replace_checks_too(self):
        with pytest.raises(ParameterError, match=r"Hertz: stiffness must be .*, got -1\."):
            vk.Hertz(1.0).replace(stiffness=-1.0)


class TestOwnParts:
    @OWN
    def test_it_is_a_frozen_dataclass_with_checks(self, own):
        law = own(2.0)
        assert law.parameters == {"stiffness": 2.0, "bias": 0.5}
        assert repr(law) in (f"{own.__name__}(stiffness=2.0, bias=0.5)",)
        assert law == own(2.0, 0.5)
        assert hash(law) == hash(own(stiffness=2.0))
        assert pickle.loads(pickle.dumps(law)) == law
        assert [(d.symbol, d.unit, d.minimum) for d in law.declared()] == [("k", "m^-2 s^-2", 0), ("e", "", -1)]
        assert law.replace(bias=-0.5) == own(2.0, -0.5)

    def test_fields_declared_without_parameter_are_numbers_of_any_size(self):
        class Plain(vk.Spring):
            stiffness: float
            offset: float = 0.0

            def force(self, x, v):
                return self.stiffness * (x - self.offset)

        assert Plain(3).parameters == {"stiffness": 3.0, "offset": 0.0}
        with pytest.raises(ParameterError, match=r"Plain: offset must be a finite number, got nan\."):
            Plain(1.0, math.nan)

    @pytest.mark.parametrize("name", ["force", "parameters", "declared", "twin", "replace", "variables", "formulas"])
    def test_a_field_cannot_hide_what_every_part_has(self, name):
        body = {"__annotations__": {name: float}, "formula": lambda self: 0}
        with pytest.raises(TypeError, match=f"the field '{name}' would hide"):
            type("Hiding", (vk.ContactLaw,), body)

    def test_a_default_before_a_parameter_without_one_is_refused(self):
        with pytest.raises(ArgumentError, match=r"Late cannot become a dataclass \(.*'stiffness'.*default after those"):

            class Late(vk.Spring):
                offset: float = vk.parameter("d", "m", default=0.0)
                stiffness: float = vk.parameter("k", "s^-2")

                def force(self, x, v):
                    return self.stiffness * (x - self.offset)

    def test_a_structural_field_stays_a_number_in_the_twin(self):
        class Power(vk.ContactLaw):
            stiffness: float = vk.parameter("k", "", minimum=0)
            exponent: float = vk.parameter("n", "", above=0, structural=True)

            def force(self, depth, rate):
                return self.stiffness * depth**self.exponent

        osc = vk.Oscillator(
            natural_frequency=1.0, damping_ratio=0.1, barriers=[vk.Barrier(Power(3.0, 1.5), 0.5, "right")]
        )
        k = osc.model.symbols["barriers.0.law.stiffness"]
        (contact,) = osc.model.contacts
        (depth,) = contact.law.free_symbols - {k}
        assert contact.law == k * depth ** sympy.Rational(3, 2)
        assert "barriers.0.law.exponent" not in osc.model.symbols
        assert osc.parameters["barriers.0.law.exponent"] == 1.5
        with pytest.raises(ParameterError, match="Power: exponent must be a finite number greater than 0, got 0"):
            Power(3.0, 0)


class TestTwin:
    def test_the_formula_is_read_off_a_twin_of_symbols(self):
        k, c, depth, rate = sympy.symbols("k c depth rate", positive=True)
        hertz = k * depth ** sympy.Rational(3, 2)
        assert vk.Hertz(50.0).twin({"stiffness": k}).force(depth, rate) == hertz
        assert vk.Linear(50.0).twin({"stiffness": k}).force(depth, rate) == k * depth
        assert Cubic(50.0).twin({"stiffness": k, "bias": rate}).force(depth, rate) == k * depth**3 * (1 + rate)
        damped = vk.CustomLaw("k*depth**1.5*(1 + c*rate)", k=50.0, c=0.1)
        assert damped.twin({"k": k, "c": c}).force(depth, rate) == hertz * (1 + c * rate)
        assert vk.Hertz(50.0).twin({"stiffness": -1}).stiffness == -1  # ranges are not checked

    @parts
    def test_the_twin_is_of_the_same_class_and_leaves_the_part_alone(self, part):
        before = repr(part)
        twin = part.twin({name: sympy.Symbol(name) for name in part.parameters})
        assert type(twin) is type(part)
        assert repr(part) == before


class TestConstant:
    """Its parameter is called force, and so is its formula."""

    def test_parameter_and_formula(self):
        constant = vk.Constant(force=0.2)
        assert constant.parameters == {"force": 0.2}
        assert constant.force(sympy.Symbol("t")) == 0.2
        assert constant.period is None
        assert repr(constant) == "Constant(force=0.2)"
        assert constant.replace(force=0.3) == vk.Constant(0.3)

    def test_check(self):
        with pytest.raises(ParameterError, match=r"^Constant: force must be a finite number, got '1'\.$"):
            vk.Constant(force="1")


class TestFormulas:
    def test_names_of_constants_that_a_scene_file_could_not_hold_are_refused(self):
        for name in ("name", "constants"):
            with pytest.raises(FormulaError, match=f"parameter name '{name}'"):
                vk.CustomLaw("depth", **{name: 1.0})

    def test_self_is_a_name_like_any_other(self):
        assert vk.CustomLaw("self*depth", **{"self": 2.0}).parameters == {"formula": "self*depth", "self": 2.0}

    @pytest.mark.parametrize("formula", [3.0, None, ["depth"], b"depth", "", "  ", "k*depth", "depth +", "depth(2)"])
    @pytest.mark.parametrize("make", [vk.CustomLaw, vk.CustomSpring, lambda f: vk.StateDependentNoise(1e-3, f)])
    def test_what_is_no_formula(self, make, formula):
        with pytest.raises(VibrokitError, match=r"^The formula .*\.$"):
            make(formula)

    @pytest.mark.parametrize("value", [math.nan, "1", None, [1.0], True])
    def test_constants_are_finite_numbers(self, value):
        with pytest.raises(ParameterError, match=r"^CustomSpring: e must be a finite number, got .*\.$"):
            vk.CustomSpring("e*x", e=value)


class TestBarrier:
    def test_signs(self):
        assert vk.Barrier(vk.Hertz(1.0), 0.5, "right").sign == 1
        assert vk.Barrier(vk.Hertz(1.0), 0.5, "left").sign == -1

    def test_values(self):
        barrier = vk.Barrier(vk.Hertz(1.0), 1, "right")
        assert barrier.parameters == {"position": 1.0}
        assert barrier == eval(repr(barrier), vars(vk) | {"Barrier": vk.Barrier, "Hertz": vk.Hertz})
        assert pickle.loads(pickle.dumps(barrier)) == barrier
        assert barrier.replace(side="left").side == "left"

    @pytest.mark.parametrize(
        ("name", "wrong", "allowed"),
        [
            ("law", [vk.Hertz, 50.0, None, "hertz", vk.WhiteNoise(0.1), [vk.Hertz(1.0)]], "a ContactLaw.*"),
            ("side", ["Right", "up", "", 1, None, ["right"]], "'right' or 'left'"),
            ("position", [math.nan, math.inf, "0.5", None, [0.5], True], "a finite number"),
            ("adhesive", [1, 0.0, "no", None], "True or False"),
        ],
    )
    def test_wrong_fields_are_refused(self, name, wrong, allowed):
        given = {"law": vk.Hertz(1.0), "position": 0.5, "side": "right"}
        for value in wrong:
            with pytest.raises((SceneError, ParameterError), match=rf"^Barrier: {name} must be {allowed}, got .*\.$"):
                vk.Barrier(**given | {name: value})

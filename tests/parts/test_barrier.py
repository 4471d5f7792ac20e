"""Barriers, and parts whose formula is text."""

import math
import pickle

import pytest

import vibrokit as vk
from vibrokit.errors import FormulaError, ParameterError, SceneError, VibrokitError


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

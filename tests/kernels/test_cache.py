"""The cache of kernels: found again by another process, made anew exactly when the code must differ."""

import importlib
import os
import subprocess
import sys
import types
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import sympy

import vibrokit as vk
from vibrokit.kernels import store
from vibrokit.kernels.fingerprint import emitter_fingerprint, scene_fingerprint
from vibrokit.kernels.kernel import kernel_for, theta_of
from vibrokit.symbolic.flow_kind import Flow


def scene(law=None, **more):
    stops = [vk.Barrier(law or vk.Hertz(50.0), 0.5, "right")]
    return vk.Oscillator(**{"natural_frequency": 1.0, "damping_ratio": 0.01, "barriers": stops} | more)


def fingerprint(law):
    return scene_fingerprint(scene(law))


# --- the cache on disk


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


def python(code, cache, **environment):
    """What a fresh Python prints; its kernels live in `cache`."""
    run = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env=os.environ | {"VIBROKIT_CACHE": str(cache)} | environment,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.split()


def files(cache):
    return {path: path.stat().st_mtime_ns for path in cache.rglob("*") if path.is_file()}


MAP = """
import sys, vibrokit as vk
osc = vk.load_scene("hertz-0.570").replace({"damping_ratio": DAMPING})
end = osc.section_map([[0.01 * i, 0.1] for i in range(100)], periods=3, stepper=vk.RK4(steps=STEPS), rng=1)
print("sympy" in sys.modules, *end.tobytes().hex().split())
"""


def section_map(cache, damping="0.05", steps="64", **environment):
    return python(MAP.replace("DAMPING", damping).replace("STEPS", steps), cache, **environment)


@pytest.mark.slow
def test_another_process_needs_no_sympy_compiles_nothing_and_finds_the_same_bits(cache):
    first_sympy, first = section_map(cache)
    kept = files(cache)
    assert first_sympy == "True"
    assert section_map(cache, PYTHONHASHSEED="7") == ["False", first]
    loaded, other = section_map(cache, damping="0.4", steps="96")  # numbers compile nothing either
    assert loaded == "False"
    assert other != first
    assert files(cache) == kept


@pytest.mark.long
def test_a_law_typed_at_a_prompt(cache):
    code = """
import vibrokit as vk
exec('''
import vibrokit as vk
class Mine(vk.ContactLaw):
    stiffness: float = vk.parameter("k", "s^-2", minimum=0)
    def force(self, depth, rate):
        return self.stiffness * depth
''')
assert Mine.__module__ == "__main__"
def run(law):
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, barriers=[vk.Barrier(law, 0.2, "right")])
    return osc.section_map([[0.1, 1.0]], stepper=vk.RK4(steps=64)).tobytes().hex()
print(run(Mine(40.0)), run(vk.Linear(40.0)))
"""
    mine, built_in = python(code, cache)
    assert mine == built_in
    kept = files(cache)
    assert python(code, cache) == [mine, built_in]
    assert files(cache) == kept


def test_a_cache_that_cannot_be_written_gives_a_warning_and_works(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("VIBROKIT_CACHE", str(tmp_path / "file"))
    with pytest.warns(UserWarning, match=r"cannot write compiled kernels to .*Set VIBROKIT_CACHE to a folder"):
        folder = store.cache_directory.__wrapped__()
    assert folder.is_dir()
    monkeypatch.setattr(store, "cache_directory", lambda: folder)
    store.store("something", "text")
    assert store.stored("something") == "text"
    assert os.listdir(folder) == ["something.py"]


def test_a_kernel_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "cache_directory", lambda: tmp_path)

    def full(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(store.os, "replace", full)
    with pytest.raises(OSError, match="No space left"):
        store.store("kernel", "text")
    assert os.listdir(tmp_path) == []


def test_threads_that_start_together_load_one_module(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "cache_directory", lambda: tmp_path)
    text = "import time\ntime.sleep(0.05)\n"
    with ThreadPoolExecutor(8) as pool:
        modules = list(pool.map(lambda _: store.load("vibrokit_test_of_loading", text), range(8)))
    assert len({id(module) for module in modules}) == 1


# --- what makes a kernel another one


def test_numbers_do_not():
    one, other = scene(vk.Hertz(50.0)), scene(vk.Hertz(7.0), damping_ratio=0.3)
    assert kernel_for(one, Flow.STATE, vk.RK4()) is kernel_for(other, Flow.STATE, vk.RK4(steps=1024))
    assert theta_of(one).tolist() == [1.0, 0.01, 0.5, 50.0]
    assert theta_of(other).tolist() == [1.0, 0.3, 0.5, 7.0]


def test_the_structure_does():
    stop = vk.Barrier(vk.Hertz(50.0), 0.5, "right")
    variants = [
        scene(),
        scene(barriers=[stop.replace(side="left")]),
        scene(barriers=[stop.replace(adhesive=True)]),
        scene(barriers=[stop.replace(law=vk.Linear(50.0))]),
        scene(barriers=[]),
        scene(barriers=[stop, stop.replace(side="left", position=-0.5)]),
        scene(excitations=[vk.Constant(0.2)]),
        scene(excitations=[vk.Harmonic(0.2, 1.0)]),
        scene(excitations=[vk.Harmonic(0.2, 1.0), vk.Constant(0.2)]),
        scene(spring=vk.CubicSpring(1.0, 1.0)),
        scene(spring=vk.CustomSpring("a*x", a=1.0)),
        scene(spring=vk.CustomSpring("a*x**3", a=1.0)),
        scene(noise=vk.WhiteNoise(0.1)),
        scene(noise=vk.StateDependentNoise(0.1, "1 + x**2")),
    ]
    prints = [scene_fingerprint(variant) for variant in variants]
    assert len(set(prints)) == len(prints)


class Power(vk.ContactLaw):
    stiffness: float = vk.parameter("k", "", minimum=0)
    exponent: float = vk.parameter("n", "", above=0, structural=True)

    def force(self, depth, rate):
        return self.stiffness * depth**self.exponent


def law_class(body, **names):
    """A class `Law` typed in anew, with other names beside it, as an edited file would give."""
    text = (
        "class Law(vk.ContactLaw):\n"
        "    stiffness: float = vk.parameter('k', '', minimum=0)\n"
        f"    def force(self, depth, rate):\n        return {body}\n"
    )
    space = {"vk": vk, "__name__": "laws_of_mine"} | names
    exec(text, space)
    return space["Law"]


BODY = "self.stiffness * depth"
PAIRS = {  # a law, one that differs in a number only, one that says something else
    "exponent": (Power(50.0, 1.5), Power(7.0, 1.5), Power(50.0, 2.5)),
    "formula": (vk.CustomLaw("k*depth", k=1.0), vk.CustomLaw("k*depth", k=2.0), vk.CustomLaw("2*k*depth", k=1.0)),
    "constant": (vk.CustomLaw("k*depth", k=1.0), vk.CustomLaw("k*depth", k=2.0), vk.CustomLaw("c*depth", c=1.0)),
    "sign": (vk.CustomLaw("k*depth", k=1.0), vk.CustomLaw("k*depth", k=2.0), vk.CustomLaw("k*depth", k=-1.0)),
    "body": (law_class(BODY)(1.0), law_class(BODY)(2.0), law_class(f"{BODY} * 2")(1.0)),
    "argument": (law_class(BODY)(1.0), law_class(BODY)(2.0), law_class("self.stiffness * rate")(1.0)),
}


@pytest.mark.parametrize(("law", "number", "other"), PAIRS.values(), ids=PAIRS)
def test_what_the_formula_says_does(law, number, other):
    assert fingerprint(law) == fingerprint(number)
    assert fingerprint(law) != fingerprint(other)


BEHIND = {  # what a formula takes from its module, and another one by the same name
    "number": ("depth*thing", 2.0, 3.0),
    "symbolic number": ("depth**thing", sympy.Rational(3, 2), sympy.Rational(5, 2)),
    "array": ("depth*float(thing[0])", np.array([2.0]), np.array([3.0])),
    "function": ("thing(depth)", sympy.sin, sympy.cos),
    "default": ("thing(depth)", lambda depth, factor=2.0: factor * depth, lambda depth, factor=3.0: factor * depth),
    "module": ("thing.factor*depth", types.SimpleNamespace(factor=2.0), types.SimpleNamespace(factor=3.0)),
    "iterator": ("depth*next(thing)", iter((2, 2)), iter((3, 3))),
}


@pytest.mark.parametrize(("body", "one", "other"), BEHIND.values(), ids=BEHIND)
def test_what_a_formula_takes_from_its_module_does(body, one, other):
    law = law_class(body, thing=one)(1.0)
    before = fingerprint(law)
    law.force.__func__.__globals__["thing"] = other
    assert fingerprint(law) != before


def test_a_stepper_of_ones_own_is_taken_for_no_other():
    def own():
        return type("Own", (vk.RK4,), {"name": "own", "__module__": "mine"})()

    one, other = own(), own()
    assert emitter_fingerprint(one) == emitter_fingerprint(one) != emitter_fingerprint(other)
    assert emitter_fingerprint(vk.RK4(64)) == emitter_fingerprint(vk.RK4(128)) != emitter_fingerprint(vk.RK8(64))


NOISE = """
class Coloured(vk.NoiseModel):
    extra_states = ('NAME',)
    rate: float = vk.parameter('r', 's^-1', above=0)
    sign = SIGN
    def amplitude(self, x, v):
        return self.rate
    def force(self, y, push=PUSH):
        return push * y
    def drift(self, x, v, y):
        return (self.sign * self.rate * y,)
"""


@pytest.mark.parametrize("module", [None, "__main__", "numpy"])
def test_a_class_without_source_is_told_by_its_formulas(module):

    def noise(name="y", sign="-1", push="1"):
        space = {"vk": vk} | ({} if module is None else {"__name__": module})
        text = NOISE.replace("NAME", name).replace("SIGN", sign).replace("PUSH", push)
        exec(text, space)
        return scene_fingerprint(scene(noise=space["Coloured"](0.02, 1.0)))

    assert noise() == noise()
    assert len({noise(), noise(name="h"), noise(sign="-2"), noise(push="2")}) == 4


def test_a_right_class_after_a_wrong_one_gets_its_own_kernel():
    def end(sign):
        space = {"vk": vk}
        exec(NOISE.replace("NAME", "h").replace("SIGN", sign).replace("PUSH", "1"), space)
        osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, noise=space["Coloured"](0.02, 1.0))
        return osc.trajectory((0.0, 0.0, 1.0), periods=1, stepper=vk.RK4(steps=64)).x[-1]

    assert abs(end("1")) > 100  # grows like exp t
    assert abs(end("-1")) < 1


def test_a_module_that_a_formula_imports_does(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    law = law_class("__import__('helper_of_mine').factor * depth")(1.0)
    prints = []
    for value in ("2.0", "30.0"):
        monkeypatch.delitem(sys.modules, "helper_of_mine", raising=False)
        importlib.invalidate_caches()
        (tmp_path / "helper_of_mine.py").write_text(f"factor = {value}")
        prints.append(fingerprint(law))
    assert prints[0] != prints[1]


@pytest.mark.long
def test_the_same_class_has_the_same_fingerprint_in_another_process(cache, tmp_path):
    (tmp_path / "mine.py").write_text("""
import dataclasses
import vibrokit as vk

@dataclasses.dataclass(frozen=True)
class Shape:
    power: float = 2.0
    names: frozenset = frozenset(("a", "b", "c"))

    def __call__(self, depth):
        return depth**self.power

SHAPE = Shape()

class Law(vk.ContactLaw):
    stiffness: float = vk.parameter("k", "")

    def force(self, depth, rate):
        return self.stiffness * SHAPE(depth)
""")
    code = """
import hashlib, mine, vibrokit as vk
from vibrokit.kernels.fingerprint import emitter_fingerprint, scene_fingerprint
stops = [vk.Barrier(mine.Law(1.0), 0.5, "right")]
osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.01, barriers=stops)
print(hashlib.sha256(scene_fingerprint(osc).encode()).hexdigest())
"""
    runs = [python(code, cache, PYTHONPATH=str(tmp_path), PYTHONHASHSEED=seed) for seed in ("1", "2")]
    assert runs[0] == runs[1]


def test_the_code_follows_a_changed_global():
    """Not a stale kernel: the numbers change as well."""
    law_type = law_class("self.stiffness * depth**power", power=sympy.Rational(1))
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.1, barriers=[vk.Barrier(law_type(40.0), 0.2, "right")])
    linear = kernel_for(osc, Flow.STATE, vk.RK4())
    law_type.force.__globals__["power"] = sympy.Rational(2)
    square = kernel_for(osc, Flow.STATE, vk.RK4())
    assert square.scene.name != linear.scene.name
    assert square.scene.source != linear.scene.source
    assert square.driver == linear.driver

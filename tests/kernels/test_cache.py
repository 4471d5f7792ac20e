"""The cache of kernels: found again by another process, made anew exactly when the code must differ."""

import functools
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
from vibrokit.kernels.fingerprint import scene_fingerprint
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
    sympy, bits = python(MAP.replace("DAMPING", damping).replace("STEPS", steps), cache, **environment)
    return sympy == "True", bits


def test_a_second_process_needs_no_sympy_compiles_nothing_and_finds_the_same_bits(cache):
    first_sympy, first = section_map(cache)
    kept = files(cache)
    again_sympy, again = section_map(cache, PYTHONHASHSEED="7")
    assert first_sympy
    assert not again_sympy
    assert again == first
    assert files(cache) == kept


def test_a_changed_number_compiles_nothing(cache):
    section_map(cache)
    kept = files(cache)
    loaded, other = section_map(cache, damping="0.4", steps="96")
    assert not loaded
    assert other != section_map(cache)[1]
    assert files(cache) == kept


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


def test_an_exponent_does():
    assert fingerprint(Power(50.0, 1.5)) == fingerprint(Power(7.0, 1.5))
    assert fingerprint(Power(50.0, 1.5)) != fingerprint(Power(50.0, 2.5))
    assert "k" in kernel_for(scene(Power(50.0, 1.5)), Flow.STATE, vk.RK4()).source


def test_a_formula_does():
    assert fingerprint(vk.CustomLaw("k*depth", k=1.0)) == fingerprint(vk.CustomLaw("k*depth", k=2.0))
    assert fingerprint(vk.CustomLaw("k*depth", k=1.0)) != fingerprint(vk.CustomLaw("2*k*depth", k=1.0))
    assert fingerprint(vk.CustomLaw("k*depth", k=1.0)) != fingerprint(vk.CustomLaw("c*depth", c=1.0))


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


def test_a_class_body_does():
    body = "self.stiffness * depth"
    assert fingerprint(law_class(body)(1.0)) == fingerprint(law_class(body)(2.0))
    assert fingerprint(law_class(body)(1.0)) != fingerprint(law_class("self.stiffness * depth * 2")(1.0))
    assert fingerprint(law_class(body)(1.0)) != fingerprint(law_class("self.stiffness / depth")(1.0))
    assert fingerprint(law_class(body)(1.0)) != fingerprint(law_class("self.stiffness * rate")(1.0))


def module(**members):
    made = types.ModuleType("helpers_of_mine")
    vars(made).update(members)
    return made


def function(text, **attributes):
    space = {"__name__": "helpers_of_mine"}
    exec(f"def shape(depth):\n    return {text}\n", space)
    vars(space["shape"]).update(attributes)
    return space["shape"]


def enclosing(factor):
    return lambda depth: factor * depth


class Factor:
    def __init__(self, value):
        self.value = value

    def times(self, depth):
        return self.value * depth


def callable_class(text):
    return type("Shape", (), {"__call__": lambda self, depth: function(text)(depth), "__module__": "helpers_of_mine"})


def shape_class(text):
    return type("Shape", (), {"of": staticmethod(function(text)), "__module__": "helpers_of_mine"})


BEHIND = {
    "number": ("depth*thing", 2.0, 3.0),
    "list": ("depth*thing[0]", [2.0], [3.0]),
    "dict": ("depth*thing['a']", {"a": 2.0}, {"a": 3.0}),
    "symbolic number": ("depth**thing", sympy.Rational(3, 2), sympy.Rational(5, 2)),
    "array": ("depth*float(thing[0])", np.array([2.0]), np.array([3.0])),
    "function": ("thing(depth)", function("depth*2"), function("depth*3")),
    "partial": ("thing(depth)", functools.partial(max, 2), functools.partial(max, 3)),
    "partial of ours": ("thing()", functools.partial(function("2"), 1), functools.partial(function("3"), 1)),
    "cached function": ("thing(depth)", functools.cache(function("depth*2")), functools.cache(function("depth*3"))),
    "module member": ("depth*thing.factor", module(factor=2.0), module(factor=3.0)),
    "function of a module": ("thing.f(depth)", module(f=function("depth*2")), module(f=function("depth*3"))),
    "class": ("thing.of(depth)", shape_class("depth*2"), shape_class("depth*3")),
    "object": ("thing.of(depth)", shape_class("depth*2")(), shape_class("depth*3")()),
    "other function": ("thing(depth)", sympy.sin, sympy.cos),
    "part": ("thing.stiffness*depth", vk.Hertz(2.0), vk.Hertz(3.0)),
    "bound method": ("thing(depth)", Factor(2.0).times, Factor(3.0).times),
    "method of a list": ("depth*thing(0)", [2.0].__getitem__, [3.0].__getitem__),
    "callable object": ("thing(depth)", callable_class("depth*2")(), callable_class("depth*3")()),
    "closure": ("thing(depth)", enclosing(2.0), enclosing(3.0)),
    "default": ("thing(depth)", lambda depth, factor=2.0: factor * depth, lambda depth, factor=3.0: factor * depth),
    "keyword default": ("thing(depth)", lambda depth, *, n=2.0: n * depth, lambda depth, *, n=3.0: n * depth),
    "attribute of a function": ("thing.factor*depth", function("depth", factor=2.0), function("depth", factor=3.0)),
}  # fmt: skip


@pytest.mark.parametrize(("body", "one", "other"), BEHIND.values(), ids=BEHIND)
def test_what_a_formula_takes_from_its_module_does(body, one, other):
    law = law_class(body, thing=one)(1.0)
    before = fingerprint(law)
    assert fingerprint(law) == before
    vars(sys.modules[__name__])  # nothing here matters to it
    law.force.__func__.__globals__["thing"] = other
    assert fingerprint(law) != before
    law.force.__func__.__globals__["thing"] = one
    assert fingerprint(law) == before
    law.force.__func__.__globals__["unused"] = 3.0
    assert fingerprint(law) == before


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


@pytest.mark.parametrize("module", [None, "__main__", "builtins", "numpy", "vibrokit", "vibrokit.parts.noise"])
def test_a_class_without_source_is_described_by_its_code(module):
    """`exec` without a module's name claims builtins; a name may be claimed by anything."""

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


@pytest.mark.parametrize("how", ["import helper", "from helper import factor", "from . import helper"])
def test_a_module_that_a_formula_imports_does(tmp_path, monkeypatch, how):
    monkeypatch.syspath_prepend(tmp_path)
    package = tmp_path / "mine_of_test"
    package.mkdir()
    (package / "__init__.py").write_text("")
    body = f"    def force(self, depth, rate):\n        {how}\n        return self.stiffness*depth*FACTOR"
    head = "import vibrokit as vk\nclass Law(vk.ContactLaw):\n    stiffness: float = vk.parameter('k', '')\n"
    (package / "laws.py").write_text(head + body.replace("FACTOR", "factor" if "factor" in how else "helper.factor"))
    prints = []
    for value in ("2.0", "30.0"):
        for name in [name for name in sys.modules if name == "helper" or name.startswith("mine_of_test")]:
            monkeypatch.delitem(sys.modules, name)
        (package / "helper.py").write_text(f"factor = {value}")
        (tmp_path / "helper.py").write_text(f"factor = {value}")
        prints.append(fingerprint(importlib.import_module("mine_of_test.laws").Law(1.0)))
    assert prints[0] != prints[1]


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
from vibrokit.kernels.fingerprint import scene_fingerprint
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


def test_what_cannot_be_described_is_never_taken_for_the_same():
    law = law_class("depth*next(thing)", thing=(i for i in range(3)))(1.0)
    other = law_class("depth*next(thing)", thing=(i for i in range(3)))(1.0)
    assert fingerprint(law) != fingerprint(other)


def test_formulas_that_refer_to_themselves_end():
    space = {"__name__": "helpers_of_mine"}
    exec("def even(n):\n    return n == 0 or odd(n - 1)\ndef odd(n):\n    return n != 0 and even(n - 1)\n", space)
    loop = []
    loop.append(loop)
    assert fingerprint(law_class("depth*thing(4)", thing=space["even"])(1.0))
    assert fingerprint(law_class("depth*len(thing)", thing=loop)(1.0))


def test_sympy_functions_are_not_followed_into_sympy():
    law = law_class("self.stiffness*sqrt(depth)*sympy.exp(-depth)", sqrt=sympy.sqrt, sympy=sympy)(1.0)
    assert len(fingerprint(law)) < 3000

import dataclasses
import json
import math
import os
import signal
import subprocess
import sys
import time
from importlib.metadata import EntryPoint
from types import SimpleNamespace
from typing import Literal

import pytest

import vibrokit as vk
from vibrokit import registry
from vibrokit.analyzers.analyzer import Analysis, Analyzer
from vibrokit.analyzers.settings import configured, setting
from vibrokit.cli import main, parsed
from vibrokit.errors import FileError, StructureError
from vibrokit.progress import Deadline, advance, stage
from vibrokit.results.codes import Code
from vibrokit.results.energy import ActivationEnergy, Bound
from vibrokit.results.finding import Finding

PLOT = ["--analyzer", "action-plot"]
TOY = ["run", "double-well", "--analyzer", "toy"]
ASSESS = ["assess", "double-well", "--method", "toy"]
FIND = "vibrokit.cli.run.find_structure"
ZETA = 0.05  # of the double well


def found(source, target, value=0.05):
    return ActivationEnergy(source, target, value, 0.9 * value, value, "toy", Bound.CERTIFIED, 1e-9, 1e-12)


def nothing_happens(problem):
    """What a toy analyzer does before it finds an energy."""


@dataclasses.dataclass(frozen=True)
class ToyPart:
    """A part of an analyzer, with a setting of its own."""

    depth: int = 1


class ToyBox(vk.LeaveRegion):
    """An exit with a setting."""

    half: float = 1.0

    def bounds(self, osc):
        return [(-self.half, self.half), (-math.inf, math.inf)]


class Toy(Analyzer):
    """Finds an energy for each attractor at once, unless something happens before."""

    happens = staticmethod(nothing_happens)
    scale: float = 1.0
    count: int = 1
    fast: bool = False
    title: str = "toy"
    sizes: tuple[float, ...] = ()
    limit: float | None = None
    form: Literal["round", "square"] = "round"
    part: ToyPart = dataclasses.field(default_factory=ToyPart)

    def __post_init__(self):
        if self.scale + 0.0 < 0:  # a plug-in may calculate with its settings at once
            raise ValueError("scale must not be negative.")

    def analyze(self, problem):
        with stage("toy", unit="steps", total=1):
            type(self).happens(problem)
            advance()
        energy = found(problem.source, 1 - problem.source, 0.05 * self.scale)
        remark = Finding.of(Code.REMARK, problem.source, text="a toy wrote this")
        return Analysis(estimates=(energy,), branches=(energy,), findings=(remark,))


class Toy2(Toy):
    """Another one."""


@pytest.fixture(scope="module")
def well():
    return vk.find_structure(vk.load_scene("double-well"), cells=(40, 40))


@pytest.fixture
def toys(well, monkeypatch, tmp_path):
    """Toy analyzers are registered, the structure is known beforehand, and files go to a new folder."""
    installed = registry._entry_points

    def entry_points(group):
        classes = {"vibrokit.analyzers": [("toy", "Toy"), ("toy-2", "Toy2")], "vibrokit.exits": [("toy-box", "ToyBox")]}
        points = [EntryPoint(name, f"{__name__}:{cls}", group) for name, cls in classes.get(group, ())]
        for point in points:
            vars(point)["dist"] = SimpleNamespace(name="toys")
        return [*installed(group), *points]

    monkeypatch.setitem(
        sys.modules, __name__, sys.modules.get(__name__) or SimpleNamespace(Toy=Toy, Toy2=Toy2, ToyBox=ToyBox)
    )
    monkeypatch.setattr(registry, "_entry_points", entry_points)
    monkeypatch.setattr(FIND, lambda osc, **options: well)
    monkeypatch.setattr(Toy, "happens", staticmethod(nothing_happens))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def files(folder):
    return sorted(path.name for path in folder.iterdir())


def press(times=1):
    """Press Ctrl-C."""
    for _ in range(times):
        signal.raise_signal(signal.SIGINT)


# What is printed and saved


def test_run_prints_what_was_found_and_saves_it(toys, capsys):
    assert main([*TOY, "-o", "r.nc", "--verbose"]) == 0
    out = capsys.readouterr().out
    for text in ("left-rest", "equilibrium", "left-rest → right-rest", "ΔU/D", "certified", "A toy wrote this"):
        assert text.lower() in out.lower()
    assert "written: r.nc (toy)" in out
    assert files(toys) == ["double-well-toy.png", "r.nc"]
    assert vk.load_result("r.nc").energy("left-rest").value == 0.05
    assert main(["plot", "r.nc"]) == 0
    assert (toys / "r.png").stat().st_size > 5000
    capsys.readouterr()
    assert main(["report", "r.nc"]) == 0
    assert "left-rest → right-rest  0.05  5  " in capsys.readouterr().out


def test_json_has_the_words_of_the_interface(toys, well, capsys):
    assert main([*TOY, "--json", "--seed", "7"]) == 0
    record = json.loads(capsys.readouterr().out)
    promised = ["scene", "attractors", "saddles", "energies", "versions", "seed", "seconds"]
    assert set(promised) < set(record)
    assert {"complete", "branches", "findings", "transitions", "settings", "stats", "files"} < set(record)
    assert (record["scene"], record["complete"], record["seed"], record["files"]) == ("double-well", True, 7, {})
    attractor = record["attractors"][0]
    assert {"label", "kind", "period", "impacts", "points", "basin_fraction"} < set(attractor)
    assert (attractor["name"], attractor["basin_fraction"]) == ("left-rest", well.attractors[0].basin_fraction)
    energy = record["energies"][0]
    assert {"source", "target", "method", "value", "lower", "upper", "residual"} < set(energy)
    assert (energy["bound"], energy["numerical_error"], energy["exit"]) == (
        "certified", 1e-9, "left-rest → right-rest",
    )  # fmt: skip
    assert energy["ratio"] == pytest.approx(5.0)
    (remark, _) = [one for one in record["findings"] if one["record"] == "toy"]
    assert (remark["code"], remark["severity"], remark["source"]) == ("remark", "info", 0)
    assert (remark["values"], remark["text"]) == ({"text": "a toy wrote this"}, "A toy wrote this")
    assert record["transitions"]["toy"]["energies"] == [[0, 0.05], [0.05, 0]]
    assert {"trajectories", "intervals", "steps", "newton_iterations", "seconds"} == set(record["stats"]["toy"])
    assert files(toys) == []


def test_saddles_are_in_the_json(toys, capsys):
    assert main(["run", "double-well", "--json", "--analyzer"]) == 0
    (saddle,) = json.loads(capsys.readouterr().out)["saddles"]
    assert {"period", "points", "multipliers"} < set(saddle)
    assert saddle["points"][0] == pytest.approx([0.0, 0.0], abs=1e-9)
    rates = -ZETA + (1 + ZETA**2) ** 0.5, -ZETA - (1 + ZETA**2) ** 0.5
    exact = [[math.exp(2 * math.pi * rate), 0.0] for rate in rates]
    assert saddle["multipliers"] == [pytest.approx(pair, rel=1e-8, abs=1e-12) for pair in exact]


def test_a_structure_is_saved_and_drawn(toys, capsys):
    assert main(["run", "double-well", "-o", "s.nc", "--verbose", "--analyzer"]) == 0
    out = capsys.readouterr().out
    assert "saddle" in out
    assert "left-rest | right-rest" in out
    assert "ΔU" not in out
    assert files(toys) == ["double-well-structure.png", "s.nc"]
    assert vk.load_result("s.nc").names == ("left-rest", "right-rest")


def test_each_of_several_analyzers_has_its_file(toys, capsys):
    assert main([*TOY, "toy-2", "--set", "scale=2", "-o", "r.nc", "--figure", "f.png"]) == 0
    assert files(toys) == ["f-toy-2.png", "f-toy.png", "r-toy-2.nc", "r-toy.nc"]
    assert vk.load_result("r-toy-2.nc").energy(0).value == 0.1


@pytest.mark.parametrize("given", [["--source", "right"], ["--source", "1"], ["--set", "source=right-rest"]])
def test_the_source_is_a_name_or_a_label(toys, capsys, given):
    assert main([*TOY, "--json", *given]) == 0
    record = json.loads(capsys.readouterr().out)
    assert [energy["source"] for energy in record["energies"]] == [1]
    assert record["transitions"]["toy"]["missing"] == [0]


def test_what_is_not_finite_is_null_in_json(toys, monkeypatch, capsys):
    """An energy without an upper bound is still one object that other programs read."""
    monkeypatch.setattr(f"{__name__}.found", lambda source, target, value: ActivationEnergy(
        source, target, value, 0.0, math.inf, "toy", Bound.UPPER))  # fmt: skip
    assert main([*TOY, "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert {(energy["upper"], energy["residual"]) for energy in record["energies"]} == {(None, None)}


# What fails


def refuse(problem):
    raise StructureError("no toys here.")


def crash(problem):
    raise ZeroDivisionError("of a plug-in")


def test_an_analyzer_that_cannot_run_leaves_the_structure(toys, capsys):
    assert main([*TOY, "-o", "r.nc", "--source", "7", "--json"]) == 1
    out, err = capsys.readouterr()
    record = json.loads(out)
    assert not record["complete"]
    (finding,) = [one for one in record["findings"] if one["record"] == "run"]
    assert (finding["code"], finding["severity"]) == ("analyzer-not-run", "error")
    assert "attractor 7" in err
    assert record["files"] == {"structure": "r.nc"}
    assert len(vk.load_result("r.nc").attractors) == 2


REFUSED = {
    "no noise": (("action-graph", "action-plot", "least-action", "sgcm", "mfet"), {"noise": None}, []),
    "no stop": (("action-plot", "mfet"), {}, ["--exit", "first-contact:right"]),
    "no intensity": (("sgcm", "mfet"), {"noise": vk.WhiteNoise(0.0)}, []),
    "a stepper without noise": (("mfet",), {}, ["--stepper", "order8:1e-8"]),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_can_be_checked_before_any_work_is(toys, monkeypatch, capsys, case):
    analyzers, changes, options = REFUSED[case]
    monkeypatch.setattr(FIND, lambda *_, **__: pytest.fail("it has begun"))
    vk.save_scene(dataclasses.replace(vk.load_scene("double-well"), **changes), "scene.toml")
    for name in analyzers:
        assert main(["run", "scene.toml", "--analyzer", name, *options]) == 2
        assert f"{name} cannot be run" in capsys.readouterr().err


def test_a_file_that_cannot_be_written_leaves_the_tables(toys, monkeypatch, capsys):
    def full(path, content):
        raise FileError(f"{path} cannot be written (No space left on device).")

    monkeypatch.setattr("vibrokit.results.record.write_atomically", full)
    assert main([*TOY, "-o", "r.nc"]) == 1
    out, err = capsys.readouterr()
    assert "left-rest → right-rest" in out
    assert "no result was saved" in out
    assert "r.nc was not written" in err


# Interrupts and time limits


def run_out(problem):
    if problem.source:
        raise Deadline


def stuck(problem):
    press(2)
    pytest.fail("the second Ctrl-C did not stop")


def end(count):
    def happens(problem):
        for _ in range(count * problem.source):
            signal.raise_signal(signal.SIGTERM)

    return happens


BOTH = ["toy", "toy-2"]
# What happens in which analyzer, which are run, the status, the files, those of them that are not complete, the words
# of standard error.
EVENTS = {
    "one state fails": (
        Toy, lambda problem: problem.source or refuse(problem), ["toy"], 1, ["double-well-toy.png", "r.nc"], [], [],
    ),
    "a crash": (
        Toy2, crash, BOTH, 1, ["double-well-toy.png", "r-structure.nc", "r-toy.nc"], [],
        ["ZeroDivisionError: of a plug-in"],
    ),
    "Ctrl-C in the second state": (
        Toy, lambda problem: problem.source and press(), BOTH, 130, ["r-structure.nc", "r-toy.nc"], ["r-toy.nc"],
        ["written: r-toy.nc (toy), r-structure.nc (structure)", "toy-2 was not run"],
    ),
    "Ctrl-C in the first": (Toy, lambda _: press(), ["toy"], 130, ["r.nc"], [], ["written: r.nc (structure)"]),
    "a second Ctrl-C": (Toy, stuck, ["toy"], 130, ["r.nc"], [], ["written: r.nc (structure)"]),
    "SIGTERM": (
        Toy2, end(1), BOTH, 143, ["r-structure.nc", "r-toy-2.nc", "r-toy.nc"], ["r-toy-2.nc"],
        ["written: r-toy.nc (toy), r-toy-2.nc (toy-2), r-structure.nc (structure)"],
    ),
    "SIGTERM twice": (Toy2, end(2), BOTH, 143, ["r-structure.nc", "r-toy-2.nc", "r-toy.nc"], ["r-toy-2.nc"], []),
    "a time limit": (
        Toy, run_out, BOTH, 1, ["double-well-toy.png", "r-structure.nc", "r-toy.nc"], ["r-toy.nc"],
        ["toy-2 was not run"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", EVENTS)
def test_whatever_happens_to_an_analyzer_the_rest_is_kept(toys, monkeypatch, capsys, name):
    kind, happens, analyzers, status, expected, unfinished, words = EVENTS[name]
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    monkeypatch.setattr(kind, "happens", staticmethod(happens), raising=False)
    assert main(["run", "double-well", "--analyzer", *analyzers, "-o", "r.nc", "--time-limit", "1000"]) == status
    out, err = capsys.readouterr()
    assert files(toys) == expected
    records = {file: vk.load_result(file) for file in expected if file.endswith(".nc")}
    assert [file for file, record in records.items() if not record.complete] == unfinished
    assert all(word in err for word in words)
    assert all(f"{file[2:-3]} (incomplete)" in out for file in unfinished)
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == handlers
    if name == "one state fails":
        assert "error: Left-rest could not be analyzed: no toys here." in out
        assert [energy.source for energy in records["r.nc"].energies] == [1]
    if name == "a time limit":
        (stopped,) = records["r-toy.nc"].found(Code.STOPPED)
        assert stopped.values == {"stage": "Toy", "reason": "time limit"}


def half_found(well):
    press()
    with pytest.raises(KeyboardInterrupt), stage("basins"):
        pytest.fail("the stage began")
    return vk.Structure(**{**vars(well), "complete": False})


def not_found(well):
    with stage("attractors"):
        press()
        advance()


def too_late(well):
    raise Deadline


SEARCHES = {
    "half": (half_found, 130, ["r.nc"], "toy was not run"),
    "nothing": (not_found, 130, [], "no result was saved"),
    "no time": (too_late, 1, [], "during the search for steady states (time limit)"),
}


@pytest.mark.parametrize("name", SEARCHES)
def test_an_end_during_the_structure_keeps_what_it_has(toys, well, monkeypatch, capsys, name):
    search, status, expected, words = SEARCHES[name]
    monkeypatch.setattr(FIND, lambda osc, **options: search(well))
    assert main([*TOY, "-o", "r.nc", "--json"]) == status
    out, err = capsys.readouterr()
    assert files(toys) == expected
    assert words in err
    assert not json.loads(out)["complete"]
    assert not any(vk.load_result(file).complete for file in expected)


def test_ctrl_c_while_the_input_is_read_ends_before_the_work(toys, monkeypatch, capsys):
    original = vk.load_scene
    monkeypatch.setattr("vibrokit.cli.run.load_scene", lambda name: press() or original(name))
    monkeypatch.setattr(FIND, lambda osc, **options: advance())
    assert main([*TOY, "-o", "r.nc"]) == 130
    assert "no result was saved" in capsys.readouterr().err


@pytest.mark.parametrize("where", ["vibrokit.cli.run._save", "vibrokit.cli.run._print"])
def test_ctrl_c_while_results_are_saved_or_printed_loses_nothing(toys, monkeypatch, capsys, where):
    module, name = where.rsplit(".", 1)
    original = getattr(sys.modules[module], name)
    monkeypatch.setattr(where, lambda *arguments: press() or original(*arguments))
    assert main([*TOY, "-o", "r.nc"]) == 130
    out, err = capsys.readouterr()
    assert "left-rest → right-rest" in out
    assert "written: r.nc (toy)" in err
    assert vk.load_result("r.nc").complete


def test_each_result_is_printed_and_saved_when_it_is_found(toys, monkeypatch, capsys):
    def look(problem):
        if problem.source == 0:
            assert "left-rest → right-rest" in capsys.readouterr().out
            assert vk.load_result("r-toy.nc").complete

    monkeypatch.setattr(Toy2, "happens", staticmethod(look), raising=False)
    assert main([*TOY, "toy-2", "-o", "r.nc"]) == 0
    out, _ = capsys.readouterr()
    assert "double-well: toy\n" not in out  # it is not printed twice
    assert "written: r-toy.nc (toy), r-toy-2.nc (toy-2)" in out


@pytest.mark.parametrize("replaced", [False, True])
def test_two_ctrl_c_while_saving_leave_the_old_file_or_the_new_one_whole(toys, monkeypatch, replaced):
    (toys / "r.nc").write_text("an older file")
    replace = os.replace
    monkeypatch.setattr("vibrokit.results.atomic.os.replace", lambda *paths: (replaced and replace(*paths)) or press(2))
    assert main([*TOY, "-o", "r.nc"]) == 130
    assert files(toys) == ["r.nc"]
    assert vk.load_result("r.nc").complete if replaced else (toys / "r.nc").read_text() == "an older file"


# The other commands


def test_equations(capsys):
    assert main(["equations", "hertz-0.570"]) == 0
    assert "p_2" in capsys.readouterr().out
    assert main(["equations", "hertz-0.570", "--latex"]) == 0
    assert r"\dot{x}" in capsys.readouterr().out


def test_plausibility(capsys):
    natural, spectral = 1.0 / (2 * math.pi), 2 * 2e-5
    assert main(["plausibility", "hertz-0.570"]) == 0
    assert f"{natural:.4g} Hz" in capsys.readouterr().out
    assert main(["plausibility", "hertz-0.570", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    values = {row["measure"]: row["value"] for row in found["rows"]}
    assert values["natural-hz"] == pytest.approx(natural, rel=1e-12)
    assert values["psd"] == pytest.approx(spectral, rel=1e-12)
    assert found["oddities"] == []


def test_settings_reach_the_parts_of_an_analyzer():
    given = dict(setting(text) for text in ("graph.nodes=48,64", "shooting=none", "orbits=2", "source=clear"))
    made = configured(vk.LeastAction, given)
    assert made == vk.LeastAction(graph=vk.GraphSearch(nodes=(48, 64)), shooting=None, orbits=2, source="clear")


@pytest.mark.parametrize(
    ("words", "analyzers"),
    [
        ([], ["least-action"]),
        (["--analyzer"], []),
        (["--analyzer", "sgcm", "mfet"], ["sgcm", "mfet"]),
        (["--analyzer", "sgcm", "--analyzer", "mfet"], ["sgcm", "mfet"]),
    ],
)
def test_analyzers_that_are_named(words, analyzers):
    assert parsed(["run", "double-well", *words]).analyzer == analyzers
    if analyzers and words:  # the scene may come last
        last = parsed(["run", *words, "double-well"])
        assert (last.scene, last.analyzer) == ("double-well", analyzers)


WELL = ["run", "double-well"]
MISTAKES = [
    (["run", "herz-0.570"], "hertz-0.570"),
    ([*WELL, *PLOT, "--set", "ponts=3"], "points"),
    ([*WELL, *PLOT, "--set", "points"], "FIELD=VALUE"),
    ([*WELL, "--set", "points=300"], "write shooting.points"),
    ([*WELL, "--set", "exits=3"], "the nearest is 'exit'"),
    ([*WELL, "--set", "graph.node=3"], "the nearest is 'nodes'"),
    ([*WELL, "--set", "grph.nodes=3,3"], "the nearest is 'graph'"),
    ([*WELL, "--set", "orbits.nodes=3"], "no part 'orbits'"),
    ([*WELL, *PLOT, "--cells", "1"], "--cells"),
    ([*WELL, *PLOT, "--stepper", "rk5:3"], "no stepper 'rk5'"),
    ([*WELL, *PLOT, "--stepper", "rk4:few"], "rk4:few"),
    ([*WELL, *PLOT, "--stepper", "order8:7"], "tolerance"),
    ([*WELL, *PLOT, "--exit", "leave-basins"], "leave-basin"),
    ([*WELL, *PLOT, "--exit", "leave-basin:left"], "for_good must be true or false"),
    ([*WELL, *PLOT, "--exit", "leave-basin:true,3,4"], "takes 2 arguments"),
    ([*WELL, *PLOT, "--exit", "first-contact:top"], "'top'"),
    ([*WELL, *PLOT, "--time-limit", "-1"], "time_limit"),
    ([*WELL, *PLOT, "--checkpoint", "work.ckpt"], "--checkpoint"),
    ([*WELL, "--analyzer", "actionplot"], "action-plot"),
    ([*WELL, "-o", "nowhere/r.nc"], "nowhere"),
    *(([*TOY, option, "folder.png"], "folder.png is a folder") for option in ("-o", "--figure", "--checkpoint")),
    (["plot", "nothing.nc"], "nothing.nc"),
    (["report", "nothing.nc"], "nothing.nc"),
    (["check", "herz"], "hertz"),
    (["sweep", "double-well", "damping_ratio", "0.1", "0.2", "--figure", "nowhere/f.png"], "nowhere"),
    # The sentence has the setting, the value and what is allowed; the plug-in's own code is never reached with it.
    ([*TOY, "--set", "scale=abc"], "Toy: scale", "'abc'", "a number"),
    ([*TOY, "--set", "scale=1,2"], "Toy: scale", "'1,2'", "a number"),
    ([*TOY, "--set", "scale=none"], "Toy: scale", "'none'", "a number"),
    ([*TOY, "--set", "scale=true"], "Toy: scale", "'true'", "a number"),
    ([*TOY, "--set", "scale=-1"], "Toy", "scale must not be negative."),
    ([*TOY, "--set", "count=2.5"], "Toy: count", "'2.5'", "a whole number"),
    ([*TOY, "--set", "fast=yes"], "Toy: fast", "'yes'", "true or false"),
    ([*TOY, "--set", "fast=1"], "Toy: fast", "'1'", "true or false"),
    ([*TOY, "--set", "sizes=1,x"], "Toy: sizes", "'1,x'", "a number"),
    ([*TOY, "--set", "limit=low"], "Toy: limit", "'low'", "a number or none"),
    ([*TOY, "--set", "form=flat"], "Toy: form", "'flat'", "'round' or 'square'"),
    ([*TOY, "--set", "part.depth=deep"], "Toy: part.depth", "'deep'", "a whole number"),
    ([*TOY, "--exit", "toy-box:wide"], "ToyBox: half", "'wide'", "a number"),
    ([*TOY, "--set", "exit=toy-box:wide"], "ToyBox: half", "'wide'", "a number"),
    ([*WELL, *PLOT, "--set", "points=many"], "ActionPlot: points", "'many'", "a whole number"),
    ([*WELL, *PLOT, "--set", "radius=abc"], "ActionPlot: radius", "'abc'", "a number or none"),
    ([*WELL, "--set", "orbits=2.5"], "LeastAction: orbits", "'2.5'", "a whole number"),
    ([*WELL, "--set", "graph.nodes=a,b"], "LeastAction: graph.nodes", "'a,b'", "whole number"),
    ([*WELL, "--set", "graph.nodes=3"], "LeastAction: graph.nodes", "'3'", "2 values"),
    ([*WELL, "--set", "shooting.tolerance=x"], "LeastAction: shooting.tolerance", "'x'", "number"),
    ([*ASSESS, "--accuracy", "1"], "accuracy"),
    ([*ASSESS, "--accuracy", "nan"], "accuracy"),
    ([*ASSESS, "--method", "nope"], "'nope'"),
    ([*ASSESS, "--mean-time", "1 s"], "mean_time"),
    ([*ASSESS, "--mean-time=-3 s"], "-3 s"),
    ([*ASSESS, "--within", "3 lightyears"], "lightyears"),
    ([*ASSESS, "--time-limit", "-1"], "time_limit"),
    ([*ASSESS, "-o", "no/folder.nc"], "no/folder.nc"),
    ([*ASSESS, "-o", "."], "folder"),
    ([*ASSESS, "--known", "nothing.nc"], "nothing.nc"),
    ([*ASSESS, "--source", "nowhere"], "'nowhere'"),
    ([*ASSESS, "--exit", "first-contact"], "stop"),
]


@pytest.mark.parametrize("case", MISTAKES, ids=lambda case: " ".join(case[0][1:]))
def test_mistakes_are_one_sentence_and_status_two(toys, capsys, case):
    arguments, *words = case
    (toys / "folder.png").mkdir()
    assert main(arguments) == 2
    *_, error = capsys.readouterr().err.strip().split("\n")  # what was begun may be reported before
    assert error.startswith("vibrokit: ")
    assert error.endswith(".")
    assert [word for word in words if word not in error] == []
    assert files(toys) == ["folder.png"]


def test_settings_are_read_as_their_declared_types(toys, capsys):
    typed = ("scale=2", "count=3", "fast=true", "title=12", "sizes=0.5", "limit=1e-3", "form=square", "part.depth=4")
    assert main([*TOY, "--json", *(word for text in typed for word in ("--set", text))]) == 0
    settings = json.loads(capsys.readouterr().out)["settings"]["toy"]
    assert (settings["scale"], settings["count"], settings["fast"], settings["title"]) == (2, 3, True, "12")
    assert (settings["sizes"], settings["limit"], settings["form"]) == ([0.5], 1e-3, "square")
    assert settings["part"] == {"depth": 4}


def test_settings_of_a_file_are_checked_too():
    for given, words in (
        ({"title": 12}, "must be text, got 12"),
        ({"fast": 0}, "true or"),
        ({"part.depth": 0.5}, "depth"),
    ):
        with pytest.raises(StructureError, match=words):
            configured(Toy, given)


def test_a_type_that_is_not_known_at_run_time_is_not_checked():
    class Odd(Toy):
        odd: "NoSuchName" = 1  # noqa: F821

    assert configured(Odd, dict([setting("odd=abc")])).odd == "abc"


def test_help_is_quick_and_light():
    # Half a second is generous for a busy machine; alone it takes a tenth of that.
    times = []
    for _ in range(3):
        began = time.perf_counter()
        subprocess.run([sys.executable, "-m", "vibrokit.cli", "--help"], check=True, capture_output=True)
        times.append(time.perf_counter() - began)
    assert min(times) < 0.5


def test_assess_prints_answers_and_keeps_them(toys, capsys):
    status = main([*ASSESS, "-o", "a.nc"])
    printed = capsys.readouterr().out
    assert status == 0
    assert "ΔU" in printed
    assert "written: a.nc" in printed
    assert vk.load_result("a.nc").complete


def test_assess_prints_one_object(toys, capsys):
    assert main([*ASSESS, "--json", "--within", "8h", "--mean-time", "1yr"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [one["analyzer"] for one in found["energies"]] == ["toy", "toy"]
    assert found["complete"]
    assert found["mean_times"] == found["occupancies"] == found["allowed_intensities"] == []


def test_an_interrupted_assessment_is_printed_kept_and_taken_up(toys, capsys, monkeypatch):
    def stop(problem):
        press()

    monkeypatch.setattr(Toy, "happens", staticmethod(stop))
    assert main([*ASSESS, "--json", "-o", "a.nc"]) == 130
    assert not json.loads(capsys.readouterr().out)["complete"]
    assert not vk.load_result("a.nc").complete
    monkeypatch.setattr(Toy, "happens", staticmethod(nothing_happens))
    assert main([*ASSESS, "--json", "-o", "a.nc"]) == 0
    assert json.loads(capsys.readouterr().out)["complete"]

"""The commands of the command line and their arguments, as a table.

A command names its function by module and name, so that ``--help`` imports none of them.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple

from vibrokit import __version__

Argument = tuple[tuple[str, ...], dict[str, Any]]


class Command(NamedTuple):
    """One command: a function of ``vibrokit.cli`` that takes the options and may return an exit status."""

    name: str
    function: str  # "module:name"
    help: str
    arguments: tuple[Argument, ...] = ()
    description: str | None = None
    epilog: str | None = None


def _argument(*names: str, **options: Any) -> Argument:
    return names, options


def _file(help: str, *names: str, metavar: str = "FILE", **options: Any) -> Argument:  # noqa: A002 - as argparse has it
    return names or ("-o", "--output"), {"type": Path, "metavar": metavar, "help": help, **options}


_SCENE = _argument("scene", help="a bundled scene, such as hertz-0.570, or a TOML file")
_SOURCE = _argument("--source", metavar="STATE", help="name or label of the state to leave (default: each)")
_EXIT = _argument(
    "--exit", metavar="NAME[:ARGUMENT]",
    help="the exit: leave-basin (default), first-contact[:SIDE], or that of a plug-in",
)  # fmt: skip
_SEED = _argument("--seed", type=int, default=0, help="seed of what is random (default 0)")
_TIME_LIMIT = _argument("--time-limit", type=float, metavar="SECONDS", help="stop after this time")
_JSON = _argument("--json", action="store_true", help="print one JSON object and draw nothing")

COMMANDS = (
    Command(
        "assess", "work:assess_scene",
        "compute how long each state lasts, by all methods, and test whether they agree",
        (
            _SCENE,
            _argument("--accuracy", type=float, default=0.1, help="relative error that is wanted (default 0.1)"),
            _argument("--mean-time", metavar="TIME",
                      help="also the largest noise intensity at which a state lasts this long, such as 1yr"),
            _argument("--within", metavar="TIME",
                      help="also the probability that a state is left within this time, such as 8h"),
            _SOURCE, _EXIT,
            _argument("--method", action="append", metavar="NAME", help="an analyzer to run (default: all three)"),
            _argument("--time-limit", type=float, metavar="SECONDS",
                      help="stop after this time (default 300; 0 for no limit)"),
            _file("a result to take over", "--known", action="append", default=[]),
            _SEED, _JSON,
            _file("save the assessment after each stage (netCDF); if the file exists, continue from it"),
            _file("where to save the figure (default: none)", "--figure"),
        ),
        "Find the steady states of a scene, and compute by three methods how long the mass stays in each "
        "of them. With -o FILE, 'vibrokit report FILE -o page.html' makes a page of the answer.",
        "Ctrl-C, SIGTERM and the time limit stop the work; the answers that were reached are printed and kept.",
    ),
    Command(
        "sweep", "work:sweep_scene", "which states exist along a parameter, and how long they last",
        (
            _SCENE,
            _argument("parameter", help="a parameter, or the end of its path; several, tied: gap.path=1,other.path=-1"),
            _argument("start", help="first value, with a unit if it is not in SI: 42Hz, 0.2mm"),
            _argument("stop", help="last value"),
            _argument("--count", type=int, default=11, help="number of values (default 11)"),
            _SOURCE,
            _argument("--search", metavar="VALUES",
                      help="those of the values at which exits are searched for: 60Hz,65Hz"),
            _argument("--states-only", action="store_true", help="no energies and mean times"),
            _SEED,
            _argument("--verbose", action="store_true", help="also each branch at each value, and every finding"),
            _TIME_LIMIT, _JSON,
            _file("save the sweep (netCDF)"),
            _file("where to save the figure (default: SCENE-sweep.png)", "--figure"),
        ),
        epilog="Example: vibrokit sweep tube.toml frequency 42Hz 78Hz --count 37. Ctrl-C, SIGTERM and the time limit "
        "stop the work; what was found is printed and kept.",
    ),
    Command(
        "run", "run:run", "find steady states and their activation energies",
        (
            _argument("scene", nargs="?", help=_SCENE[1]["help"]),
            _argument("--analyzer", nargs="*", action="extend", metavar="NAME",
                      help="analyzers to run (default: least-action); without a name, the structure only"),
            _EXIT, _SOURCE,
            _argument("--set", action="append", default=[], metavar="FIELD=VALUE",
                      help="a setting of the analyzer, or of a part of it: graph.nodes=240,240, shooting=none, "
                      "source=clear"),
            _argument("--stepper", metavar="NAME[:NUMBER]",
                      help="rk4:STEPS, rk8:STEPS, order8:TOLERANCE or free-flight:TOLERANCE"),
            _argument("--cells", type=int, default=200, help="cells of the basin grid in x and in v (default 200)"),
            _SEED, _TIME_LIMIT,
            _file("keep what mfet has done in this file, and continue from it", "--checkpoint"),
            _argument("--verbose", action="store_true",
                      help="print saddles, all paths, sensitivities and all remarks"),
            _JSON,
            _file("save the result (netCDF); with several analyzers, one FILE-NAME for each; if the work stops early, "
                  "the structure too, as FILE-structure, or as FILE if there is no result"),
            _file("where to save the figure (default: SCENE-NAME.png)", "--figure"),
        ),
        "Find the steady states of a scene, and compute activation energies, rates or densities. "
        "'vibrokit assess' makes one answer of them.",
        "Each result is printed and saved when it is found. Ctrl-C, SIGTERM and the time limit stop the work; results "
        "so far are kept, marked incomplete.",
    ),
    Command(
        "reconcile", "saved:reconcile_files", "compare saved results of one scene, exit by exit",
        (
            _file("result files, two at least", "file", nargs="+", metavar="file"),
            _argument("--level", type=float, default=0.01,
                      help="probability of a false alarm in each verdict (default 0.01)"),
            _argument("--json", action="store_true", help="print one JSON object"),
            _file("save the reconciliation (netCDF)"),
        ),
        "Test whether the methods of saved results agree, exit by exit, within their errors.",
        "The exit status is 1 if two results disagree, or one is incomplete.",
    ),
    Command(
        "report", "report:report_files", "print saved results of one scene, or write a page to hand on",
        (
            _file("result files", "file", nargs="+", metavar="file"),
            _file("write the page", metavar="FILE.html"),
            _file("write each table as comma-separated values", "--tables", metavar="FOLDER"),
            _argument("--title", help="title of the page (default: the name of the first file)"),
        ),
        "Print saved results of one scene; with -o, write a page that begins with the answer in plain words "
        "and ends with all settings. A file that exists is replaced.",
        "The page needs nothing else: no script, no file, no network. The exit status is 1 if a result is incomplete.",
    ),
    Command(
        "reproduce", "work:reproduce_paper",
        "compute the paper's numbers by all methods, draw its figures, and compare",
        (
            _argument("--quick", action="store_true", help="coarser basins, fewer starts, nodes and exits"),
            _TIME_LIMIT,
            _file("where records, figures, tables and the page go (default: reproduction)", metavar="FOLDER",
                  default=Path("reproduction")),
        ),
        epilog="Each piece is kept when it ends; a second call goes on from there. The exit status is 1 if the work "
        "was stopped before its end.",
    ),
    Command(
        "equations", "scene:equations", "print the derived equations",
        (_SCENE, _argument("--latex", action="store_true", help="as LaTeX")),
    ),
    Command(
        "plausibility", "scene:closed_forms",
        "print closed forms of a scene, and which are unusual, to find wrong units at once",
        (_SCENE, _argument("--json", action="store_true", help="print one JSON object")),
    ),
    Command("list", "listing:list_names", "list scenes, parts with their parameters, analyzers, exits and records"),
    Command(
        "new-plugin", "new_plugin:new_plugin", "write a distribution with a part of your own to start from",
        (
            _argument("name", help="name of the distribution, such as my-law; also that of its folder, which is made"),
            _argument("--kind", default="contact-law",
                      help="contact-law (default), spring, friction, excitation, noise or analyzer"),
        ),
        "Write a folder with pyproject.toml, a class with a small formula, its test and a README. It can be installed "
        "and passes its test.",
    ),
    Command("check", "toolkit:check_part", "check a registered part against the conformance kit", (_argument("name"),)),
    Command(
        "plot", "saved:plot_file", "draw a saved result",
        (_argument("file", type=Path), _file("picture to write (default: FILE.png)")),
    ),
    Command(
        "trade", "toolkit:trade", "measure error against time on this machine",
        (
            _SCENE, _file("where to save the figure"),
            _argument("--source", metavar="STATE", help="name or label of the state to leave (default: the first)"),
        ),
    ),
)  # fmt: skip


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line; its options have the `function` of the command."""
    whole = argparse.ArgumentParser(
        prog="vibrokit",
        description="Stochastic stability of vibro-impact oscillators: how stable each state is.",
        epilog="Begin with 'vibrokit assess hertz-0.570 -o answer.nc' and 'vibrokit report answer.nc -o answer.html'; "
        "'vibrokit COMMAND --help' explains a command.",
    )
    whole.add_argument("--version", action="version", version=f"vibrokit {__version__}")
    commands = whole.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS:
        one = commands.add_parser(
            command.name, help=command.help, description=command.description, epilog=command.epilog
        )
        for names, options in command.arguments:
            one.add_argument(*names, **options)
        one.set_defaults(function=command.function)
    return whole

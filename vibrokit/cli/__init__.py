"""The command line: vibrokit assess, sweep, run, reconcile, report, reproduce, plot, equations, list, check, trade."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from vibrokit import __version__
from vibrokit.cli import assess, report, reproduce, sweep
from vibrokit.errors import VibrokitError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status.

    Returns
    -------
    int
        0 if all went well, 1 if an analysis or a check failed or is incomplete, 2 if the input is wrong, 130 after
        Ctrl-C, 143 after SIGTERM.
    """
    options = parsed(arguments)
    try:
        status = int(options.command(options) or 0)
        sys.stdout.flush()
        return status
    except BrokenPipeError:  # the program that reads our output has ended
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (VibrokitError, OSError) as error:
        print(f"vibrokit: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("vibrokit: interrupted.", file=sys.stderr)
        return 130


def parsed(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Read the arguments of the command line."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if "analyzer" in options and options.analyzer is None:
        options.analyzer = ["least-action"]
    if "analyzer" in options and options.scene is None:  # the last of the analyzers' names is the scene's
        if len(options.analyzer) < 2:
            parser.error("the following arguments are required: scene")
        options.scene = options.analyzer.pop()
    return options


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="vibrokit",
        description="Stochastic stability of vibro-impact oscillators: how hard each state is to leave.",
        epilog="Begin with 'vibrokit assess hertz-0.570 -o answer.nc' and 'vibrokit report answer.nc -o answer.html'; "
        "'vibrokit COMMAND --help' explains a command.",
    )
    parser.add_argument("--version", action="version", version=f"vibrokit {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    which = "a bundled scene, such as hertz-0.570, or a TOML file"
    scene = argparse.ArgumentParser(add_help=False)
    scene.add_argument("scene", help=which)

    assess.add_parser(commands, scene)
    sweep.add_parser(commands, scene)

    run = commands.add_parser(
        "run",
        help="find steady states and their activation energies",
        description="Find the steady states of a scene and what its analyzers compute: activation energies, rates, "
        "densities. 'vibrokit assess' makes one answer of them.",
        epilog="Each result is printed and saved when it is found. Ctrl-C, SIGTERM and the time limit stop the work; "
        "what was found is kept, marked incomplete.",
    )
    run.add_argument("scene", nargs="?", help=which)
    run.add_argument(
        "--analyzer", nargs="*", action="extend", metavar="NAME",
        help="analyzers to run (default: least-action); without a name, the structure only",
    )  # fmt: skip
    run.add_argument(
        "--exit", metavar="NAME[:ARGUMENT]",
        help="what counts as leaving: leave-basin (default), first-contact[:SIDE], or the exit of a plug-in",
    )  # fmt: skip
    run.add_argument("--source", metavar="STATE", help="name or label of the attractor to leave (default: each)")
    run.add_argument(
        "--set", action="append", default=[], metavar="FIELD=VALUE",
        help="a setting of the analyzer, or of a part of it: graph.nodes=240,240, shooting=none, source=clear",
    )  # fmt: skip
    run.add_argument(
        "--stepper", metavar="NAME[:NUMBER]",
        help="rk4:STEPS, rk8:STEPS, order8:TOLERANCE or free-flight:TOLERANCE",
    )  # fmt: skip
    run.add_argument("--cells", type=int, default=200, help="cells of the basin grid in x and in v (default 200)")
    run.add_argument("--seed", type=int, default=0, help="seed of what is random (default 0)")
    run.add_argument("--time-limit", type=float, metavar="SECONDS", help="stop after this time")
    run.add_argument(
        "--checkpoint", type=Path, metavar="FILE", help="keep what mfet has done in this file, and go on from it"
    )
    run.add_argument("--verbose", action="store_true", help="print saddles, all paths, sensitivities and all remarks")
    run.add_argument("--json", action="store_true", help="print one JSON object and draw nothing")
    run.add_argument(
        "-o", "--output", type=Path, metavar="FILE",
        help="save the result (netCDF); with several analyzers, one FILE-NAME for each; if the work stops early, the "
        "structure too, as FILE-structure, or as FILE if there is no result",
    )  # fmt: skip
    run.add_argument("--figure", type=Path, metavar="FILE", help="where to save the figure (default: SCENE-NAME.png)")
    run.set_defaults(command=_run)

    reconcile = commands.add_parser(
        "reconcile", help="compare saved results of one scene, exit by exit",
        description="Say whether the methods of saved results agree, exit by exit, within their errors.",
        epilog="The exit status is 1 if two results disagree, or one is incomplete.",
    )  # fmt: skip
    reconcile.add_argument("file", type=Path, nargs="+", help="what run or save wrote, two files at least")
    reconcile.add_argument(
        "--level", type=float, default=0.01, help="probability of a false alarm in each verdict (default 0.01)"
    )
    reconcile.add_argument("--json", action="store_true", help="print one JSON object")
    reconcile.add_argument("-o", "--output", type=Path, metavar="FILE", help="save the reconciliation (netCDF)")
    reconcile.set_defaults(command=_reconcile)

    report.add_parser(commands)
    reproduce.add_parser(commands)

    equations = commands.add_parser("equations", parents=[scene], help="print the derived equations")
    equations.add_argument("--latex", action="store_true", help="as LaTeX")
    equations.set_defaults(command=_equations)

    commands.add_parser("list", help="list scenes, parts, analyzers, exits and records").set_defaults(command=_list)

    check = commands.add_parser("check", help="check a registered part against the conformance kit")
    check.add_argument("name")
    check.set_defaults(command=_check)

    plot = commands.add_parser("plot", help="draw a saved result")
    plot.add_argument("file", type=Path)
    plot.add_argument("-o", "--output", type=Path, metavar="FILE", help="picture to write (default: FILE.png)")
    plot.set_defaults(command=_plot)

    trade = commands.add_parser("trade", parents=[scene], help="measure error against time on this machine")
    trade.add_argument("-o", "--output", type=Path, metavar="FILE", help="where to save the figure")
    trade.add_argument("--source", metavar="STATE", help="name or label of the attractor to leave (default: the first)")
    trade.set_defaults(command=_trade)
    return parser


def _run(options: argparse.Namespace) -> int:
    from vibrokit.cli.run import run

    return run(options)


def _equations(options: argparse.Namespace) -> None:
    from vibrokit.scene_file import load_scene

    model = load_scene(options.scene).model
    print(model.latex if options.latex else model)


def _list(options: argparse.Namespace) -> None:
    from vibrokit.registry import Group, names
    from vibrokit.scene_file import bundled_scenes

    print("scenes:", ", ".join(bundled_scenes()))
    for group in Group:
        print(f"{group.noun}s:")
        for registered in names(group):
            print(f"    {registered.name:<20} {registered.distribution}")


def _check(options: argparse.Namespace) -> int:
    from vibrokit.testing import check

    report = check(options.name)
    print("\n".join(report.lines))
    return 0 if report.passed else 1


def _plot(options: argparse.Namespace) -> None:
    from vibrokit.results.files import load_result
    from vibrokit.results.pictures import save_figure

    picture = options.output or options.file.with_suffix(".png")
    save_figure(load_result(options.file).plot(), picture)
    print(picture)


def _reconcile(options: argparse.Namespace) -> int:
    from vibrokit.cli.reconcile import reconcile_files

    return reconcile_files(options)


def _trade(options: argparse.Namespace) -> None:
    from vibrokit.cli.run import scene_stem, source_of
    from vibrokit.plots.trade import work_precision
    from vibrokit.progress import working
    from vibrokit.results.pictures import save_figure
    from vibrokit.scene_file import load_scene
    from vibrokit.trade.assessments import measure_assessments
    from vibrokit.trade.basins import measure_basins
    from vibrokit.trade.methods import measure_densities, measure_energies, measure_exit_times
    from vibrokit.trade.steppers import measure_steppers

    osc = load_scene(options.scene)
    source = None if options.source is None else source_of(options.source)
    with working(True):
        table = measure_steppers(osc)
        print(table, flush=True)
        for measure in (
            measure_basins,
            partial(measure_energies, source=source),
            partial(measure_densities, source=source),
            partial(measure_exit_times, source=source),
            partial(measure_assessments, source=source),
        ):
            try:
                print(f"\n{measure(osc)}", flush=True)
            except VibrokitError as error:  # what was measured so far is worth its table
                print(f"vibrokit: {error}", file=sys.stderr)
    picture = options.output or Path(f"{scene_stem(options.scene)}-trade.png")
    save_figure(work_precision(table.rows), picture)
    print(f"figure: {picture}")

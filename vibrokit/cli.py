"""The command line: vibrokit run, equations, list, check, plot, trade."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vibrokit import __version__
from vibrokit.errors import SceneError, StructureError, VibrokitError

if TYPE_CHECKING:
    from vibrokit.kernels.ensemble import Progress
    from vibrokit.results.continuation import Continuation
    from vibrokit.results.result import Result
    from vibrokit.results.structure import Structure

_PATIENCE = 2.0  # seconds after which progress is shown


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status: 0, 1 where a check failed, 2 where the input is wrong."""
    options = parsed(arguments)
    try:
        status = int(options.command(options) or 0)
        sys.stdout.flush()
        return status
    except BrokenPipeError:  # the reader of our output has had enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (VibrokitError, OSError) as error:
        print(f"vibrokit: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("vibrokit: stopped; nothing was written.", file=sys.stderr)
        return 130


def parsed(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Read the arguments of the command line."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if "analyzer" in options and options.scene is None:  # the last of the analyzers' names is the scene's
        if len(options.analyzer) < 2:
            parser.error("the following arguments are required: scene")
        options.scene = options.analyzer.pop()
    return options


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="vibrokit",
        description="Stochastic stability of vibro-impact oscillators: how hard each state is to leave.",
    )
    parser.add_argument("--version", action="version", version=f"vibrokit {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    which = "a bundled scene, such as hertz-0.570, or a TOML file"
    scene = argparse.ArgumentParser(add_help=False)
    scene.add_argument("scene", help=which)

    run = commands.add_parser("run", help="find steady states and their activation energies")
    run.add_argument("scene", nargs="?", help=which)
    run.add_argument(
        "--analyzer",
        nargs="*",
        default=["least-action"],
        metavar="NAME",
        help="default: least-action; none: structure only",
    )
    run.add_argument(
        "--exit", metavar="EXIT", help="leave-basin (default) or first-contact[:SIDE], what counts as leaving"
    )
    run.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="FIELD=NUMBER",
        help="a setting of the analyzer, or of a part of it, such as graph.cells=240,240",
    )
    run.add_argument("--stepper", metavar="NAME[:NUMBER]", help="rk4:STEPS, order8:TOLERANCE or free-flight:TOLERANCE")
    run.add_argument("--cells", type=int, default=200, help="cells of the basin grid in x and in v (default 200)")
    run.add_argument("--seed", type=int, default=0, help="seed of what is random (default 0)")
    run.add_argument("--json", action="store_true", help="print one JSON object and draw nothing")
    run.add_argument("-o", "--output", type=Path, metavar="FILE", help="save the result (netCDF)")
    run.add_argument("--figure", type=Path, metavar="FILE", help="where to save the figure")
    run.set_defaults(command=_run)

    equations = commands.add_parser("equations", parents=[scene], help="print the derived equations")
    equations.add_argument("--latex", action="store_true", help="as LaTeX")
    equations.set_defaults(command=_equations)

    commands.add_parser("list", help="list scenes, parts and analyzers").set_defaults(command=_list)

    check = commands.add_parser("check", help="check a registered part against the conformance kit")
    check.add_argument("name")
    check.set_defaults(command=_check)

    plot = commands.add_parser("plot", help="draw a saved result")
    plot.add_argument("file", type=Path)
    plot.add_argument("-o", "--output", type=Path, metavar="FILE", help="picture to write (default: FILE.png)")
    plot.set_defaults(command=_plot)

    trade = commands.add_parser("trade", parents=[scene], help="error against time on this machine")
    trade.add_argument("-o", "--output", type=Path, metavar="FILE", help="where to save the figure")
    trade.add_argument(
        "--source", type=int, metavar="LABEL", help="the attractor that energies are measured for (default: the first)"
    )
    trade.set_defaults(command=_trade)
    return parser


def _run(options: argparse.Namespace) -> None:
    from vibrokit import report
    from vibrokit.analyzers.analyzer import Analyzer
    from vibrokit.analyzers.named import named_exit
    from vibrokit.analyzers.settings import configured, setting
    from vibrokit.kernels.named import named_stepper
    from vibrokit.registry import Group, load
    from vibrokit.results.pictures import checked_picture
    from vibrokit.scene_file import load_scene
    from vibrokit.structure.find import find_structure

    began = time.perf_counter()
    for target in (options.output, options.figure):
        if target is not None and not target.parent.is_dir():
            raise VibrokitError(f"{target} would be in {target.parent}, which is no folder; make it first.")
    if options.figure is not None:
        checked_picture(options.figure)
    osc = load_scene(options.scene)
    kinds = [load(Group.ANALYZERS, name, Analyzer) for name in options.analyzer]
    settings = dict(setting(text) for text in options.set)
    stepper = None if options.stepper is None else named_stepper(options.stepper)
    if stepper is not None:
        settings["stepper"] = stepper
    if options.exit is not None:
        settings["exit"] = named_exit(options.exit)
    analyzers = [configured(kind, settings) for kind in kinds]
    cells = (_cells(options.cells),) * 2
    with _Bar("basins") as bar:
        structure = find_structure(osc, cells=cells, stepper=stepper, rng=options.seed, progress=bar)
    if not options.json:
        print(report.attractor_table(options.scene, structure))
        print(report.saddle_table(structure), end="")
    if not structure.complete:
        raise KeyboardInterrupt
    results = {}
    for name, analyzer in zip(options.analyzer, analyzers, strict=True):
        try:
            with _Bar(name) as bar:
                results[name] = analyzer.run(osc, structure, progress=bar)
        except StructureError as error:  # what was found so far is worth its table
            print(f"vibrokit: {name}: {error}", file=sys.stderr)
    _keep(options, structure, results, time.perf_counter() - began)


def _keep(options: argparse.Namespace, structure: Structure, results: dict[str, Result], seconds: float) -> None:
    """Save and draw the results; the structure itself where no analyzer was asked for."""
    from vibrokit import report

    records: dict[str, Any] = results if options.analyzer else {"structure": structure}
    if options.output is not None:
        for name, found in records.items():
            found.save(_numbered(options.output, name, len(records)))
    if options.json:
        print(json.dumps(report.record(options.scene, options.seed, structure, results, seconds), allow_nan=False))
        return
    for name, found in records.items():
        if name in results:
            print(report.analysis(name, found))
        figure = options.figure or Path(f"{_stem(options.scene)}.png")
        figure = _numbered(figure, name, len(records) if options.figure else 2)
        _save_figure(found, figure)
        print(f"figure: {figure}")
    print(f"{seconds:.1f} s")


def _cells(count: int) -> int:
    if not 2 <= count <= 20_000:
        raise VibrokitError(f"--cells is {count}; give a whole number from 2 to 20000.")
    return count


def _stem(scene: str) -> str:
    return Path(scene).name.removesuffix(".toml")


def _numbered(path: Path, name: str, count: int) -> Path:
    ending = path.suffix if path.suffix in (".png", ".pdf", ".svg", ".nc") else ""
    return path if count == 1 else path.with_name(f"{path.name.removesuffix(ending)}-{name}{ending}")


class _Bar:
    """Progress on standard error, shown once work has taken a while."""

    def __init__(self, title: str) -> None:
        self.title = title

    def __enter__(self) -> Progress:
        from tqdm import tqdm

        self.bar: Any = tqdm(desc=self.title, delay=_PATIENCE, leave=False, unit="block", file=sys.stderr)

        def show(done: int, total: int) -> None:
            self.bar.total = total
            self.bar.update(done - self.bar.n)

        return show

    def __exit__(self, *error: object) -> None:
        self.bar.close()


def _save_figure(result: Result | Structure | Continuation, path: Path) -> None:
    from vibrokit.results.pictures import save_figure

    save_figure(result.plot(), path)


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

    picture = options.output or options.file.with_suffix(".png")
    _save_figure(load_result(options.file), picture)
    print(picture)


def _trade(options: argparse.Namespace) -> None:
    from vibrokit.plots.trade import work_precision
    from vibrokit.results.pictures import save_figure
    from vibrokit.scene_file import load_scene
    from vibrokit.trade.basins import measure_basins
    from vibrokit.trade.energies import measure_energies
    from vibrokit.trade.steppers import measure_steppers

    osc = load_scene(options.scene)
    with _Bar("steppers") as bar:
        table = measure_steppers(osc, progress=bar)
    print(table, flush=True)
    try:
        with _Bar("basins") as bar:
            print(f"\n{measure_basins(osc, progress=bar)}", flush=True)
    except StructureError as error:  # what was measured so far is worth its table
        print(f"vibrokit: basins: {error}", file=sys.stderr)
    try:
        with _Bar("energies") as bar:
            print(f"\n{measure_energies(osc, source=options.source, progress=bar)}")
    except (SceneError, StructureError) as error:
        print(f"vibrokit: energies: {error}", file=sys.stderr)
    picture = options.output or Path(f"{_stem(options.scene)}-trade.png")
    save_figure(work_precision(table.rows), picture)
    print(f"figure: {picture}")


if __name__ == "__main__":
    sys.exit(main())

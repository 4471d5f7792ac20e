"""vibrokit sweep: which states exist along a parameter, and how long they last."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser], scene: argparse.ArgumentParser) -> None:
    """Add the command to the parser of the command line."""
    parser = commands.add_parser(
        "sweep",
        parents=[scene],
        help="which states exist along a parameter, and how long they last",
        epilog="Example: vibrokit sweep tube.toml frequency 42Hz 78Hz --count 37. Ctrl-C, SIGTERM and the time limit "
        "stop the work; what was found is printed and kept.",
    )
    parser.add_argument(
        "parameter", help="a parameter, or the end of its path; several, tied: gap.path=1,other.path=-1"
    )
    parser.add_argument("start", help="first value, with a unit if it is not in SI: 42Hz, 0.2mm")
    parser.add_argument("stop", help="last value")
    parser.add_argument("--count", type=int, default=11, help="number of values (default 11)")
    parser.add_argument("--source", metavar="STATE", help="name or label of the state to leave (default: each)")
    parser.add_argument(
        "--search", metavar="VALUES", help="those of the values at which exits are searched for: 60Hz,65Hz"
    )
    parser.add_argument("--states-only", action="store_true", help="no energies and mean times")
    parser.add_argument("--seed", type=int, default=0, help="seed of what is random (default 0)")
    parser.add_argument("--verbose", action="store_true", help="also each branch at each value, and every finding")
    parser.add_argument("--time-limit", type=float, metavar="SECONDS", help="stop after this time")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="save the sweep (netCDF)")
    parser.add_argument(
        "--figure", type=Path, metavar="FILE", help="where to save the figure (default: SCENE-sweep.png)"
    )
    parser.set_defaults(command=sweep_scene)


def sweep_scene(options: argparse.Namespace) -> int:
    """Run the command and return its exit status."""
    import numpy as np

    from vibrokit.assessment.sweep import sweep
    from vibrokit.cli.interrupts import Interrupts
    from vibrokit.cli.run import scene_stem, source_of
    from vibrokit.errors import ParameterError
    from vibrokit.progress import working
    from vibrokit.report.text import record_text
    from vibrokit.results.atomic import checked_target
    from vibrokit.results.pictures import checked_picture, save_figure
    from vibrokit.scene_file import load_scene
    from vibrokit.structure.parameter_values import parameter_line
    from vibrokit.text_units import number_in, size_of

    if options.output is not None:
        checked_target(options.output)
    picture = checked_picture(options.figure or Path(f"{scene_stem(options.scene)}-sweep.png"))
    if options.count < 2:
        raise ParameterError(f"--count must be a whole number, at least 2, got {options.count}.")
    osc = load_scene(options.scene)
    line = parameter_line("sweep", osc, _parameter(options.parameter))
    (first, unit), (last, other) = (number_in(text, line.entry.declared.unit) for text in (options.start, options.stop))
    if unit != other:
        raise ParameterError(f"{options.start} and {options.stop} have different units; give both in one unit.")
    search = options.search and [number_in(text, line.entry.declared.unit) for text in options.search.split(",")]
    if search and any(own != unit for _, own in search):
        raise ParameterError(f"--search {options.search} has another unit than {options.start}; give both in one unit.")
    source = None if options.source is None else source_of(options.source)
    size = 1.0 if unit is None else size_of(unit, line.entry.declared.unit)
    values = np.linspace(first / size, last / size, options.count).tolist()
    with Interrupts() as interrupts:
        with working(True, options.time_limit) as work:
            interrupts.stops(work)
            found = sweep(
                osc, line.argument, values, unit=unit, source=source, energies=not options.states_only,
                search=search and [value / size for value, _ in search],
                rng=options.seed,
            )  # fmt: skip
        interrupts.finishing()
        print(record_text(f"{options.scene}: sweep", found, brief=not options.verbose))
        if options.output is not None:
            found.save(options.output)
            print(f"written: {options.output}")
        save_figure(found.plot(), picture)
        print(f"figure: {picture}")
        if interrupts.requested:
            return interrupts.status
    return 0 if found.complete else 1


def _parameter(text: str) -> str | dict[str, float]:
    """A parameter by name, or the factors of several."""
    from vibrokit.errors import ParameterError, shown

    if "=" not in text:
        return text
    tied = {}
    for part in text.split(","):
        name, _, factor = part.partition("=")
        try:
            tied[name.strip()] = float(factor)
        except ValueError:
            raise ParameterError(f"{shown(part)} ties no parameter; write its name, '=' and a number.") from None
    return tied

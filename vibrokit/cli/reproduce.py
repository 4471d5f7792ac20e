"""vibrokit reproduce: the paper, whole, into a folder."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser of the command line."""
    parser = commands.add_parser(
        "reproduce",
        help="compute the paper's numbers by all methods, draw its figures, and compare",
        epilog="Each piece is kept when it ends; a second call goes on from there. The exit status is 1 if the work "
        "was stopped before its end.",
    )
    parser.add_argument("--quick", action="store_true", help="coarser basins, fewer starts, nodes and exits")
    parser.add_argument("--time-limit", type=float, metavar="SECONDS", help="stop after this time")
    parser.add_argument(
        "-o", "--output", type=Path, default=Path("reproduction"), metavar="FOLDER",
        help="where records, figures, tables and the page go (default: reproduction)",
    )  # fmt: skip
    parser.set_defaults(command=reproduce_paper)


def reproduce_paper(options: argparse.Namespace) -> int:
    """Run the command and return its exit status."""
    from vibrokit.cli.interrupts import Interrupts
    from vibrokit.progress import working
    from vibrokit.reproduction.reproduce import PAGE, PUBLISHED, reproduce

    with Interrupts() as interrupts:
        with working(True, options.time_limit) as work:
            interrupts.stops(work)
            report = reproduce(options.output, quick=options.quick)
        interrupts.finishing()
        print("\n\n".join(table.text for table in report.tables if table.name == PUBLISHED))
        print(options.output / PAGE)
        if interrupts.requested:
            return interrupts.status
    return 0 if report.complete else 1

"""vibrokit assess: from a scene to the answers; each stage is kept as soon as it ends."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vibrokit.assessment.assessment import Assessment
    from vibrokit.report.assessment import Question


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser], scene: argparse.ArgumentParser) -> None:
    """Add the command to the parser of the command line."""
    parser = commands.add_parser(
        "assess",
        parents=[scene],
        help="answer how long each state lasts, by all methods, and whether they agree",
        description="Find the steady states of a scene, and answer how long noise leaves the mass in each of them, by "
        "three methods. With -o FILE, 'vibrokit report FILE -o page.html' makes a page of the answer.",
        epilog="Ctrl-C, SIGTERM and the time limit stop the work; the answers that were reached are printed and kept.",
    )
    parser.add_argument("--accuracy", type=float, default=0.1, help="relative error that is wanted (default 0.1)")
    parser.add_argument("--mean-time", metavar="TIME", help='how much noise a state bears that has to last "1yr"')
    parser.add_argument("--within", metavar="TIME", help='how likely a state is left within "8h"')
    parser.add_argument("--source", metavar="STATE", help="name or label of the state to leave (default: each)")
    parser.add_argument(
        "--exit", metavar="NAME[:ARGUMENT]", help="what counts as leaving: leave-basin (default), first-contact[:SIDE]"
    )
    parser.add_argument("--method", action="append", metavar="NAME", help="an analyzer to run (default: all three)")
    parser.add_argument(
        "--time-limit", type=float, metavar="SECONDS", help="stop after this time (default 300; 0 for no limit)"
    )
    parser.add_argument("--known", action="append", default=[], type=Path, metavar="FILE", help="a result to take over")
    parser.add_argument("--seed", type=int, default=0, help="seed of what is random (default 0)")
    parser.add_argument("--json", action="store_true", help="print one JSON object and draw nothing")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE",
        help="save the assessment after each stage (netCDF); if the file exists, go on from it",
    )  # fmt: skip
    parser.add_argument("--figure", type=Path, metavar="FILE", help="where to save the figure (default: none)")
    parser.set_defaults(command=assess_scene)


def assess_scene(options: argparse.Namespace) -> int:
    """Run the command and return its exit status."""
    from vibrokit.analyzers.settings import named_exit
    from vibrokit.assessment.assess import TIME_LIMIT, assess
    from vibrokit.assessment.durations import required_time, seconds_in
    from vibrokit.assessment.plausibility import plausibility
    from vibrokit.cli.interrupts import Interrupts
    from vibrokit.cli.run import source_of
    from vibrokit.progress import working
    from vibrokit.report.assessment import Question
    from vibrokit.results.atomic import checked_target
    from vibrokit.results.pictures import checked_picture, save_figure
    from vibrokit.scene_file import load_scene

    for target in (options.output, options.figure):
        if target is not None:
            checked_target(target)
    if options.figure is not None:
        checked_picture(options.figure)
    osc = load_scene(options.scene)
    if options.mean_time is not None:
        required_time(options.mean_time, osc.section_interval)
    if options.within is not None:
        seconds_in(options.within, period=osc.section_interval)
    question = Question(options.mean_time, options.within)
    source = None if options.source is None else source_of(options.source)
    limit = TIME_LIMIT if options.time_limit is None else options.time_limit
    if not options.json:
        print(f"{plausibility(osc)}\n", flush=True)
    with Interrupts() as interrupts:
        with working(True, limit or None) as work:
            interrupts.stops(work)
            try:
                last = assess(
                    osc, accuracy=options.accuracy, time_limit=limit or None, methods=options.method, source=source,
                    exit=None if options.exit is None else named_exit(options.exit), rng=options.seed,
                    known=options.known, checkpoint=options.output,
                )  # fmt: skip
            finally:
                interrupts.finishing()
        _print(options, last, question)
        if options.figure is not None and not interrupts.requested:
            save_figure(last.plot(), options.figure)
            print(f"figure: {options.figure}")
        if interrupts.requested:
            return interrupts.status
    return 0 if last.complete else 1


def _print(options: argparse.Namespace, last: Assessment, question: Question) -> None:
    from vibrokit.report.assessment import assessment_data, assessment_text
    from vibrokit.results.record import versions

    if options.json:
        found = {"scene": options.scene, **assessment_data(last, question), "versions": versions()}
        print(json.dumps({**found, "seed": options.seed, "seconds": last.seconds}, allow_nan=False))
    else:
        print(assessment_text(f"{options.scene}: which state lasts, and how long", last, question))
        if options.output is not None:
            print(f"written: {options.output}")
    sys.stdout.flush()

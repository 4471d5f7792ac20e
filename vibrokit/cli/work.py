"""vibrokit assess, sweep and reproduce: long work that ends in one record or folder, whatever stops it."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from vibrokit.analyzers.settings import named_exit
from vibrokit.assessment.assess import TIME_LIMIT, assess
from vibrokit.assessment.assessment import Assessment
from vibrokit.assessment.durations import required_time, seconds_in
from vibrokit.assessment.plausibility import plausibility
from vibrokit.assessment.sweep import sweep
from vibrokit.cli.json_output import print_json
from vibrokit.cli.long_work import Interrupts, check_targets, scene_stem, source_of
from vibrokit.errors import ParameterError, shown
from vibrokit.report.assessment import Question, assessment_data, assessment_text
from vibrokit.report.data import sweep_data
from vibrokit.report.text import record_text
from vibrokit.reproduction.reproduce import PAGE, PUBLISHED, reproduce
from vibrokit.results.atomic import save_figure
from vibrokit.scene_file import load_scene
from vibrokit.structure.parameter_values import parameter_line


def assess_scene(options: argparse.Namespace) -> int:
    """Answer how long each state lasts; each stage is kept as soon as it ends."""
    check_targets(options.output, picture=options.figure)
    osc = load_scene(options.scene)
    if options.mean_time is not None:
        required_time(options.mean_time, osc.section_interval)
    if options.within is not None:
        seconds_in(options.within, period=osc.section_interval)
    exit_ = None if options.exit is None else named_exit(options.exit)
    limit = (TIME_LIMIT if options.time_limit is None else options.time_limit) or None
    if not options.json:
        print(f"{plausibility(osc)}\n", flush=True)
    with Interrupts() as interrupts:
        with interrupts.working(limit):
            found = assess(
                osc, accuracy=options.accuracy, time_limit=limit, methods=options.method,
                source=source_of(options.source), exit=exit_, rng=options.seed, known=options.known,
                checkpoint=options.output,
            )  # fmt: skip
        _print_assessment(options, found)
        if options.figure is not None and not interrupts.requested:
            save_figure(found.plot(), options.figure)
            print(f"figure: {options.figure}")
        return interrupts.status(0 if found.complete else 1)


def _print_assessment(options: argparse.Namespace, found: Assessment) -> None:
    question = Question(options.mean_time, options.within)
    if options.json:
        data = assessment_data(found, question)
        print_json(scene=options.scene, **data, seed=options.seed, seconds=found.seconds)
    else:
        print(assessment_text(f"{options.scene}: which state lasts, and how long", found, question))
        if options.output is not None:
            print(f"written: {options.output}")
    sys.stdout.flush()


def sweep_scene(options: argparse.Namespace) -> int:
    """Say which states exist along a parameter, and how long they last."""
    picture = options.figure or Path(f"{scene_stem(options.scene)}-sweep.png")
    check_targets(options.output, picture=picture)
    if options.count < 2:
        raise ParameterError(f"--count must be a whole number, at least 2, got {options.count}.")
    osc = load_scene(options.scene)
    line = parameter_line("sweep", osc, _parameter(options.parameter))
    declared = line.entry.declared
    (first, unit), (last, other) = (
        declared.number_in(line.path, text, osc.mass) for text in (options.start, options.stop)
    )
    if unit != other:
        raise ParameterError(f"{options.start} and {options.stop} have different units; give both in one unit.")
    listed = options.search.split(",") if options.search else []
    searched = [declared.number_in(f"--search of {line.path}", text, osc.mass) for text in listed]
    if any(own != unit for _, own in searched):
        raise ParameterError(f"--search {options.search} has another unit than {options.start}; give both in one unit.")
    size = 1.0 if unit is None else declared.size_of(unit, osc.mass)
    with Interrupts() as interrupts:
        with interrupts.working(options.time_limit):
            found = sweep(
                osc, line.argument, np.linspace(first / size, last / size, options.count).tolist(), unit=unit,
                source=source_of(options.source), energies=not options.states_only, rng=options.seed,
                search=[value / size for value, _ in searched] or None,
            )  # fmt: skip
        if options.output is not None:
            found.save(options.output)
        if options.json:
            print_json(scene=options.scene, **sweep_data(found), seed=options.seed, seconds=found.seconds)
        else:
            print(record_text(f"{options.scene}: sweep", found, brief=not options.verbose))
            if options.output is not None:
                print(f"written: {options.output}")
            save_figure(found.plot(), picture)
            print(f"figure: {picture}")
        return interrupts.status(0 if found.complete else 1)


def _parameter(text: str) -> str | dict[str, float]:
    """A parameter by name, or the factors of several."""
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


def reproduce_paper(options: argparse.Namespace) -> int:
    """Compute the paper, whole, into a folder."""
    with Interrupts() as interrupts:
        with interrupts.working(options.time_limit):
            report = reproduce(options.output, quick=options.quick)
        print("\n\n".join(table.text for table in report.tables if table.name == PUBLISHED))
        print(options.output / PAGE)
        return interrupts.status(0 if report.complete else 1)

"""vibrokit check and trade: test a part, and measure error against time on this machine."""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path

from vibrokit.cli.long_work import check_targets, scene_stem, source_of
from vibrokit.errors import VibrokitError
from vibrokit.plots.trade import work_precision
from vibrokit.progress import working
from vibrokit.results.atomic import save_figure
from vibrokit.scene_file import load_scene
from vibrokit.testing import check
from vibrokit.trade.assessments import measure_assessments
from vibrokit.trade.basins import measure_basins
from vibrokit.trade.methods import measure_densities, measure_energies, measure_exit_times
from vibrokit.trade.steppers import measure_steppers


def check_part(options: argparse.Namespace) -> int:
    """Check a registered part against the conformance kit."""
    report = check(options.name)
    print(report)
    return 0 if report.passed else 1


def trade(options: argparse.Namespace) -> None:
    """Measure error against time on this machine; what was measured before one table fails is printed."""
    picture = options.output or Path(f"{scene_stem(options.scene)}-trade.png")
    check_targets(picture=picture)
    osc, source = load_scene(options.scene), source_of(options.source)
    with working(True):
        table = measure_steppers(osc)
        print(table, flush=True)
        of_states = (measure_energies, measure_densities, measure_exit_times, measure_assessments)
        for measure in (measure_basins, *(partial(one, source=source) for one in of_states)):
            try:
                print(f"\n{measure(osc)}", flush=True)
            except VibrokitError as error:
                print(f"vibrokit: {error}", file=sys.stderr)
    save_figure(work_precision(table.rows), picture)
    print(f"figure: {picture}")

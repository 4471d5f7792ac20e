"""vibrokit reconcile and plot: saved results, without what has computed them."""

from __future__ import annotations

import argparse
import sys

from vibrokit.cli.json_output import print_json
from vibrokit.cli.long_work import check_targets
from vibrokit.comparison.reconcile import reconcile
from vibrokit.report.data import reconciliation_data
from vibrokit.report.text import record_text
from vibrokit.results.atomic import save_figure
from vibrokit.results.files import load_result


def reconcile_files(options: argparse.Namespace) -> int:
    """Compare saved results of one scene; the status is 1 if methods disagree or a result is incomplete."""
    check_targets(options.output)
    found = reconcile(*options.file, level=options.level)
    if options.json:
        files = [str(path) for path in options.file]
        print_json(files=files, **reconciliation_data(found))
    else:
        print(record_text(f"Reconciliation of {', '.join(map(str, options.file))}", found))
    if options.output is not None:
        found.save(options.output)
        print(f"written: {options.output}", file=sys.stderr if options.json else sys.stdout)
    return 0 if found.agreed and found.complete else 1


def plot_file(options: argparse.Namespace) -> None:
    """Draw a saved result."""
    picture = options.output or options.file.with_suffix(".png")
    save_figure(load_result(options.file).plot(), picture)
    print(picture)

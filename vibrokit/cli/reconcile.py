"""vibrokit reconcile: compare saved results of one scene."""

from __future__ import annotations

import argparse
import json
import sys


def reconcile_files(options: argparse.Namespace) -> int:
    """Run the command and return its exit status: 1 if methods disagree or a result is incomplete."""
    from vibrokit.comparison.reconcile import reconcile
    from vibrokit.report.data import reconciliation_data
    from vibrokit.report.text import record_text
    from vibrokit.results.atomic import checked_target
    from vibrokit.results.record import versions

    if options.output is not None:
        checked_target(options.output)
    found = reconcile(*options.file, level=options.level)
    if options.json:
        files = [str(path) for path in options.file]
        print(json.dumps({"files": files, **reconciliation_data(found), "versions": versions()}, allow_nan=False))
    else:
        print(record_text(f"Reconciliation of {', '.join(map(str, options.file))}", found))
    if options.output is not None:
        found.save(options.output)
        print(f"written: {options.output}", file=sys.stderr if options.json else sys.stdout)
    return 0 if found.agreed and found.complete else 1

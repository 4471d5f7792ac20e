"""vibrokit report: what saved results say, as text or as a page to hand on."""

from __future__ import annotations

import argparse

from vibrokit.assessment.assessment import Assessment
from vibrokit.cli.long_work import check_targets
from vibrokit.report.assessment import assessment_text
from vibrokit.report.material import gathered
from vibrokit.report.report import Report, checked_page
from vibrokit.report.tables import input_table
from vibrokit.report.text import record_text
from vibrokit.results.atomic import made_folder
from vibrokit.results.files import load_result


def report_files(options: argparse.Namespace) -> int:
    """Print what saved results of one scene say, or write a page to hand on."""
    if options.output is not None:
        check_targets(checked_page(options.output))
    if options.tables is not None:
        made_folder(options.tables)
    records = [load_result(path) for path in options.file]
    if options.output is None and options.tables is None:
        material = gathered(records)
        for one in material:
            title = f"{', '.join(map(str, options.file))}: {one.kind}"
            text = assessment_text(title, one) if isinstance(one, Assessment) else record_text(title, one)
            print(text, end="\n\n")
        print(input_table(records[0].oscillator).text)
        return 0 if all(one.complete for one in material) else 1
    report = Report.of(*records, title=options.title or options.file[0].stem)
    if options.output is not None:
        report.save(options.output)
        print(options.output)
    if options.tables is not None:
        print("\n".join(map(str, report.save_tables(options.tables))))
    return 0 if report.complete else 1

"""vibrokit report: what saved results say, as text or as a page to hand on."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser of the command line."""
    parser = commands.add_parser(
        "report",
        help="print what saved results of one scene say, or write a page to hand on",
        description="Print what saved results of one scene say; with -o, write a page that begins with the answer in "
        "plain words and ends with all settings. A file that exists is replaced.",
        epilog="The page needs nothing else: no script, no file, no network. The exit status is 1 if a result is "
        "incomplete.",
    )
    parser.add_argument("file", type=Path, nargs="+", help="what assess, run, reconcile or save wrote")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.html", help="write the page")
    parser.add_argument("--tables", type=Path, metavar="FOLDER", help="write each table as comma-separated values")
    parser.add_argument("--title", help="title of the page (default: the name of the first file)")
    parser.set_defaults(command=report_files)


def report_files(options: argparse.Namespace) -> int:
    """Run the command and return its exit status."""
    from vibrokit.assessment.assessment import Assessment
    from vibrokit.report.assessment import assessment_text
    from vibrokit.report.material import gathered
    from vibrokit.report.report import Report, checked_page
    from vibrokit.report.tables import input_table
    from vibrokit.report.text import record_text
    from vibrokit.results.atomic import checked_target, made_folder
    from vibrokit.results.files import load_result

    if options.output is not None:
        checked_target(checked_page(options.output))
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

"""The published numbers of the paper beside those of this toolkit, by the same methods, as a table.

    python -m tests.benchmarks.published [--folder FOLDER] [--quick] [--csv FILE]

The work is that of `vibrokit reproduce`, whose records stay in the folder, so that a run that was cut goes on.
"""

import argparse
from pathlib import Path

import vibrokit as vk
from tests.benchmarks import table_file
from vibrokit.reproduction.reproduce import PUBLISHED


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=Path("reproduction"))
    parser.add_argument("--quick", action="store_true", help="coarser basins, fewer starts, nodes and exits")
    table_file.add_option(parser)
    given = parser.parse_args()
    report = vk.reproduce(given.folder, quick=given.quick, progress=True)
    (table,) = (
        block for chapter in report.chapters for block in chapter.blocks if getattr(block, "name", "") == PUBLISHED
    )
    rows = [dict(zip(table.header, row, strict=True)) for row in table.rows]
    print("\n".join("  ".join(row.values()) for row in rows))
    table_file.write(given.csv, rows, timed=False)


if __name__ == "__main__":
    main()

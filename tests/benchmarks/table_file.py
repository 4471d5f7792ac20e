"""Tables as CSV files. Comment lines before the column names have the command, the tolerance and the machine.

    # command: python -m tests.benchmarks.public_cases --csv docs/data/public_cases.csv
    # relative tolerance: 1e-08
    # machine: 2 cores, vectors of 512 bits

`docs/tables.py` makes pages of these files.
"""

import csv
import os
import shlex
import sys
from pathlib import Path

import llvmlite.binding as llvm

import __main__

REPOSITORY = Path(__file__).parents[2]
COMMENT = "# "
_WIDTHS = {"avx512f": 512, "avx2": 256}  # bits, by the feature of a processor that has them
_NARROWEST = 128


def add_option(parser):
    """Add the option that names the file."""
    parser.add_argument("--csv", type=Path, help="also write the table to this CSV file")


def command():
    """This command, as it is typed in a checkout."""
    words = [_short(word) for word in sys.argv[1:]]
    return shlex.join(["python", "-m", __main__.__spec__.name, *words])


def _short(word):
    path = Path(word)
    return path.relative_to(REPOSITORY).as_posix() if path.is_absolute() and REPOSITORY in path.parents else word


def machine():
    """Cores that this process may use, and the widest vectors."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    features = llvm.get_host_cpu_features()
    width = next((width for name, width in _WIDTHS.items() if features.get(name)), _NARROWEST)
    return f"{cores} {'core' if cores == 1 else 'cores'}, vectors of {width} bits"


def begin(path, columns, *, tolerance=None, timed=True):
    """Write the comments and the column names of a new file.

    `tolerance` is that of values, relative; `timed` says whether there are times, which depend on the machine.
    """
    comments = {"command": command()}
    if tolerance is not None:
        comments["relative tolerance"] = f"{tolerance:g}"
    if timed:
        comments["machine"] = machine()
    with path.open("w", newline="", encoding="utf-8") as file:
        file.writelines(f"{COMMENT}{name}: {text}\n" for name, text in comments.items())
        csv.DictWriter(file, columns, lineterminator="\n").writeheader()


def append(path, columns, rows):
    """Append rows to a file."""
    with path.open("a", newline="", encoding="utf-8") as file:
        csv.DictWriter(file, columns, lineterminator="\n").writerows(rows)


def write(path, rows, **comments):
    """Write a whole file, where one is asked for; the columns are the keys of the first row."""
    if path is not None:
        columns = tuple(rows[0])
        begin(path, columns, **comments)
        append(path, columns, rows)


def read(path):
    """The rows of a file, which may lack the comments."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith(COMMENT)))

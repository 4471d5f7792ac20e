"""Error against time of every stepper on a scene, as `vibrokit trade` measures it, as a table.

    python -m tests.benchmarks.steppers [--scene hertz-0.570] [--csv FILE]

The rows are those of the first table that `vibrokit trade` prints.
"""

import argparse

import vibrokit as vk
from tests.benchmarks import table_file
from vibrokit.trade.steppers import measure_steppers


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", default="hertz-0.570")
    table_file.add_option(parser)
    given = parser.parse_args()
    found = measure_steppers(vk.load_scene(given.scene))
    print(found)
    table_file.write(given.csv, [
        {
            "stepper": row.stepper, "error": f"{row.error_median:.1e}", "error_90": f"{row.error_90:.1e}",
            "ensemble_us": f"{1e6 * row.seconds:.3g}", "alone_us": f"{1e6 * row.seconds_alone:.3g}",
            "default": "yes" if row.default else "",
        }
        for row in found.rows
    ])  # fmt: skip


if __name__ == "__main__":
    main()

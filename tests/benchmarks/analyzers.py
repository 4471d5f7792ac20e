"""Processor time of the structure and of each analyzer on a scene, with default settings, and what they find.

    python -m tests.benchmarks.analyzers [--scene hertz-0.570] [--sources clear hammering] [--csv FILE]

Each analyzer runs on each source alone. A first run of this program compiles kernels; times are those of a second one.
A row has ΔU (m² s⁻³), or, of the methods at finite noise, ln of the mean exit time in section intervals at the
intensity of the scene.
"""

import argparse
import time

import numpy as np

import vibrokit as vk
from tests.benchmarks import table_file

ENERGIES = (vk.ActionGraph, vk.ActionPlot, vk.LeastAction)
RATES = (vk.SGCM, vk.MFET)


def timed(work):
    """What some work returns, and its processor seconds of all threads."""
    began = time.process_time()
    return work(), time.process_time() - began


def row_of(name, osc, structure, source, kind):
    """The cheapest or likeliest exit of a source."""
    result, seconds = timed(lambda: kind(source=source).run(osc, structure))
    if kind in ENERGIES:
        found = min(result.energies, key=lambda energy: energy.value)
        value, error, quantity = f"{found.value:.8g}", f"{found.numerical_error:.1e}", "ΔU"
    else:
        own = [rate for rate in result.rates if rate.intensity == osc.noise.intensity]
        found = max(own, key=lambda rate: rate.log_value)
        value = f"{-found.log_value - np.log(osc.section_interval):.5g}"
        error, quantity = f"{found.log_error:.1e}", "ln of the mean time"
    return {
        "analyzer": name, "source": source, "quantity": quantity, "value": value, "error": error,
        "seconds": f"{seconds:.2f}",
    }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", default="hertz-0.570")
    parser.add_argument("--sources", nargs="+", default=["clear", "hammering"])
    table_file.add_option(parser)
    given = parser.parse_args()
    osc = vk.load_scene(given.scene)
    structure, seconds = timed(lambda: vk.find_structure(osc, rng=0))
    rows = [{
        "analyzer": "find_structure", "source": "all", "quantity": "attractors", "value": len(structure.attractors),
        "error": "", "seconds": f"{seconds:.2f}",
    }]  # fmt: skip
    for source in given.sources:
        for kind in (*ENERGIES, *RATES):
            rows.append(row_of(kind.__name__, osc, structure, source, kind))
            print("  ".join(map(str, rows[-1].values())), flush=True)
            table_file.write(given.csv, rows)


if __name__ == "__main__":
    main()

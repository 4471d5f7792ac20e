"""Exit rates of double wells at finite noise against the spectrum of the Klein–Kramers operator.

    python -m tests.benchmarks.klein_kramers [--ratios 8 12 16] [--csv FILE]

x″ + 2ζx′ − x + x³ = ξ, from one well to the other, at intensities D with some ratios ΔU/D, where ΔU = ζ exactly. A row
has ln of the rate (s⁻¹) by the spectrum (`tests/klein_kramers.py`), by `SGCM` with its error estimate, and by `MFET`
with its standard error, of which 10 % are asked for.
"""

import argparse

import vibrokit as vk
from tests.benchmarks import table_file
from tests.klein_kramers import double_well_rate
from tests.scenes import double_well

DAMPINGS = (0.2, 1.0)
ERROR = 0.1  # of simulated rates


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ratios", type=float, nargs="+", default=[8.0, 12.0, 16.0])
    table_file.add_option(parser)
    given = parser.parse_args()
    rows = []
    for damping in DAMPINGS:
        intensities = tuple(damping / ratio for ratio in given.ratios)
        osc = double_well(damping_ratio=damping, noise=vk.WhiteNoise(intensities[0]))
        structure = vk.find_structure(osc, cells=(40, 40), manifolds=False, rng=0)
        of = {"source": 0, "intensities": intensities}
        found = [method.run(osc, structure) for method in (vk.SGCM(**of), vk.MFET(**of).for_accuracy(2 * ERROR))]
        for ratio, intensity in zip(given.ratios, intensities, strict=True):
            row = {"damping": damping, "ratio": f"{ratio:g}", "spectrum": f"{double_well_rate(damping, intensity):.8f}"}
            for name, result in zip(("sgcm", "mfet"), found, strict=True):
                (rate,) = (one for one in result.rates if one.intensity == intensity)
                row |= {name: f"{rate.log_value:.5f}", f"{name}_error": f"{rate.log_error:.5f}"}
            rows.append(row)
            print("  ".join(f"{key} {value}" for key, value in row.items()), flush=True)
            table_file.write(given.csv, rows, timed=False)


if __name__ == "__main__":
    main()

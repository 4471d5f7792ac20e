"""Ctrl-C at random moments of ``vibrokit run``: is what was finished in the file, and is what is printed true?

Every other run notes in its own file what it has finished, at the moment it is finished, so that this does not rest on
what the command says; the others are the command as it is, with its imports. A second Ctrl-C may cost the energies of
the analysis that it stops. Usage:

    python tests/benchmarks/interrupts.py [--count 20] [--presses 1] [--seed 0] [words of the run]
"""

import argparse
import contextlib
import json
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import vibrokit as vk

RUN = ["double-well", "--cells", "60", "--analyzer", "action-graph", "--set", "nodes=100,100"]
_SAME = 1e-6  # relative: polished energies agree far better, and errors of estimates are larger
PLAIN = "import sys; from vibrokit.cli import main; sys.exit(main(sys.argv[1:]))"
NOTING = """
import os, sys
import vibrokit.structure.find as find
from vibrokit.analyzers.analyzer import Analyzer
from vibrokit.cli import main

def noting(original, words):
    def work(*arguments, **options):
        found = original(*arguments, **options)
        note = os.open("finished", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.write(note, (words(found, *arguments) + "\\n").encode())
        os.close(note)
        return found
    return work

find.find_structure = noting(find.find_structure, lambda found, *_: f"structure {found.complete}")
Analyzer._analyzed = noting(
    Analyzer._analyzed, lambda found, analyzer, problem: f"{problem.source} {len(found.estimates)}"
)
sys.exit(main(sys.argv[1:]))
"""


class Wrong(Exception):
    """Something that was finished is lost, or something printed is not true."""


def check(condition, words):
    if not condition:
        raise Wrong(words)


def started(folder, words, script):
    """Start a run in a folder."""
    command = [sys.executable, "-c", script, "run", *words, "--json", "-o", "r.nc"]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def interrupted(folder, words, script, moments):
    """Run and press Ctrl-C at some moments (s); return exit status, output and errors."""
    process = started(folder, words, script)
    began = time.perf_counter()
    for moment in moments:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(max(0.0, began + moment - time.perf_counter()))
        process.send_signal(signal.SIGINT)  # of a process that has ended, this does nothing
    output, errors = process.communicate()
    # Python itself ends by the signal while it starts and while it shuts down; a shell calls that 130 too.
    return 130 if process.returncode == -signal.SIGINT else process.returncode, output, errors


def judged(folder, status, output, errors, whole, at_once):
    """Compare files, notes and what was printed; return what was found in a few words."""
    note = folder / "finished"
    finished = note.read_text().splitlines() if note.exists() else []
    files = {path.name for path in folder.iterdir()} - {"finished"}
    if not output:  # Python itself was starting, or Ctrl-C was pressed twice
        check(status == 130, f"it ended with {status}: {errors}")
        check("written: " not in errors, "files are named and nothing is printed")
        check(not any(name.startswith(".") for name in files), f"half-written files: {files}")
        check(at_once or not finished, f"{finished} is lost")
        return "nothing was found"
    said = json.loads(output)
    check(status == 130 or (status == 0 and "interrupted" not in errors), f"exit status {status}: {errors}")
    check(files == set(said["files"].values()), f"it names {said['files']}, and there are {files}")
    records = {name: vk.load_result(folder / file) for name, file in said["files"].items()}
    check("interrupted" not in errors or all(file in errors for file in files), f"{files} are not named in: {errors}")
    check(said["complete"] or status == 130, "it is incomplete and not interrupted")
    check(not said["complete"] or said["energies"] == whole["energies"], "it is called complete and is not")
    structure = [line for line in finished if line.startswith("structure")]
    check(records or not (said["attractors"] or structure), "the structure is lost")
    for record in records.values():
        check([len(record.names)] == [len(said["attractors"])], "the file has other attractors than the output")
    if "structure" in records:
        check(f"structure {records['structure'].complete}" in (structure or said_structure(said)), "another structure")
    kept = [energy for name, record in records.items() if name != "structure" for energy in record.energies]
    check([e.value for e in kept] == [e["value"] for e in said["energies"]], "other energies are printed than saved")
    known = {(energy["source"], energy["target"]): energy["value"] for energy in whole["energies"]}
    for energy in kept:  # of a part of the analysis: an estimate, or a path that is not the cheapest
        value, margin = known[energy.source, energy.target], _SAME * energy.value
        check(energy.lower - margin <= value <= energy.upper + margin, f"{energy} excludes {value}")
    for line in finished:
        source, count = line.split()
        there = source == "structure" or sum(e.source == int(source) for e in kept) == int(count)
        check(there or at_once, f"{line} is lost")
    found = (
        f"{len(said['attractors'])} attractors, {len(kept)} energies, {'complete' if said['complete'] else 'stopped'}"
    )
    return f"{found}; {', '.join(sorted(files)) or 'no file'}"


def said_structure(said):
    """Whether the output has the finding of a structure that was stopped, in the words of the notes."""
    stopped = [one for one in said["findings"] if (one["record"], one["code"]) == ("structure", "stopped")]
    return [f"structure {not stopped}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--presses", type=int, default=1, help="2: press a second time up to 0.5 s after the first")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("words", nargs=argparse.REMAINDER)
    options = parser.parse_args()
    words = options.words or RUN
    chance = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as folder:
        started(folder, words, PLAIN).communicate()  # compiles
        began = time.perf_counter()
        whole = json.loads(started(folder, words, PLAIN).communicate()[0])
        seconds = time.perf_counter() - began
    print(f"whole run: {seconds:.1f} s, {len(whole['energies'])} energies", flush=True)
    wrong = 0
    for number in range(options.count):
        moment = chance.uniform(0, seconds)
        moments = [moment + chance.uniform(0, 0.5) * press for press in range(options.presses)]
        with tempfile.TemporaryDirectory() as folder:
            outcome = interrupted(folder, words, (PLAIN, NOTING)[number % 2], moments)
            try:
                verdict = judged(Path(folder), *outcome, whole, options.presses > 1)
            except Wrong as error:
                wrong += 1
                verdict = f"WRONG: {error}"
        print(f"{', '.join(f'{moment:6.2f} s' for moment in moments)}  status {outcome[0]:>4}  {verdict}", flush=True)
    print(f"{wrong} of {options.count} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())

"""Work on one case in a process of its own, so that no case ends the others or is helped by them."""

import json
import subprocess
import sys


def apart(module, *arguments, seconds):
    """What a module prints last, read as JSON, and an empty text; or None, and why there is nothing."""
    command = [sys.executable, "-W", "ignore", "-m", f"tests.benchmarks.{module}", *map(str, arguments)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        return None, "did not end"
    if done.returncode:
        return None, f"failed: {(done.stderr.strip().splitlines() or ['without a word'])[-1]}"
    return json.loads(done.stdout.splitlines()[-1]), ""

"""Progress on standard error: a live line on a terminal, a line for each long stage elsewhere."""

import os
import re
import subprocess
import sys
import textwrap

import pytest

from vibrokit.display import Display
from vibrokit.progress import Update

SCRIPT = textwrap.dedent("""
    from vibrokit.display import Display
    from vibrokit.progress import Update
    clock = iter(range(1000))
    show = Display(clock=lambda: next(clock))
    show(Update("attractors", "", 0, None, "", 0.5, None))
    show(Update("attractors", "", 0, None, "", 0.5, None, finished=True))
    show(Update("graph", "clear", 0, 40, "sweeps", 0.1, None, compiling=True))
    show(Update("graph", "clear", 12, 40, "sweeps", 12.0, 30.2))
    show(Update("graph", "clear", 40, 40, "sweeps", 42.0, 0.0, finished=True))
    show(Update("saddles", "", 300, None, "trajectories", 300.0, None))
    show(Update("saddles", "", 300, None, "trajectories", 300.0, None, finished=True))
    print("done")
""")


def on_terminal(script):
    """Standard error and output of a script on a pseudo-terminal."""
    pty = pytest.importorskip("pty")
    controller, terminal = pty.openpty()
    process = subprocess.Popen([sys.executable, "-c", script], stdout=terminal, stderr=terminal)
    os.close(terminal)
    written = b""
    try:
        while chunk := os.read(controller, 4096):
            written += chunk
    except OSError:  # Linux reports the closed end as an error
        pass
    os.close(controller)
    assert process.wait() == 0
    return written.decode()


def screen(written):
    """Lines that a terminal shows after each carriage return, in order, and the text that remains."""
    lines, kept = [""], []
    for part in re.split("([\r\n])", written):
        if part == "\n":
            kept.append(lines[-1].rstrip())
            lines.append("")
        elif part and part != "\r":
            lines.append(part + lines[-1][len(part) :])
    return [line.rstrip() for line in lines if line.strip()], kept


def test_on_a_terminal_one_line_lives_and_leaves_nothing():
    shown, kept = screen(on_terminal(SCRIPT).replace("\r\n", "\n"))
    assert shown == [
        "graph, clear: compiling",
        "graph, clear: 12 of 40 sweeps, 12 s so far, about 30 s left",
        "saddles: 300 trajectories, 5 min so far, duration unknown",
        "done",
    ]
    assert kept == ["done"]


def test_in_a_pipe_each_long_stage_is_one_line():
    process = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
    assert process.stderr == "graph, clear: 40 sweeps, 42 s\nsaddles: 300 trajectories, 5 min\n"
    assert process.stdout == "done\n"


class Terminal:
    """A stream that says it is a terminal."""

    def __init__(self):
        self.text = ""

    def isatty(self):
        return True

    def fileno(self):
        raise OSError("no descriptor")

    def write(self, text):
        self.text += text

    def flush(self):
        pass


def test_a_line_is_as_wide_as_the_terminal_at_most():
    terminal = Terminal()
    Display(terminal)(Update("graph", "a" * 200, 1, 2, "sweeps", 5.0, 3.0))
    assert terminal.text == "\r" + ("graph, " + "a" * 200)[:79]


def test_the_line_changes_a_few_times_a_second():
    terminal, now = Terminal(), [0.0]
    show = Display(terminal, clock=lambda: now[0])
    for step in range(100):
        now[0] = step / 100
        show(Update("graph", "", step, 1000, "sweeps", 2.0 + now[0], 5.0))
    assert terminal.text.count("\r") == 5

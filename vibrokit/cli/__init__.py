"""The command line, vibrokit: its entry point, and the reading of its arguments."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module

from vibrokit.cli.commands import parser
from vibrokit.errors import VibrokitError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status.

    Returns
    -------
    int
        0 if all went well, 1 if an analysis or a check failed or is incomplete, 2 if the input is wrong, 130 after
        Ctrl-C, 143 after SIGTERM.
    """
    options = parsed(arguments)
    try:
        module, _, name = options.function.partition(":")
        status = getattr(import_module(f"vibrokit.cli.{module}"), name)(options)
        sys.stdout.flush()
        return int(status or 0)
    except BrokenPipeError:  # the program that reads our output has ended
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (VibrokitError, OSError) as error:
        print(f"vibrokit: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("vibrokit: interrupted.", file=sys.stderr)
        return 130


def parsed(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Read the arguments of the command line."""
    reader = parser()
    options = reader.parse_args(arguments)
    if "analyzer" in options and options.analyzer is None:
        options.analyzer = ["least-action"]
    if "analyzer" in options and options.scene is None:  # the last of the analyzers' names is the scene's
        if len(options.analyzer) < 2:
            reader.error("the following arguments are required: scene")
        options.scene = options.analyzer.pop()
    return options

"""vibrokit equations and plausibility: what follows from a scene before any integration."""

from __future__ import annotations

import argparse

from vibrokit.assessment.plausibility import plausibility
from vibrokit.cli.json_output import print_json
from vibrokit.report.data import plausibility_data
from vibrokit.scene_file import load_scene


def equations(options: argparse.Namespace) -> None:
    """Print the derived equations of a scene."""
    model = load_scene(options.scene).model
    print(model.latex if options.latex else model)


def closed_forms(options: argparse.Namespace) -> None:
    """Print closed forms of a scene, and which of them are unusual."""
    found = plausibility(load_scene(options.scene))
    if options.json:
        print_json(scene=options.scene, **plausibility_data(found))
    else:
        print(found)

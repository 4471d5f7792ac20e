"""Transitions in a file."""

from __future__ import annotations

import numpy as np

from vibrokit.errors import StructureError
from vibrokit.results.columns import Draft
from vibrokit.results.content import Content, ResultFileError
from vibrokit.results.transitions import MOST_ATTRACTORS, Transitions

_LABELS = "transition_label"
_MATRICES = {name: f"transition_{name}" for name in ("energies", "lower", "upper")}


def write_transitions(draft: Draft, transitions: Transitions) -> None:
    """Put transitions into a draft."""
    draft.put(_LABELS, ("transition",), np.array(transitions.labels, dtype=np.int64))
    for name, stored in _MATRICES.items():
        draft.put(stored, ("transition", "transition_to"), getattr(transitions, name))


def read_transitions(content: Content) -> Transitions | None:
    """Return the transitions of a file; None if it has none.

    Raises
    ------
    ResultFileError
        Something is missing, of another shape or kind, or contradicts the rest.
    """
    if _LABELS not in content.dataset.variables:
        return None
    labels = content.wholes(_LABELS, (None,), 0, np.iinfo(np.int32).max)
    if len(labels) > MOST_ATTRACTORS:
        raise ResultFileError(f"it has transitions between {len(labels)} attractors; {MOST_ATTRACTORS} are allowed")
    shape = (len(labels), len(labels))
    matrices = {name: content.numbers(stored, shape, finite=False) for name, stored in _MATRICES.items()}
    try:
        return Transitions(tuple(labels.tolist()), **matrices)
    except StructureError as error:
        raise ResultFileError(f"its {str(error).rstrip('.')}") from error

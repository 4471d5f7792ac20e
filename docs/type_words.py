"""Leaves plain words of types in docstrings, such as "array of value by name", as text; Sphinx would link them."""

import builtins

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx


def unlink_words(app: Sphinx, doctree: nodes.document) -> None:
    """Replace references to lower-case words that are no built-in type by their text."""
    for reference in list(doctree.findall(pending_xref)):
        word = reference.get("reftarget", "")
        typed = reference.get("refdomain") == "py" and reference.get("reftype") in ("class", "obj")
        if typed and word.isidentifier() and word.islower() and not hasattr(builtins, word):
            reference.replace_self(reference.children)


def setup(app: Sphinx) -> dict[str, object]:
    """Listen to each page that is read."""
    app.connect("doctree-read", unlink_words)
    return {"version": "1", "parallel_read_safe": True}

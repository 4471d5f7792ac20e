"""Sphinx configuration."""

import ast
from pathlib import Path

from vibrokit import __version__
from vibrokit.results.codes import Code

project = "vibrokit"
author = "The vibrokit developers"
copyright = "The vibrokit developers"
version = release = __version__

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
]
exclude_patterns = ["_build"]
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the numpydoc sections say it in words
napoleon_google_docstring = False
napoleon_custom_sections = ["For developers"]
html_theme = "furo"
html_title = "vibrokit"


def write_tutorial_pages(docs: Path) -> None:
    """Turn each script of tutorials/ into a page: its docstring as prose, its code below."""
    pages = docs / "tutorials"
    pages.mkdir(exist_ok=True)
    for script in sorted(docs.parent.joinpath("tutorials").glob("[0-9]*.py")):
        module = ast.parse(script.read_text(encoding="utf-8"))
        heading, _, prose = (ast.get_docstring(module) or script.stem).partition("\n")
        start = module.body[1].lineno if len(module.body) > 1 else 1
        page = (
            f"{heading}\n{'=' * len(heading)}\n{prose}\n\n"
            f".. literalinclude:: ../../tutorials/{script.name}\n   :language: python\n   :lines: {start}-\n"
        )
        pages.joinpath(f"{script.stem}.rst").write_text(page, encoding="utf-8")


def write_findings_page(docs: Path) -> None:
    """List the codes of findings with their severity, sentence and advice."""
    lines = [
        "Findings", "========", "",
        "``result.findings`` is a tuple of findings. A finding has a code, a severity, attractors and values;",
        "``str`` of it is its sentence. Words in braces are values; ``{state}`` and ``{goal}`` are attractors.", "",
    ]  # fmt: skip
    for code in Code:
        sentence = " ".join(code.sentence.split()).replace("{", "*{").replace("}", "}*")
        lines += [f"``{code.value}`` ({code.severity.value})", f"   {sentence}", ""]
        lines += [f"   *What to do:* {code.advice}", ""] if code.advice else []
    docs.joinpath("findings.rst").write_text("\n".join(lines), encoding="utf-8")


write_tutorial_pages(Path(__file__).parent)
write_findings_page(Path(__file__).parent)

"""Writes docs/findings.rst: the codes of findings with their severity, sentence and advice."""

from pathlib import Path

from vibrokit.results.codes import Code

HEAD = """\
Findings
========

``result.findings`` is a tuple of findings. A finding has a code, a severity, attractors and values; ``str`` of it is
its sentence. Words in braces are values; ``{state}`` and ``{goal}`` are attractors.
"""


def write(docs: Path) -> None:
    """Write the page into a folder."""
    lines = [HEAD]
    for code in Code:
        sentence = " ".join(code.sentence.split()).replace("{", "*{").replace("}", "}*")
        lines += [f"``{code.value}`` ({code.severity.value})", f"   {sentence}", ""]
        lines += [f"   *What to do:* {code.advice}", ""] if code.advice else []
    docs.joinpath("findings.rst").write_text("\n".join(lines), encoding="utf-8")

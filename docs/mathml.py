"""Formulas as MathML, made when the manual is built: pages need neither a script nor a network to show them."""

import re

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.math import get_node_equation_number
from sphinx.writers.html5 import HTML5Translator


def rendered(node: nodes.Element, display: str) -> str:
    """Return the MathML of a formula; one that cannot be read stops the build."""
    tex = node.astext().replace("{aligned}", "{align*}")  # the converter knows only the latter,
    tex = re.sub(r"\\[bB]igg?[lr](?=\\)", "", tex)  # and sizes only of brackets that are one character
    if display == "block" and r"\\" in tex and r"\begin" not in tex:
        tex = rf"\begin{{align*}}{tex}\end{{align*}}"
    try:
        made = convert(tex, display=display)
    except Exception as error:
        raise ExtensionError(f"{node.source}: the formula {tex!r} has no MathML ({error!r}).") from error
    if unknown := re.search(r"\\\S[^<]*", made):
        raise ExtensionError(f"{node.source}: the formula {tex!r} has the unknown command {unknown[0]}.")
    return made.replace('mathvariant="sans-serif"', 'mathvariant="normal"')  # browsers know no other upright letters


def visit_inline(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(f'<span class="math">{rendered(node, "inline")}</span>')
    raise nodes.SkipNode


def visit_block(self: HTML5Translator, node: nodes.math_block) -> None:
    self.body.append(self.starttag(node, "div", CLASS="math"))
    if node["number"]:
        self.body.append(f'<span class="eqno">({get_node_equation_number(self, node)})')
        self.add_permalink_ref(node, "Link to this equation")
        self.body.append("</span>")
    self.body.append(f"{rendered(node, 'block')}</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, object]:
    """Register the renderer; ``html_math_renderer = "mathml"`` chooses it."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}

"""Formulas as MathML, converted when the pages are built, so that a browser needs no script."""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING, Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator

LOGGER = logging.getLogger(__name__)

# latex2mathml leaves a single upright letter without its variant, but not inside text.
SIGN = re.compile(r"(<mo[^>]*>(?:&#x0003D;|&#x00028;|&#x0005B;|&#x0002C;|=|,)</mo>)<mo>&#x02212;</mo>")
UPRIGHT = re.compile(r"\\mathrm\{([A-Za-z]+)\}")


def mathml(latex: str, display: str, node: nodes.Element) -> str:
    """Convert a formula to MathML; warn if the result is invalid."""
    found = convert(UPRIGHT.sub(r"\\text{\1}", latex), display=display)
    # A minus after an opening or an equals sign is a sign, not a difference.
    found = SIGN.sub(r'\1<mo form="prefix">&#x02212;</mo>', found)
    if re.search(r"&(?!#|\w+;)", found):
        LOGGER.warning("the formula %r becomes faulty MathML", latex, location=node)
    return found.replace("<math ", f'<math alttext="{escape(latex)}" ', 1)


def visit_inline(writer: HTML5Translator, node: nodes.math) -> None:
    """Write an inline formula."""
    writer.body.append(mathml(node.astext(), "inline", node))
    raise nodes.SkipNode


def visit_block(writer: HTML5Translator, node: nodes.math_block) -> None:
    """Write a displayed formula, with its equation number, if any."""
    writer.body.append(writer.starttag(node, "div", CLASS="math"))
    writer.body.append(mathml(node.astext(), "block", node))
    if node["number"]:
        number = get_node_equation_number(writer, node)
        writer.body.append(f'<span class="eqno">({number})')
        writer.add_permalink_ref(node, "Link to this equation")
        writer.body.append("</span>")
    writer.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer under the name "mathml"."""
    app.add_html_math_renderer(
        "mathml", inline_renderers=(visit_inline, None), block_renderers=(visit_block, None)
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}

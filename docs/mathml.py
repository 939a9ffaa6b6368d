"""Formulas as MathML, which browsers draw themselves: pages need neither the network nor
scripts."""

from __future__ import annotations

from typing import Any

import latex2mathml.converter
from docutils import nodes


def _formula(display: str):
    tag = "div" if display == "block" else "span"

    def visit(self, node: nodes.math | nodes.math_block) -> None:
        formula = latex2mathml.converter.convert(node.astext(), display=display)
        self.body.append(f'<{tag} class="formula-{display}">{formula}</{tag}>')
        raise nodes.SkipNode

    return visit


def setup(app) -> dict[str, Any]:
    app.add_html_math_renderer("mathml", (_formula("inline"), None), (_formula("block"), None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}

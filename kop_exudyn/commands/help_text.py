"""What `kop COMMAND --help` prints, as wide as the terminal is."""

from __future__ import annotations

import argparse
import re
import textwrap


class HelpFormatter(argparse.HelpFormatter):
    """Paragraphs are filled to the terminal's width, with the indent of their first line. Those
    that begin with a heading and a colon, as "examples:", stay as they are written."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        paragraphs = textwrap.dedent(text).strip("\n").split("\n\n")
        return "\n\n".join(_filled(paragraph, width, indent) for paragraph in paragraphs)


def _filled(paragraph: str, width: int, indent: str) -> str:
    first = paragraph.partition("\n")[0]
    if re.fullmatch(r"\w[\w ]*:", first):
        return textwrap.indent(paragraph, indent)
    inner = indent + first[: len(first) - len(first.lstrip())]
    return textwrap.fill(
        " ".join(paragraph.split()),
        width,
        initial_indent=inner,
        subsequent_indent=inner,
        break_long_words=False,
        break_on_hyphens=False,
    )

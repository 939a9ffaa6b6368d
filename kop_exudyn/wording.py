"""Numbers in sentences: one curve, two curves; and beside their units."""

from __future__ import annotations

import re
from collections.abc import Mapping

from .units import FORCES, LENGTHS

# Between a number (or the kind of one) and its unit, which no line's end may part.
_NUMBER_UNIT = re.compile(
    r"(?:(?<=\d)|(?<=max)|(?<=mean)) "
    rf"(?=(?:%|°|{'|'.join([*LENGTHS, *FORCES])}|[kMG]?Pa|m?J|kJ|MJ|s|degrees|deg)(?![\w/]))"
)


def counted(number: int, one: str, many: str | None = None) -> str:
    """A number and what it counts: "1 curve", "2 curves", "1,200 curves".

    one, many : what follows the number, verbs included where they change with it, as "curve lies"
        and "curves lie"; many by default the same with an s
    """
    return f"{number:,} {one if number == 1 else many or f'{one}s'}"


def counted_parts(sizes: Mapping[str, int]) -> str:
    """A kit's size in words: "12 linear and 5 angular parts", "1 cell part".

    sizes : kind -> number of parts
    """
    each = " and ".join(f"{number:,} {kind}" for kind, number in sizes.items())
    return f"{each} part{'s' * (sum(sizes.values()) != 1)}"


def beside_units(text: str) -> str:
    """The text with spaces before units at which no line breaks."""
    return _NUMBER_UNIT.sub("\N{NO-BREAK SPACE}", text)

"""Values of command-line options, read with errors that say what is wrong with them."""
from __future__ import annotations

import argparse
import math


def part_counts(text: str) -> dict[str, int]:
    """``linear=12,angular=5`` as {"linear": 12, "angular": 5}; whether there are such kinds is checked later."""
    counts: dict[str, int] = {}
    for piece in text.split(","):
        kind, equals, number = (part.strip() for part in piece.partition("="))
        if not kind or not equals:
            raise argparse.ArgumentTypeError(f"expected KIND=NUMBER,..., got {piece!r}")
        if kind in counts:
            raise argparse.ArgumentTypeError(f"the kind {kind!r} is given twice")
        counts[kind] = _whole(number, 1, f"the number of {kind} parts")
    return counts


def design_selection(text: str) -> int | list[str]:
    """``3`` as 3, the first three designs; ``a,b`` as ["a", "b"], their names."""
    try:
        number = int(text)
    except ValueError:
        names = [name.strip() for name in text.split(",")]
        if not all(names):
            raise argparse.ArgumentTypeError(f"expected a number or names of designs, got {text!r}") from None
        return names
    return _whole(str(number), 1, "the number of designs")


def positive(text: str) -> int:
    """A whole number of at least 1."""
    return _whole(text, 1, "the value")


def not_negative(text: str) -> int:
    """A whole number of at least 0."""
    return _whole(text, 0, "the value")


def gravity(text: str) -> tuple[float, float, float]:
    """``9.81`` as (0, 0, -9.81), down the z axis; ``0,0,-9.81`` as it is."""
    try:
        numbers = [float(piece) for piece in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3) or not all(map(math.isfinite, numbers)):
        raise argparse.ArgumentTypeError(f"expected a number or X,Y,Z, got {text!r}")
    return (0.0, 0.0, -numbers[0]) if len(numbers) == 1 else tuple(numbers)


def _whole(text: str, least: int, what: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = None
    if number is None or number < least:
        raise argparse.ArgumentTypeError(f"{what} must be a whole number, at least {least}, got {text!r}")
    return number

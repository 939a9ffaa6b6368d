"""Values of command-line options, read with errors that say what is wrong with them."""

from __future__ import annotations

import argparse
import math

from ..checks import LARGEST
from ..files.documents import SMALLEST


def part_counts(text: str) -> dict[str, int]:
    """``linear=12,angular=5`` as {"linear": 12, "angular": 5}; whether there are such kinds is
    checked later."""
    return {
        kind: _whole(number, 1, f"the number of {kind} parts")
        for kind, number in _assignments(text, "kind", "KIND=NUMBER,...").items()
    }


def part_ranges(text: str) -> dict[str, list[int]]:
    """``linear=2:12:2,angular=5`` as {"linear": [2, 4, ..., 12], "angular": [5]}."""
    found = {}
    for kind, numbers in _assignments(text, "kind", "KIND=A:B,...").items():
        ends = [_whole(n, 1, f"the number of {kind} parts") for n in numbers.split(":")]
        if len(ends) > 3 or len(ends) > 1 and ends[0] > ends[1]:
            raise argparse.ArgumentTypeError(f"expected A:B or A:B:STEP, got {numbers!r}")
        found[kind] = ends if len(ends) == 1 else list(range(ends[0], ends[1] + 1, *ends[2:]))
    return found


def kit_cost(text: str) -> dict[str, float]:
    """``part=1,piece=0.02`` as {"part": 1.0, "piece": 0.02}; what isn't named costs nothing."""
    found = term_weights(text)
    for name, value in found.items():
        if name not in ("part", "piece", "cut") or value < 0:
            raise argparse.ArgumentTypeError(
                f"expected part=W,piece=W,cut=W, not negative, got '{name}={value:g}'"
            )
    if not any(found.values()):
        raise argparse.ArgumentTypeError("expected a weight above 0: all kits would cost the same")
    return {"part": 0.0, **found}  # the default is of the option, not of each weight


def term_weights(text: str) -> dict[str, float]:
    """``fit=1e4,energy=0.05`` as {"fit": 1e4, "energy": 0.05}; whether there are such terms is
    checked later."""
    weights = {}
    for name, number in _assignments(text, "term", "TERM=WEIGHT,...").items():
        value = _numbers(number, (1,))
        if not value:
            raise argparse.ArgumentTypeError(f"expected TERM=WEIGHT,..., got '{name}={number}'")
        weights[name] = value[0]
    return weights


def design_selection(text: str) -> int | list[str]:
    """``3`` as 3, the first three designs; ``a,b`` as ["a", "b"], their names."""
    try:
        number = int(text)
    except ValueError:
        names = [name.strip() for name in text.split(",")]
        if not all(names):
            raise argparse.ArgumentTypeError(
                f"expected a number or names of designs, got {text!r}"
            ) from None
        return names
    return _whole(str(number), 1, "the number of designs")


def positive(text: str) -> int:
    """A whole number of at least 1."""
    return _whole(text, 1, "the value")


def not_negative(text: str) -> int:
    """A whole number of at least 0."""
    return _whole(text, 0, "the value")


def not_negative_number(text: str) -> float:
    """A finite number that is not below 0."""
    value = _numbers(text, (1,))
    if not value or value[0] < 0:
        raise argparse.ArgumentTypeError(f"expected a number not below 0, got {text!r}")
    return value[0]


def number_list(text: str) -> tuple[float, ...]:
    """``2400,4800`` as (2400.0, 4800.0): one positive number or several."""
    values = _numbers(text, tuple(range(1, 100)))
    if not values or min(values) <= 0:
        raise argparse.ArgumentTypeError(f"expected positive numbers, got {text!r}")
    return tuple(values)


def positive_number(text: str) -> float:
    """A finite number larger than 0."""
    value = _numbers(text, (1,))
    if not value or value[0] <= 0:
        raise argparse.ArgumentTypeError(f"expected a positive number, got {text!r}")
    return value[0]


def percent(text: str) -> float:
    """``1.5`` or ``1.5%`` as 1.5: a share in percent, larger than 0."""
    return positive_number(text.strip().removesuffix("%").strip())


def number_pair(text: str) -> tuple[float, float]:
    """``30,4`` as (30.0, 4.0); whether they make sense is checked where they are used."""
    values = _numbers(text, (2,))
    if not values:
        raise argparse.ArgumentTypeError(f"expected two numbers A,B, got {text!r}")
    return values[0], values[1]


def held_joints(text: str) -> str | list[int]:
    """``0,4,20`` as [0, 4, 20], a word as it is; which words and joints there are is checked
    later."""
    if text.isidentifier():
        return text
    return [_whole(number.strip(), 0, "the number of a joint") for number in text.split(",")]


def patch(text: str) -> tuple[str, list[int]]:
    """``parallelogram,4,5`` as ("parallelogram", [4, 5]); which shapes there are is checked
    later."""
    shape, *counts = (piece.strip() for piece in text.split(","))
    if not shape or not counts:
        raise argparse.ArgumentTypeError(f"expected SHAPE,N or SHAPE,M,N, got {text!r}")
    return shape, [_whole(count, 1, "the number of cells") for count in counts]


def angle(text: str) -> float:
    """An angle in radians; ``35deg`` in degrees."""
    degrees = text.removesuffix("deg")
    value = _numbers(degrees, (1,))
    if not value:
        raise argparse.ArgumentTypeError(f"expected an angle in radians, or as 35deg, got {text!r}")
    return math.radians(value[0]) if degrees != text else value[0]


def gravity(text: str) -> tuple[float, float, float]:
    """``9.81`` as (0, 0, -9.81), down the z axis; ``0,0,-9.81`` as it is."""
    numbers = _numbers(text, (1, 3))
    if not numbers:
        raise argparse.ArgumentTypeError(f"expected a number or X,Y,Z, got {text!r}")
    return (0.0, 0.0, -numbers[0]) if len(numbers) == 1 else (numbers[0], numbers[1], numbers[2])


def _assignments(text: str, what: str, form: str) -> dict[str, str]:
    """``a=1,b=2`` as {"a": "1", "b": "2"}; what : are named, form : that is expected."""
    found: dict[str, str] = {}
    for piece in text.split(","):
        name, equals, value = (part.strip() for part in piece.partition("="))
        if not name or not equals:
            raise argparse.ArgumentTypeError(f"expected {form}, got {piece!r}")
        if name in found:
            raise argparse.ArgumentTypeError(f"the {what} {name!r} is given twice")
        found[name] = value
    return found


def _numbers(text: str, counts: tuple[int, ...]) -> list[float]:
    """Numbers between commas, of a size whose powers double precision can hold; none where their
    count isn't one of these, or the text is something else."""
    try:
        values = [float(piece) for piece in text.split(",")]
    except ValueError:
        return []
    sensible = all(v == 0 or SMALLEST <= abs(v) <= LARGEST for v in values)
    return values if len(values) in counts and sensible else []


def _whole(text: str, least: int, what: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = None
    if number is None or number < least:
        raise argparse.ArgumentTypeError(
            f"{what} must be a whole number, at least {least}, got {text!r}"
        )
    return number

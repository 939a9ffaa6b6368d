"""Checks of single values that a caller gives; each raises an InputError with field and value."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from math import inf
from numbers import Integral, Real
from typing import Any

from .errors import InputError, did_you_mean

LARGEST = 1e60  # of coordinates and moduli, whose fourth powers stay within double precision


def check_kind(field: str, value: Any, kinds: type | tuple[type, ...], hint: str = "") -> None:
    """Refuse what is of none of these classes.

    hint : how to get one, after "expected a Design"
    """
    if not isinstance(value, kinds):
        kinds = kinds if isinstance(kinds, tuple) else (kinds,)
        names = " or ".join(f"{_article(kind.__name__)} {kind.__name__}" for kind in kinds)
        raise InputError(
            f"expected {names}{f' ({hint})' if hint else ''}",
            field=field,
            value=value if isinstance(value, (str, int, float)) else type(value).__name__,
        )


def _article(name: str) -> str:
    return "an" if name[0] in "AEIO" else "a"


def check_whole(field: str, value: Any, least: int = 0) -> None:
    """Refuse what isn't a whole number, or is smaller than `least`."""
    if not is_whole(value) or int(value) < least:
        raise InputError(f"must be a whole number, at least {least}", field=field, value=value)


def check_positive(field: str, value: Any, below: float = inf, finite: bool = True) -> None:
    """Refuse what isn't a number above 0; `finite`: infinity too, and all from `below` on."""
    if not _is_number(value) or not (0 < value < below or not finite and value == inf):
        raise InputError("must be a positive number", field=field, value=value)


def check_not_negative(field: str, value: Any) -> None:
    """Refuse what isn't a finite number from 0 on."""
    if not _is_number(value) or not 0 <= value < inf:
        raise InputError("must be a number that is not negative", field=field, value=value)


def check_flag(field: str, value: Any) -> None:
    """Refuse what is neither True nor False."""
    if not isinstance(value, bool):
        raise InputError("must be true or false", field=field, value=value)


def check_choice(field: str, value: Any, known: Collection[str]) -> None:
    """Refuse what is none of the known names."""
    if not isinstance(value, str) or value not in known:
        hint = did_you_mean(value, known) if isinstance(value, str) else ""
        raise InputError(f"unknown ({hint}known: {', '.join(known)})", field=field, value=value)


def choices(field: str, values: Any, known: Collection[str]) -> list[str]:
    """A caller's list of known names; refuses other ones, and what is no list."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise InputError(f"expected a list of: {', '.join(known)}", field=field, value=values)
    found = list(values)
    for value in found:
        check_choice(field, value, known)
    return found


def numbers(field: str, values: Any) -> tuple[float, ...]:
    """A caller's list of numbers; refuses what is none."""
    shown = values if isinstance(values, (str, int, float)) else type(values).__name__
    if isinstance(values, (str, Mapping)) or not isinstance(values, Iterable):
        raise InputError("expected a list of numbers", field=field, value=shown)
    found = tuple(values)
    if not all(_is_number(value) for value in found):
        raise InputError("expected a list of numbers", field=field, value=shown)
    return found


def is_whole(value: Any) -> bool:
    """Whether it is a whole number, Python's or NumPy's."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def _is_number(value: Any) -> bool:
    """Whether it is a real number, Python's or NumPy's; NaN is one, but passes no comparison."""
    return isinstance(value, Real) and not isinstance(value, bool)

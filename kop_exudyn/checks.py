"""Checks of single values that a caller gives; each raises an InputError with field and value."""

from __future__ import annotations

from collections.abc import Collection
from math import inf
from numbers import Integral, Real
from typing import Any

from .errors import InputError, did_you_mean

LARGEST = 1e60  # of coordinates and moduli, whose fourth powers stay within double precision


def check_whole(field: str, value: Any, least: int = 0) -> None:
    """Refuse what isn't a whole number, or is smaller than `least`."""
    if isinstance(value, bool) or not isinstance(value, Integral) or int(value) < least:
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


def _is_number(value: Any) -> bool:
    """Whether it is a real number, Python's or NumPy's; NaN is one, but passes no comparison."""
    return isinstance(value, Real) and not isinstance(value, bool)

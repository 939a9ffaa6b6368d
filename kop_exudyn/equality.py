"""Equality and hashes of what holds arrays: by value."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import fields
from typing import Any

import numpy as np


class ByValue:
    """Of dataclasses with arrays (``eq=False``): equal where all fields are, numbers by value."""

    def __eq__(self, other: object) -> bool:
        return NotImplemented if type(other) is not type(self) else _key(self) == _key(other)

    def __hash__(self) -> int:
        return hash(_key(self))


def _key(value: Any) -> Hashable:
    if isinstance(value, ByValue):
        return tuple(_key(getattr(value, field.name)) for field in fields(value))  # type: ignore[arg-type]
    if isinstance(value, np.ndarray):
        return value.shape, tuple(value.ravel().tolist())
    if isinstance(value, Mapping):
        return tuple((key, _key(value[key])) for key in sorted(value))
    return tuple(_key(item) for item in value) if isinstance(value, (list, tuple)) else value

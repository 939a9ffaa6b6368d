"""What acts on a deployed design: gravity, forces on its joints, and where it is held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import InputError

_STRAIGHT = 1e-3  # points within this share of their extent from a line don't hold a structure


def hold_in_place(points: np.ndarray) -> bool:
    """Whether a structure that is held at points (k, 3) can't turn: three or more, not on one
    line."""
    if len(points) < 3:
        return False
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extents[1] > _STRAIGHT * extents[0])


@dataclass(frozen=True)
class LoadCase:
    """Loads on the deployed state, in the design's own axes; lists become arrays.

    gravity : (3,) acceleration that gives the rods their weight, or None
    joints (m,), forces (m, 3) : forces that keep their direction, and the joints that they act on
        (from 0)
    supports : (k,) joints that stay where they are, or None: those that the analysis chooses
    """

    gravity: np.ndarray | None = None
    joints: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    forces: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    supports: np.ndarray | None = None

    def __post_init__(self) -> None:
        for name, kind in (
            ("gravity", float),
            ("joints", int),
            ("forces", float),
            ("supports", int),
        ):
            if (value := getattr(self, name)) is not None:
                try:
                    object.__setattr__(self, name, np.asarray(value, kind))
                except (OverflowError, TypeError, ValueError) as error:
                    raise InputError(f"expected numbers: {error}", field=f"loads.{name}") from None

    @property
    def empty(self) -> bool:
        """Whether nothing acts."""
        return (self.gravity is None or not np.any(self.gravity)) and not np.any(self.forces)

    def check(self, n_joints: int, source: Any = None) -> None:
        """Raise InputError where a joint is named that doesn't exist."""
        for field_name, numbers in (("loads.points", self.joints), ("supports", self.supports)):
            if (
                numbers is not None
                and len(numbers)
                and not (numbers.min() >= 0 and numbers.max() < n_joints)
            ):
                raise InputError(
                    f"names a joint that doesn't exist (joints 0 to {n_joints - 1})",
                    source=source,
                    field=field_name,
                    value=int(numbers.max()),
                )


def load_case_from_dict(data: Mapping[str, Any]) -> LoadCase:
    """The loads of a design file's content: fields "loads" and "supports", as design.schema.json
    describes them."""
    loads = data.get("loads", {})
    points = loads.get("points", [])
    gravity = np.array(loads["gravity"], float) if "gravity" in loads else None
    supports = data.get("supports")
    return LoadCase(
        gravity,
        [point["joint"] for point in points],
        np.array([point["force"] for point in points], float).reshape(-1, 3),
        supports,
    )

"""What acts on a deployed design, case by case: gravity, forces on its joints, where it is held,
and what it has to keep to under them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
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
class DeflectionLimit:
    """How far a loaded design may move: as a length, or the span between supports divided by a
    number; the smaller one where both are given.

    absolute : in the design's unit of length, or None
    span_over : N of span / N, or None
    """

    absolute: float | None = None
    span_over: float | None = None

    def __post_init__(self) -> None:
        for name in ("absolute", "span_over"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InputError(
                    "must be a positive number", field=f"deflection.{name}", value=value
                )

    def allowed(self, span: float) -> float:
        """The largest deflection, for a span; inf where nothing limits it."""
        own = np.inf if self.absolute is None else self.absolute
        return float(min(own, np.inf if self.span_over is None else span / self.span_over))


@dataclass(frozen=True)
class LoadCase:
    """Loads on the deployed state, in the design's own axes; lists become arrays.

    gravity : (3,) acceleration that gives the rods their weight, or None
    joints (m,), forces (m, 3) : forces that keep their direction, and the joints that they act on
        (from 0)
    supports : (k,) joints that stay where they are, or None: those that the analysis chooses
    name : as results have it
    factor : that strength and stability are asked for: loads times this. Deflections are those
        under the loads themselves
    deflection : how far the design may move under them
    """

    gravity: np.ndarray | None = None
    joints: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    forces: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    supports: np.ndarray | None = None
    name: str = "loads"
    factor: float = 1.0
    deflection: DeflectionLimit = DeflectionLimit()

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
        if not (np.isfinite(self.factor) and self.factor > 0):
            raise InputError("must be a positive number", field="loads.factor", value=self.factor)

    def times(self, factor: float) -> LoadCase:
        """The same case with all loads multiplied."""
        gravity = None if self.gravity is None else factor * self.gravity
        return replace(self, gravity=gravity, forces=factor * self.forces)

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


def load_cases_from_dict(data: Mapping[str, Any]) -> tuple[LoadCase, ...]:
    """The load cases of a design file's content: fields "loads" and "supports" for one case, the
    field "load_cases" for several, as design.schema.json describes them.

    The first one may have supports alone, for loads that come later. A case of the list that names
    no supports has those of the design. Raises InputError for two cases of one name, or where
    nothing acts in a case of the list.
    """
    supports = data.get("supports")
    cases = []
    if "loads" in data or supports is not None:
        cases = [_case(data.get("loads", {}), supports, "loads")]
    for number, entry in enumerate(data.get("load_cases", ())):
        case = _case(entry, supports, entry.get("name", f"case {number + 1}"))
        if case.name in {other.name for other in cases}:
            raise InputError(
                "two load cases have this name", field=f"load_cases[{number}].name", value=case.name
            )
        if case.empty:
            raise InputError("nothing acts in this load case", field=f"load_cases[{number}]")
        cases.append(case)
    return tuple(cases)


def _case(loads: Mapping[str, Any], supports: Any, name: str) -> LoadCase:
    points = loads.get("points", [])
    held = loads.get("supports", supports)
    return LoadCase(
        loads.get("gravity"),
        np.array([point["joint"] for point in points], int),
        np.array([point["force"] for point in points], float).reshape(-1, 3),
        held,
        name,
        float(loads.get("factor", 1.0)),
        DeflectionLimit(**loads.get("deflection", {})),
    )

"""What acts on a deployed design, case by case: gravity, forces on its joints, where it is held,
and what it has to keep to under them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Indices, Numbers, NumbersLike, Points, RowsLike, Vector
from ..checks import check_positive
from ..equality import ByValue
from ..errors import InputError
from ..geometry.cells import cells_between, shares_of

FILE_LOADS = "loads"  # name of the case that a file's fields "loads" and "supports" make
_STRAIGHT = 1e-3  # points within this share of their extent from a line don't hold a structure
_SPREAD = ("gravity", "line", "area", "plan")  # loads of three numbers, or None


def hold_in_place(points: Points) -> bool:
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
            if value is not None:
                check_positive(f"deflection.{name}", value)

    def allowed(self, span: float) -> float:
        """The largest deflection, for a span; inf where nothing limits it."""
        own = np.inf if self.absolute is None else self.absolute
        return float(min(own, np.inf if self.span_over is None else span / self.span_over))


def tributary_areas(points: Points, links: Indices | None = None) -> tuple[Numbers, Numbers]:
    """The areas of a surface that its joints (n, 3) carry: (n,) on the surface, (n,) in plan.

    Each joint has its share of the cells that it is a corner of, see `geometry.cells`.

    links : (m, 2) joints that rods connect: the net's cells lie between these. Default: cells are
        the triangles between neighbouring joints, and the polygons of those on a circle

    Raises InputError for joints that span no surface.
    """
    from scipy.spatial import QhullError

    try:
        cells = cells_between(points, links)
    except (QhullError, ValueError):
        raise InputError("joints on a line carry no loads per area", field="loads.area") from None
    return shares_of(points, cells)


def _times(factor: float, value: np.ndarray | None) -> np.ndarray | None:
    return None if value is None else factor * value


def _sum(first: np.ndarray | None, second: np.ndarray | None) -> np.ndarray | None:
    if first is None or second is None:
        return second if first is None else first
    return first + second


@dataclass(frozen=True, eq=False)
class LoadCase(ByValue):
    """Loads on the deployed state, in the design's own axes; lists become arrays.

    gravity : (3,) acceleration that gives the rods their weight, or None
    joints (m,), forces (m, 3) : forces that keep their direction, and the joints that they act on
        (from 0)
    supports : (k,) joints that stay where they are, or None: those that the analysis chooses
    line : (3,) force per rest length on every rod, or None
    area : (3,) force per area of the target surface, such as cladding, or None
    plan : (3,) force per area in plan, the surface seen along z, such as snow, or None; both act on
        the joints, see `tributary_areas`
    name : as results have it
    factor : that strength and stability are asked for: loads times this. Deflections are those
        under the loads themselves
    deflection : how far the design may move under them
    """

    gravity: Vector | None = None
    joints: Indices = field(default_factory=lambda: np.zeros(0, int))
    forces: Points = field(default_factory=lambda: np.zeros((0, 3)))
    supports: Indices | None = None
    name: str = FILE_LOADS
    factor: float = 1.0
    deflection: DeflectionLimit = DeflectionLimit()  # or its fields by name
    line: Vector | None = None
    area: Vector | None = None
    plan: Vector | None = None

    if TYPE_CHECKING:  # lists are welcome too

        def __init__(
            self,
            gravity: NumbersLike | None = None,
            joints: NumbersLike = (),
            forces: RowsLike = (),
            supports: NumbersLike | None = None,
            name: str = FILE_LOADS,
            factor: float = 1.0,
            deflection: DeflectionLimit | Mapping[str, float] = DeflectionLimit(),
            line: NumbersLike | None = None,
            area: NumbersLike | None = None,
            plan: NumbersLike | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        for name, kind in (
            *((name, float) for name in _SPREAD),
            ("joints", int),
            ("forces", float),
            ("supports", int),
        ):
            if (value := getattr(self, name)) is not None:
                try:
                    given = np.asarray(value)
                    if kind is int and given.size and not np.issubdtype(given.dtype, np.integer):
                        raise TypeError(f"joints are whole numbers, got {given.dtype}")
                    # a copy: results have it when the caller's array has changed
                    object.__setattr__(self, name, np.array(value, kind))
                except (OverflowError, TypeError, ValueError) as error:
                    raise InputError(f"expected numbers: {error}", field=f"loads.{name}") from None
        self._check_shapes()
        check_positive("loads.factor", self.factor)
        if not isinstance(self.deflection, DeflectionLimit):
            try:
                object.__setattr__(self, "deflection", DeflectionLimit(**self.deflection))
            except TypeError:
                raise InputError(
                    "expected a DeflectionLimit, or absolute and span_over",
                    field="loads.deflection",
                    value=self.deflection,
                ) from None

    def _check_shapes(self) -> None:
        for name in _SPREAD:
            value = getattr(self, name)
            if value is not None and not (value.shape == (3,) and np.isfinite(value).all()):
                raise InputError(
                    "expected three finite numbers, as [0, 0, -9.81]",
                    field=f"loads.{name}",
                    value=value.tolist(),
                )
        joints, forces = np.atleast_1d(self.joints), np.atleast_2d(self.forces)
        if joints.ndim != 1 or forces.shape != (len(joints), 3) and (len(joints) or forces.size):
            raise InputError(
                f"expected a force of three numbers for each of {joints.size} joints",
                field="loads.forces",
                value=self.forces.tolist(),
            )
        if not np.isfinite(forces).all():
            raise InputError("must be finite", field="loads.forces", value=forces.tolist())
        object.__setattr__(self, "joints", joints)
        object.__setattr__(self, "forces", forces.reshape(-1, 3))
        if self.supports is not None:
            object.__setattr__(self, "supports", np.atleast_1d(self.supports))

    def __repr__(self) -> str:
        acting = [name for name in _SPREAD if np.any(getattr(self, name))]
        acting += [f"{len(self.joints)} forces"] if len(self.joints) else []
        return f"<LoadCase {self.name!r}: {', '.join(acting) or 'nothing acts'}>"

    def times(self, factor: float) -> LoadCase:
        """The same case with all loads multiplied."""
        spread: dict[str, Any] = {name: _times(factor, getattr(self, name)) for name in _SPREAD}
        return replace(self, forces=factor * self.forces, **spread)

    def and_(self, other: LoadCase) -> LoadCase:
        """Both cases' loads together; name, factor, deflection and supports are this one's.

        Raises InputError where both name supports and these differ.
        """
        mine, its = self.supports, other.supports
        if mine is not None and its is not None and set(mine.tolist()) != set(its.tolist()):
            raise InputError(
                f"{self.name} and {other.name} are held at different joints", field="supports"
            )
        spread: dict[str, Any] = {
            name: _sum(getattr(self, name), getattr(other, name)) for name in _SPREAD
        }
        return replace(
            self,
            joints=np.concatenate([self.joints, other.joints]),
            forces=np.concatenate([self.forces, other.forces]),
            supports=its if mine is None else mine,
            **spread,
        )

    def on_joints(self, surface: Numbers, plan: Numbers) -> Points | None:
        """(n, 3) forces on all joints of what is given per area, for their areas (n,); None where
        nothing is."""
        if self.area is None and self.plan is None:
            return None
        nothing = np.zeros(3)
        return np.outer(surface, nothing if self.area is None else self.area) + np.outer(
            plan, nothing if self.plan is None else self.plan
        )

    @property
    def empty(self) -> bool:
        """Whether nothing acts."""
        return not (np.any(self.forces) or any(np.any(getattr(self, name)) for name in _SPREAD))

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
    field "load_cases" for several, "combinations" for several at once, as design.schema.json
    describes them.

    The first one may have supports alone, for loads that come later. A case of the list that names
    no supports has those of the design. Raises InputError for two cases of one name, or where
    nothing acts in a case of the list.
    """
    supports = data.get("supports")
    cases = []
    if "loads" in data or supports is not None:
        cases = [_case(data.get("loads", {}), supports, FILE_LOADS)]
    for number, entry in enumerate(data.get("load_cases", ())):
        case = _case(entry, supports, entry.get("name", f"case {number + 1}"))
        if case.name in {other.name for other in cases}:
            raise InputError(
                "two load cases have this name", field=f"load_cases[{number}].name", value=case.name
            )
        if case.empty:
            raise InputError("nothing acts in this load case", field=f"load_cases[{number}]")
        cases.append(case)
    for number, entry in enumerate(data.get("combinations", ())):
        cases.append(_combination(entry, {case.name: case for case in cases}, number))
    return tuple(cases)


def _combination(entry: Mapping[str, Any], cases: Mapping[str, LoadCase], number: int) -> LoadCase:
    """Several cases at once, each times its factor."""
    field_name, name = f"combinations[{number}]", entry["name"]
    if name in cases:
        raise InputError("a load case has this name", field=f"{field_name}.name", value=name)
    found = LoadCase(
        name=name,
        factor=float(entry.get("factor", 1.0)),
        deflection=DeflectionLimit(**entry.get("deflection", {})),
    )
    for case, factor in entry["factors"].items():
        if case not in cases:
            raise InputError(
                f"is no load case (there are: {', '.join(cases) or 'none'})",
                field=f"{field_name}.factors",
                value=case,
            )
        found = found.and_(cases[case].times(float(factor)))
    return found


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
        loads.get("line"),
        loads.get("area"),
        loads.get("plan"),
    )

"""A kit of parts, and the assignment of elements to its parts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from ..arrays import Indices, KitVector, NumbersLike, ParameterFlags, Parameters, Parts, RowsLike
from ..checks import check_kind
from ..equality import ByValue
from ..errors import InputError
from ..units import Units
from .groups import ElementGroup
from .kinds import PartKind, Variants, part_kind


@dataclass(frozen=True, eq=False)
class Kit(ByValue):
    """Parts by kind.

    parts : kind -> (m, k_p) parameters of its parts; lengths in the designs' unit, angles in
        radians
    units : of the lengths, where they are known

    The kit as one vector p (n_p,): kinds in alphabetical order, within them part by part, parameter
    by parameter.
    """

    parts: Mapping[str, Parts]
    units: Units | None = None

    if TYPE_CHECKING:  # lists are welcome too

        def __init__(
            self, parts: Mapping[str, NumbersLike | RowsLike], units: Units | None = None
        ) -> None: ...

    def __post_init__(self) -> None:
        check_kind("parts", self.parts, Mapping, "kind -> parts")
        if self.units is not None:
            check_kind("units", self.units, Units)
        checked = {name: _checked(part_kind(name), self.parts[name]) for name in sorted(self.parts)}
        object.__setattr__(self, "parts", checked)

    def __repr__(self) -> str:
        sizes = ", ".join(f"{count} {kind}" for kind, count in self.sizes.items())
        unit = "" if self.units is None else f", in {self.units.length}"
        return f"<Kit: {sizes} parts{unit}>"

    def __getitem__(self, kind: str) -> Parts:
        """(m, k_p) parts of a kind; InputError when the kit has none."""
        if not isinstance(kind, str) or kind not in self.parts:
            raise InputError("the kit has no parts of this kind", field="kit", value=kind)
        return self.parts[kind]

    @property
    def sizes(self) -> dict[str, int]:
        """kind -> number of parts."""
        return {name: len(parts) for name, parts in self.parts.items()}

    @cached_property
    def vector(self) -> KitVector:
        """(n_p,) all parameters; see the class for their order."""
        return np.concatenate([parts.ravel() for parts in self.parts.values()] or [np.empty(0)])

    @cached_property
    def offsets(self) -> dict[str, int]:
        """kind -> where its first parameter stands in `vector`."""
        starts = np.cumsum([0] + [parts.size for parts in self.parts.values()])
        return dict(zip(self.parts, starts.tolist()))

    def with_vector(self, p: KitVector) -> Kit:
        """The kit with other parameters p (n_p,)."""
        p = np.asarray(p, dtype=float)
        if p.shape != self.vector.shape:
            raise InputError(
                f"expected the kit's {self.vector.size} numbers, got the shape {p.shape}", field="p"
            )
        return Kit(
            {
                name: p[start : start + self.parts[name].size].reshape(self.parts[name].shape)
                for name, start in self.offsets.items()
            },
            self.units,
        )

    def bounds(self, bounds: Mapping[str, tuple] | None = None) -> tuple[KitVector, KitVector]:
        """(n_p,), (n_p,): bounds of `vector`, natural ones narrowed by the user's (kind -> lower,
        upper)."""
        pairs = [(part_kind(name).bounds(bounds), len(parts)) for name, parts in self.parts.items()]
        lower, upper = (
            np.concatenate([np.tile(pair[side], m) for pair, m in pairs]) for side in (0, 1)
        )
        return lower, upper

    def to_dict(self) -> dict[str, list]:
        """Plain lists for JSON: kind -> [[...], ...], or [...] for kinds of one parameter."""
        return {
            name: (parts[:, 0] if parts.shape[1] == 1 else parts).tolist()
            for name, parts in self.parts.items()
        }

    @classmethod
    def from_dict(cls, data: Any, source: str = "kit") -> Kit:
        """The kit that `to_dict` wrote; InputError for unknown kinds, wrong shapes, values that
        aren't numbers."""
        if not isinstance(data, Mapping) or not data:
            raise InputError(
                "a kit is a non-empty object: kind of parts -> list of parts", source=source
            )
        try:
            return cls(dict(data))
        except InputError as error:
            raise error.at(source) from None


def _checked(kind: PartKind, values: Any) -> np.ndarray:
    """(m, k_p) read-only copy of a kind's parts."""
    try:
        given = np.array(values)
    except ValueError:  # lists of different lengths
        given = np.array(None)
    if given.dtype.kind not in "iuf":
        raise InputError(
            "parts are lists of numbers, equally many each", field=f"kit.{kind.name}", value=values
        )
    parts = given.astype(float)
    if parts.ndim == 1 and kind.n_parameters == 1:
        parts = parts[:, None]
    if parts.ndim != 2 or len(parts) == 0 or parts.shape[1] != kind.n_parameters:
        names = ", ".join(kind.parameter_names)
        raise InputError(
            f"expected at least one part of {kind.n_parameters} parameters ({names})",
            field=f"kit.{kind.name}",
            value=values,
        )
    tolerance = 1e-9 * np.abs(parts).max()
    bad = ~(
        np.isfinite(parts) & (parts >= kind.lower - tolerance) & (parts <= kind.upper + tolerance)
    )
    if bad.any():
        row = int(np.argwhere(bad)[0, 0])
        raise InputError(
            "outside of what such a part can be",
            field=f"kit.{kind.name}[{row}]",
            value=parts[row].tolist(),
        )
    parts.setflags(write=False)
    return parts


@dataclass(frozen=True, eq=False)
class Assignment(ByValue):
    """Which part realises each element, and in which variant.

    groups : the elements
    part, variant : for each group (n,) int
    n_q : number of entries of the parameter vector q that the groups index
    """

    groups: tuple[ElementGroup, ...]
    part: tuple[Indices, ...]
    variant: tuple[Indices, ...]
    n_q: int = field(default=0)

    def __repr__(self) -> str:
        sizes = ", ".join(f"{len(part)} {g.kind}" for g, part in zip(self.groups, self.part))
        return f"<Assignment of {sizes} elements>"

    def matrix(self, kit: Kit, upper: bool = False) -> sp.csr_array:
        """M (n_q, n_p): the elements that the kit p realises are q = M p.

        With kinds that realise intervals, M p is their lower end, and `upper` asks for the upper
        one.
        """
        return self._rows(
            kit, [_end(variants, variant, upper) for _, _, variants, variant in self._filled()]
        )

    def contact(self, q: Parameters, kit: Kit) -> tuple[sp.csr_array, ParameterFlags]:
        """M (n_q, n_p) and active (n_q,) bool: the elements q differ by q - M p where active,
        elsewhere not at all.

        Without interval parts, M is `matrix` and every element is active.
        """
        active = np.zeros(self.n_q, dtype=bool)
        blocks = []
        for group, part, variants, variant in self._filled():
            rows, touching = variants.contact(q[group.indices], variant, kit[group.kind][part])
            active[group.indices] = touching
            blocks.append(rows)
        return self._rows(kit, blocks), active

    def realise(self, kit: Kit, q: Parameters) -> Parameters:
        """(n_q,) the elements nearest to q that the assigned parts realise; entries outside the
        groups as in q."""
        matrix, active = self.contact(q, kit)
        return np.where(active, matrix @ kit.vector, q)

    def changes(self, other: Assignment) -> int:
        """Number of elements whose part or variant differs."""
        pairs = zip(self.part, other.part, self.variant, other.variant)
        return sum(int(np.count_nonzero((a != b) | (v != w))) for a, b, v, w in pairs)

    def pieces(self, kit: Kit) -> dict[str, Indices]:
        """kind -> (m,) how many elements each part realises."""
        counts = {name: np.zeros(m, dtype=int) for name, m in kit.sizes.items()}
        for group, part, _, _ in self._filled():
            counts[group.kind] += np.bincount(part, minlength=len(counts[group.kind]))
        return counts

    def to_dict(self) -> list[dict[str, Any]]:
        """Plain lists for JSON, one object a group: kind, part, variant."""
        return [
            {"kind": group.kind, "part": part.tolist(), "variant": variant.tolist()}
            for group, part, variant in zip(self.groups, self.part, self.variant)
        ]

    @classmethod
    def from_dict(
        cls,
        data: Any,
        groups: Sequence[ElementGroup],
        n_q: int,
        kit: Kit,
        source: str = "assignment",
    ) -> Assignment:
        """The assignment of these groups to this kit that `to_dict` wrote; InputError when it
        doesn't fit them."""
        try:
            kinds = [entry["kind"] for entry in data]
            part, variant = (
                tuple(np.array(entry[key], dtype=np.intp) for entry in data)
                for key in ("part", "variant")
            )
        except (TypeError, KeyError, ValueError):
            raise InputError(
                "expected a list of objects with kind, part and variant", source=source
            ) from None
        sizes = [len(group.indices) for group in groups]
        lengths = ([len(a) for a in part], [len(a) for a in variant])
        if kinds != [group.kind for group in groups] or lengths != (sizes, sizes):
            raise InputError("doesn't fit the elements of these designs", source=source)
        assignment = cls(tuple(groups), part, variant, n_q)
        for group, parts, variants, chosen in assignment._filled():
            if group.kind not in kit.parts:
                raise InputError(
                    "the kit has no parts of this kind",
                    source=source,
                    field="kit",
                    value=group.kind,
                )
            if not (_within(parts, len(kit[group.kind])) and _within(chosen, len(variants.names))):
                raise InputError(
                    "names a part or variant that doesn't exist", source=source, field=group.kind
                )
        return assignment

    def _filled(self) -> Iterator[tuple[ElementGroup, np.ndarray, Variants, np.ndarray]]:
        """Each group that has elements: the group, its parts, what its variants mean, its
        variants."""
        for group, part, variant in zip(self.groups, self.part, self.variant):
            if len(part):
                yield (
                    group,
                    part,
                    part_kind(group.kind).variants_of(group.indices.shape[1]),
                    variant,
                )

    def _rows(self, kit: Kit, blocks: Sequence[np.ndarray]) -> sp.csr_array:
        """CSR (n_q, n_p) of each filled group's maps (n, k_e, k_p) from its parts to its
        elements."""
        rows, columns, values = [], [], []
        for (group, part, _, _), block in zip(self._filled(), blocks):
            k_p = block.shape[2]
            first = kit.offsets[group.kind] + k_p * part
            rows.append(np.broadcast_to(group.indices[:, :, None], block.shape).ravel())
            columns.append(
                np.broadcast_to((first[:, None] + np.arange(k_p))[:, None, :], block.shape).ravel()
            )
            values.append(block.ravel())
        entries, i, j = (np.concatenate(a) if a else np.empty(0) for a in (values, rows, columns))
        used = entries != 0
        shape = (self.n_q, len(kit.vector))
        return sp.csr_array(
            (entries[used], (i[used].astype(int), j[used].astype(int))), shape=shape
        )


def _within(numbers: np.ndarray, count: int) -> bool:
    return bool(np.all((numbers >= 0) & (numbers < count)))


def _end(variants: Variants, variant: np.ndarray, upper: bool) -> np.ndarray:
    """(n, k_e, k_p) maps to the lower or upper end of what a part realises."""
    maps = (
        variants.matrices
        if variants.reach is None or not upper
        else variants.matrices + variants.reach
    )
    return maps[variant]

"""Elements of a kind, by where their parameters stand: all that a kit needs to know of a design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import ElementIndices, Parameters, RowsLike
from ..checks import check_kind
from ..equality import ByValue
from ..errors import InputError
from ..wording import counted


@dataclass(frozen=True, eq=False)
class ElementGroup(ByValue):
    """Elements of one kind and one number of parameters.

    kind : name of the part kind that serves them ("linear", "angular", "cell", ...)
    indices : (n, k) int, where the k parameters of each element stand in the design's parameters q
    """

    kind: str
    indices: ElementIndices

    if TYPE_CHECKING:  # lists are welcome too

        def __init__(self, kind: str, indices: RowsLike) -> None: ...

    def __post_init__(self) -> None:
        check_kind("kind", self.kind, str)
        try:
            given = np.asarray(self.indices)
        except ValueError:  # lists of different lengths
            given = np.array(None)
        if given.ndim != 2 or given.size and given.dtype.kind not in "iu":
            raise InputError(
                "expected whole numbers, a row for each element",
                field="indices",
                value=f"{given.dtype} of the shape {given.shape}",
            )
        object.__setattr__(self, "indices", given.astype(np.intp, copy=False))

    def __repr__(self) -> str:
        n, k = self.indices.shape
        return f"<ElementGroup: {counted(n, f'{self.kind} element')} of {counted(k, 'parameter')}>"

    def shifted(self, offset: int) -> ElementGroup:
        """The same elements in a longer parameter vector (several designs after each other)."""
        return ElementGroup(self.kind, self.indices + offset)


def check_groups(groups: Sequence[ElementGroup], q: Parameters) -> None:
    """Raise InputError unless these are groups of elements among the parameters q (n_q,)."""
    if isinstance(groups, str) or not isinstance(groups, Sequence):
        raise InputError(
            "expected a list of ElementGroup, as the field groups of a design",
            field="groups",
            value=type(groups).__name__,
        )
    for group in groups:
        check_kind("groups", group, ElementGroup)
    try:
        shape = np.asarray(q, float).shape
    except (TypeError, ValueError):
        shape = ()
    needed = 1 + max((int(g.indices.max()) for g in groups if g.indices.size), default=-1)
    if len(shape) != 1 or shape[0] < needed:
        raise InputError(
            f"expected the {needed} parameters that the groups index, got the shape {shape}",
            field="q",
        )

"""A stock: parts that exist, each in a number of pieces; and what it lacks for some designs.

Designs are built one after the other, each from the whole stock, or all of them together. The best
assignment is a transport problem a kind, solved exactly by the shortest augmenting paths of scipy's
`linear_sum_assignment` over single pieces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from .assign import element_owners, to_assignment, transport
from .elements import collect
from .groups import ElementGroup
from .parts import Assignment, Kit

Numbers = Sequence[int] | np.ndarray


@dataclass(frozen=True)
class Missing:
    """Pieces of one kind that a stock lacks.

    kind : of the pieces
    number : how many are needed besides what is there
    copies : (m,) of which parts of the stock they would best be; None where it has none of the kind
    design : number of the design that needs the most of them; None for all of them together
    """

    kind: str
    number: int
    copies: np.ndarray | None
    design: int | None


@dataclass(frozen=True)
class Stock:
    """Parts in limited numbers.

    kit : the parts
    counts : kind -> (m,) how many pieces there are of each part
    together : whether all designs stand at the same time; otherwise they are built one after the
        other, each from the whole stock

    Raises InputError for numbers that don't fit the kit.
    """

    kit: Kit
    counts: Mapping[str, np.ndarray]
    together: bool = False

    def __post_init__(self) -> None:
        checked = {}
        for kind, m in self.kit.sizes.items():
            given = np.asarray(self.counts.get(kind, ()))
            whole = given.shape == (m,) and np.issubdtype(given.dtype, np.integer)
            if not whole or np.any(given < 0):
                raise InputError(
                    f"expected {m} whole numbers, not negative",
                    field=f"counts.{kind}",
                    value=given.tolist(),
                )
            checked[kind] = given.astype(int)
        for kind in self.counts:
            if kind not in checked:
                raise InputError("counts pieces of a kind that the kit lacks", field="counts")
        object.__setattr__(self, "counts", checked)

    def owners(self, design_of: Numbers) -> np.ndarray:
        """(n_groups,) which groups share the pieces: those of a design, or all of them.

        design_of : (n_groups,) number of each group's design
        """
        return np.zeros(len(design_of), dtype=int) if self.together else np.asarray(design_of)

    def assign(
        self, groups: Sequence[ElementGroup], q: np.ndarray, design_of: Numbers
    ) -> Assignment:
        """The assignment of least total squared distance for which the pieces suffice.

        groups : the elements; q : (n_q,) their parameters; design_of : see `owners`

        Raises InputError when the stock is too small.
        """
        elements = collect(groups, q)
        labels = {}
        for kind, e in elements.items():
            owner = element_owners(groups, e, self.owners(design_of))
            labels[kind] = transport(e, self.kit[kind], self.counts[kind], owner)
        return to_assignment(groups, len(q), elements, labels)

    def missing(
        self, groups: Sequence[ElementGroup], q: np.ndarray, design_of: Numbers
    ) -> list[Missing]:
        """What the stock lacks, by kind; empty when it suffices. Arguments as for `assign`."""
        found = []
        for kind, e in collect(groups, q).items():
            owner = element_owners(groups, e, self.owners(design_of))
            needed = np.bincount(owner)
            neediest = int(needed.argmax())
            there = self.counts[kind].sum() if kind in self.counts else 0
            number = int(needed[neediest] - there)
            if number <= 0:
                continue
            copies = None
            if kind in self.counts:
                # whole further pieces of any part, dear enough that none is spared for the fit
                parts, own = self.kit[kind], e.among(owner == neediest)
                more = np.full(len(parts), number)
                both = np.concatenate([parts, parts])
                costs = own.costs(both)[0]
                surcharge = np.where(np.arange(len(both)) < len(parts), 0.0, 10 * costs.sum())
                counts = np.append(self.counts[kind], more)
                used = transport(own, both, counts, np.zeros(own.n, dtype=int), surcharge).part
                copies = np.bincount(used, minlength=len(both))[len(parts) :]
            found.append(Missing(kind, number, copies, None if self.together else neediest))
        return found

    def spare(self, assignment: Assignment, design_of: Numbers) -> list[np.ndarray]:
        """For each group the pieces (m,) that it may take without giving any back; groups that
        share pieces share the array.

        Designs that stand together take none from each other here: each keeps the pieces that it
        has, and its elements exchange them.
        """
        shared: dict[tuple[int, str], np.ndarray] = {}
        for group, part, design in zip(assignment.groups, assignment.part, design_of):
            key = (int(design), group.kind)
            if key not in shared:
                shared[key] = self.counts[group.kind].copy()
            shared[key] -= np.bincount(part, minlength=len(shared[key]))
        if self.together:
            shared = {key: np.zeros_like(left) for key, left in shared.items()}
        return [
            shared[int(design), group.kind] for group, design in zip(assignment.groups, design_of)
        ]

    def to_dict(self) -> dict[str, Any]:
        """The counts as plain lists, for the record."""
        return {kind: counts.tolist() for kind, counts in self.counts.items()}

"""The pieces of a kit: how many have to be made so that each of several designs can be built, one
after the other, and what another part for one element changes of that."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .parts import Assignment, Kit

Numbers = Sequence[int] | np.ndarray


class PieceCount:
    """Pieces of every part by design, kept up to date while elements get other parts.

    kit, assignment : to begin with
    design_of : (n_groups,) the design that each group of elements belongs to
    """

    def __init__(self, kit: Kit, assignment: Assignment, design_of: Numbers):
        designs = 1 + max((int(n) for n in design_of), default=0)
        self.counts = {kind: np.zeros((designs, m), int) for kind, m in kit.sizes.items()}
        for group, part, n in zip(assignment.groups, assignment.part, design_of):
            np.add.at(self.counts[group.kind][n], part, 1)

    @property
    def fabricated(self) -> int:
        """As many of each part as the design that uses most of it."""
        return int(sum(counts.max(axis=0).sum() for counts in self.counts.values()))

    @property
    def elements(self) -> int:
        """Pieces that would be needed if all designs stood at the same time."""
        return int(sum(counts.sum() for counts in self.counts.values()))

    def changes(self, kind: str, design: int, part: int) -> np.ndarray:
        """(m,) by how many pieces `fabricated` changes when an element of a design made of this
        part gets each of the kind's parts."""
        own = self.counts[kind][design]
        others = np.delete(self.counts[kind], design, axis=0).max(axis=0, initial=0)
        found = (own >= others).astype(int) - int(own[part] > others[part])
        found[part] = 0
        return found

    def move(self, kind: str, design: int, part: int, other: int) -> None:
        """One element of a design is made of another part now."""
        self.counts[kind][design, part] -= 1
        self.counts[kind][design, other] += 1

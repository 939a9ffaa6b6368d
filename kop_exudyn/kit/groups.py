"""Elements of a kind, by where their parameters stand: all that a kit needs to know of a design."""

from __future__ import annotations

from dataclasses import dataclass

from ..arrays import ElementIndices
from ..wording import counted


@dataclass(frozen=True)
class ElementGroup:
    """Elements of one kind and one number of parameters.

    kind : name of the part kind that serves them ("linear", "angular", "cell", ...)
    indices : (n, k) int, where the k parameters of each element stand in the design's parameters q
    """

    kind: str
    indices: ElementIndices

    def __repr__(self) -> str:
        n, k = self.indices.shape
        return f"<ElementGroup: {counted(n, f'{self.kind} element')} of {counted(k, 'parameter')}>"

    def shifted(self, offset: int) -> ElementGroup:
        """The same elements in a longer parameter vector (several designs after each other)."""
        return ElementGroup(self.kind, self.indices + offset)

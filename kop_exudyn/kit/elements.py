"""The elements of one kind, of all designs together: distances to parts, best parts, and their
energy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from .groups import ElementGroup
from .kinds import PartKind, Variants, part_kind

Penalties = Mapping[str, Sequence[float]]  # kind -> (k_p,) weights that replace the kind's own


_EQUAL = 1e-10  # of the largest element: distances that differ by less are equal


@dataclass(frozen=True)
class Labels:
    """Part and variant of each element (n,), and its squared distance to what they realise (n,)."""

    part: np.ndarray
    variant: np.ndarray
    squared: np.ndarray

    def same(self, other: Labels) -> bool:
        return np.array_equal(self.part, other.part) and np.array_equal(self.variant, other.variant)


@dataclass(frozen=True)
class Block:
    """Elements with the same number of parameters: values (n, k_e)."""

    variants: Variants
    values: np.ndarray

    def contact(
        self, parts: np.ndarray, labels: Labels, span: slice
    ) -> tuple[np.ndarray, np.ndarray]:
        """See `Variants.contact`."""
        return self.variants.contact(self.values, labels.variant[span], parts[labels.part[span]])


@dataclass(frozen=True)
class KindElements:
    """All elements of one kind.

    blocks : by number of parameters, the largest first; elements are numbered block by block
    groups : for each block, the numbers of the groups that make it up
    scale : length that distances are relative to
    penalty : (k_p,) weights of the parts' own energy
    """

    kind: PartKind
    blocks: tuple[Block, ...]
    groups: tuple[tuple[int, ...], ...]
    scale: float
    penalty: np.ndarray

    @property
    def n(self) -> int:
        return sum(len(block.values) for block in self.blocks)

    @property
    def exact(self) -> bool:
        """Whether every variant realises one value: then the best parts are averages."""
        return all(block.variants.reach is None for block in self.blocks)

    @property
    def spans(self) -> list[slice]:
        """Where each block's elements stand among all."""
        ends = np.cumsum([len(block.values) for block in self.blocks]).tolist()
        return [slice(start, end) for start, end in zip([0, *ends], ends)]

    def among(self, chosen: np.ndarray) -> KindElements:
        """Some of the elements (n,) bool; they belong to no groups any more."""
        blocks = [
            replace(block, values=block.values[chosen[span]])
            for block, span in zip(self.blocks, self.spans)
        ]
        filled = tuple(block for block in blocks if len(block.values))
        return replace(self, blocks=filled, groups=((),) * len(filled))

    @property
    def numbers(self) -> np.ndarray | None:
        """(n,) numbers whose clustering is that of the elements; None for kinds of another sort.

        Parts that can be built in with either sign, and are none below zero, serve sizes.
        """
        if self.kind.n_parameters > 1 or not self.exact or np.any(self.penalty):
            return None
        found = []
        for block in self.blocks:
            signs = set(block.variants.matrices.ravel().tolist())
            both = signs == {1.0, -1.0}
            if block.values.shape[1] > 1 or not (both or signs == {1.0}):
                return None
            if both and self.kind.lower[0] < 0:
                return None
            found.append(np.abs(block.values[:, 0]) if both else block.values[:, 0])
        return np.concatenate(found)

    def nearest(self, parts: np.ndarray) -> Labels:
        """Nearest part (m, k_p) and variant of each element; of equally near ones the first."""
        found = [_nearest_in_block(block, parts) for block in self.blocks]
        return Labels(*(np.concatenate(column) for column in zip(*found)))

    def costs(self, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Squared distance (n, m) of each element to each part in its best variant, and that
        variant (n, m)."""
        squared = [
            np.sum(block.variants.residuals(block.values, parts) ** 2, axis=3)
            for block in self.blocks
        ]
        return np.concatenate([s.min(axis=2) for s in squared]), np.concatenate(
            [s.argmin(axis=2) for s in squared]
        )

    def energy(self, parts: np.ndarray, labels: Labels) -> float:
        """Mean of half the squared relative distances, plus the parts' penalty; dimensionless."""
        own = np.sum(parts**2 @ self.penalty) / len(parts)
        return 0.5 * float(labels.squared.mean() + own) / self.scale**2

    def lift(self, element: int, near: np.ndarray | None = None) -> np.ndarray:
        """(k_p,) a part in canonical form that realises this element, otherwise like the part
        `near` (k_p,)."""
        for block, span in zip(self.blocks, self.spans):
            if element < span.stop:
                values = block.values[element - span.start][None]
                return self.kind.canonical(
                    block.variants.lift(values, None if near is None else near[None])
                )[0]
        raise IndexError(element)

    def normal_equations(self, parts: np.ndarray, labels: Labels) -> tuple[np.ndarray, np.ndarray]:
        """N (m, k_p, k_p) and b (m, k_p): the best parts for these labels solve N p = b.

        Summed over the elements and multiplied by n scale^2. With interval parts, N and b hold for
        the contact at `parts`, whose derivative N p - b is exact.
        """
        m, k = parts.shape
        normal, right = np.zeros((m, k, k)), np.zeros((m, k))
        normal[:] = np.diag(self.penalty) * self.n / m
        for block, span in zip(self.blocks, self.spans):
            rows, active = block.contact(parts, labels, span)
            rows = rows * active[:, :, None]
            np.add.at(normal, labels.part[span], np.einsum("nek,nel->nkl", rows, rows))
            np.add.at(right, labels.part[span], np.einsum("nek,ne->nk", rows, block.values))
        return normal, right


def _nearest_in_block(block: Block, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    n_variants = len(block.variants.names)
    squared = np.sum(block.variants.residuals(block.values, parts) ** 2, axis=3).reshape(
        len(block.values), -1
    )
    # of equally near ones the first, whatever rounding leaves of an element: a corner of no angle,
    # say, would take its part's variants by chance
    least, error = squared.min(axis=1, keepdims=True), _EQUAL * np.abs(block.values).max()
    best = (squared <= least + error * (np.sqrt(least) + error)).argmax(axis=1)
    return best // n_variants, best % n_variants, squared[np.arange(len(best)), best]


def collect(
    groups: Sequence[ElementGroup],
    q: np.ndarray,
    scales: Mapping[str, float] | None = None,
    penalties: Penalties | None = None,
) -> dict[str, KindElements]:
    """The elements by kind (alphabetical), from the groups and all parameters q (n_q,); empty
    groups are left out.

    scales : kind -> scale; by default those of q itself
    Raises InputError for unknown kinds, values that aren't finite and inputs without any extent.
    """
    q = np.asarray(q, dtype=float)
    by_kind: dict[str, dict[int, list[int]]] = {}
    for number, group in enumerate(groups):
        if len(group.indices) == 0:
            continue
        if not np.isfinite(q[group.indices]).all():
            raise InputError("element parameters must be finite numbers", field=group.kind)
        by_kind.setdefault(group.kind, {}).setdefault(group.indices.shape[1], []).append(number)
    return {
        name: _kind_elements(name, by_kind[name], groups, q, scales, penalties or {})
        for name in sorted(by_kind)
    }


def _kind_elements(
    name: str,
    by_size: Mapping[int, list[int]],
    groups: Sequence[ElementGroup],
    q: np.ndarray,
    scales: Mapping[str, float] | None,
    penalties: Penalties,
) -> KindElements:
    kind = part_kind(name)
    sizes = sorted(by_size, reverse=True)
    values = [
        np.concatenate([q[groups[number].indices] for number in by_size[size]]) for size in sizes
    ]
    scale = (
        kind.scale(np.concatenate([v.ravel() for v in values])) if scales is None else scales[name]
    )
    if not scale > 0:
        raise InputError("the elements' median length must be positive", field=name, value=scale)
    own = np.zeros(kind.n_parameters) if kind.penalty is None else kind.penalty
    penalty = np.broadcast_to(
        np.asarray(penalties.get(name, own), dtype=float), (kind.n_parameters,)
    )
    if not np.all(penalty >= 0):
        raise InputError(
            "penalties can't be negative", field=f"penalties.{name}", value=penalty.tolist()
        )
    blocks = tuple(Block(kind.variants_of(size), v) for size, v in zip(sizes, values))
    return KindElements(kind, blocks, tuple(tuple(by_size[size]) for size in sizes), scale, penalty)

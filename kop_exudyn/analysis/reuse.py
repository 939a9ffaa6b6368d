"""How much designs share: kit size, Jaccard indices of their pieces, sets of designs that share
nothing.

Pieces of a design: how many of each part it is built of, a multiset. The kit needs as many of each
part as the design that uses most of it: then any one design can be built at a time, and taken apart
for the next.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

Pieces = Mapping[str, Sequence[int]]  # kind -> (m,) count of each part in one design


@dataclass(frozen=True)
class SubsetReuse:
    """The reuse of some of the designs: their numbers, and the generalised Jaccard index of their
    pieces in [0, 1]."""

    designs: tuple[int, ...]
    reuse: float


def counts_of(designs: Sequence[Pieces], kind: str | None = None) -> np.ndarray:
    """(n_designs, n_parts) pieces as one table, of one kind or of all (in alphabetical order)."""
    kinds = sorted(designs[0]) if kind is None else [kind]
    return np.array(
        [np.concatenate([np.asarray(pieces[k], dtype=int) for k in kinds]) for pieces in designs]
    )


def fabricated(counts: np.ndarray) -> int:
    """Pieces to make so that each of the designs (n_designs, n_parts) can be built at a time."""
    return int(np.max(counts, axis=0).sum())


def kit_size_percent(counts: np.ndarray) -> float:
    """Fabricated pieces over the elements of all designs, %; 100 / n_designs at best, 100 when
    nothing is shared."""
    return 100 * fabricated(counts) / int(counts.sum())


def reuse(counts: np.ndarray) -> float:
    """Pieces that all of these designs use over pieces that any of them uses: |A n B ...| / |A u B
    ...|, multisets.

    For two designs that is their Jaccard index (Jaccard, "The distribution of the flora in the
    Alpine zone", 1912).
    """
    return float(np.min(counts, axis=0).sum() / fabricated(counts))


def jaccard_matrix(counts: np.ndarray) -> np.ndarray:
    """(n_designs, n_designs) reuse of every pair of designs, 1 on the diagonal."""
    n = len(counts)
    matrix = np.eye(n)
    for i, j in combinations(range(n), 2):
        matrix[i, j] = matrix[j, i] = reuse(counts[[i, j]])
    return matrix


def subset_reuse(counts: np.ndarray) -> list[SubsetReuse]:
    """The reuse of every set of two or more designs, smaller sets first (2^n - n - 1 in all)."""
    n = len(counts)
    return [
        SubsetReuse(members, reuse(counts[list(members)]))
        for size in range(2, n + 1)
        for members in combinations(range(n), size)
    ]


def average_reuse(counts: np.ndarray) -> float:
    """Mean reuse of all sets of two or more designs; 1 for a single one."""
    found = [subset.reuse for subset in subset_reuse(counts)]
    return float(np.mean(found)) if found else 1.0


def disconnected(counts: np.ndarray) -> list[tuple[int, ...]]:
    """Sets of designs of which no two share a part: connected components of the graph of designs
    and parts."""
    n = len(counts)
    graph = sp.block_array(
        [
            [sp.csr_array((n, n)), sp.csr_array(counts > 0, dtype=float)],
            [sp.csr_array(counts.T > 0, dtype=float), None],
        ],
        format="csr",
    )
    labels = connected_components(graph, directed=False)[1][:n]
    return [
        tuple(np.flatnonzero(labels == label).tolist()) for label in dict.fromkeys(labels.tolist())
    ]


def part_users(counts: np.ndarray) -> np.ndarray:
    """(n_parts,) how many designs use each part."""
    return np.count_nonzero(counts, axis=0)


def reuse_figures(designs: Sequence[Pieces]) -> dict[str, Any]:
    """All of this for one kit, as plain data."""
    counts = counts_of(designs)
    return {
        "pieces": fabricated(counts),
        "elements": int(counts.sum()),
        "kit_size_percent": kit_size_percent(counts),
        "jaccard": jaccard_matrix(counts).tolist(),
        "average_reuse": average_reuse(counts),
        "by_kind": {kind: average_reuse(counts_of(designs, kind)) for kind in sorted(designs[0])},
        "subsets": [{"designs": list(s.designs), "reuse": s.reuse} for s in subset_reuse(counts)],
        "groups": [list(group) for group in disconnected(counts)],
        "parts_of_one_design": int(np.count_nonzero(part_users(counts) == 1)),
    }

"""The projection energy: how far the elements are from the kit that suits them best.

P(q) = w_c sum over kinds of (1/n_kind) sum_j rho(p_c(j), q_j), minimised over the parts p and the
assignment c, with rho half the squared difference in the best variant over the square of the kind's
scale. As (p, c) are minimisers, the derivative of P in q is that at fixed (p, c) (Becker, Kusupati,
Suzuki, Pauly, ACM TOG, 2024).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from .assign import to_assignment
from .cluster import lloyd
from .elements import KindElements, Labels, Penalties, collect
from .groups import ElementGroup
from .kinds import Bounds, part_kind
from .parts import Assignment, Kit


@dataclass(frozen=True)
class ProjectionHessian:
    """Second derivatives of the energy over (q, p) at a fixed assignment, which it is quadratic
    for.

    qq : (n_q, n_q) diagonal;  qp : (n_q, n_p);  pp : (n_p, n_p); all sparse
    """

    qq: sp.csr_array
    qp: sp.csr_array
    pp: sp.csr_array

    def lifted(self) -> sp.csr_array:
        """(n_q + n_p, n_q + n_p) Hessian of a QP over (dq, dp): sparse, though its elimination
        couples designs."""
        return sp.block_array([[self.qq, self.qp], [self.qp.T, self.pp]], format="csr")

    def reduced(self) -> np.ndarray:
        """(n_q, n_q) dense, parts eliminated as if none were at a bound: within a cluster, identity
        minus mean."""
        inverse = np.linalg.pinv(self.pp.toarray(), hermitian=True)
        qp = self.qp.toarray()
        return self.qq.toarray() - qp @ inverse @ qp.T


@dataclass(frozen=True)
class ProjectionMinimum:
    """The best kit for some q, found from a starting kit."""

    kit: Kit
    assignment: Assignment
    energy: float


@dataclass(frozen=True)
class Projection:
    """The projection energy of the elements of all designs.

    groups : the elements
    scales : kind -> scale, of the input elements
    weight : w_c
    bounds : kind -> (lower, upper) of the parts, besides the natural ones
    penalties : kind -> weights of the parts' own energy
    """

    groups: tuple[ElementGroup, ...]
    scales: Mapping[str, float]
    weight: float = 1.0
    bounds: Bounds | None = None
    penalties: Penalties | None = None

    @classmethod
    def of_inputs(
        cls,
        groups: Sequence[ElementGroup],
        q: np.ndarray,
        weight: float = 1.0,
        bounds: Bounds | None = None,
        penalties: Penalties | None = None,
    ) -> Projection:
        """The energy with the scales of the input parameters q (n_q,)."""
        scales = {name: elements.scale for name, elements in collect(groups, q).items()}
        return cls(tuple(groups), scales, weight, bounds, penalties)

    def with_weight(self, weight: float, penalties: Penalties | None = None) -> Projection:
        """The same energy with another w_c, and other penalties where some are given."""
        return replace(self, weight=weight, penalties=penalties or self.penalties)

    def minimise(self, q: np.ndarray, kit: Kit) -> ProjectionMinimum:
        """Best parts and assignment for q (n_q,), alternating from `kit`."""
        elements = self._elements(q)
        found = {
            name: lloyd(e, kit[name], *e.kind.bounds(self.bounds)) for name, e in elements.items()
        }
        parts = {name: parts for name, (parts, _) in found.items()}
        labels = {name: labels for name, (_, labels) in found.items()}
        return self._minimum(q, Kit({**kit.parts, **parts}, kit.units), elements, labels)

    def assign(self, q: np.ndarray, kit: Kit) -> ProjectionMinimum:
        """Best assignment for q (n_q,) to the parts of a kit that stays as it is."""
        elements = self._elements(q)
        labels = {name: e.nearest(kit[name]) for name, e in elements.items()}
        return self._minimum(q, kit, elements, labels)

    def _minimum(
        self,
        q: np.ndarray,
        kit: Kit,
        elements: dict[str, KindElements],
        labels: dict[str, Labels],
    ) -> ProjectionMinimum:
        assignment = to_assignment(self.groups, len(q), elements, labels)
        return ProjectionMinimum(kit, assignment, self.energy(q, kit, assignment))

    def energy(self, q: np.ndarray, kit: Kit, assignment: Assignment) -> float:
        """The energy for this kit and assignment."""
        _, difference, weights = self._difference(q, kit, assignment)
        return 0.5 * float(weights @ difference**2 + self._part_weights(kit) @ kit.vector**2)

    def gradient(self, q: np.ndarray, kit: Kit, assignment: Assignment) -> np.ndarray:
        """(n_q,) derivative in q, zero outside the groups; the exact one where kit and assignment
        are the minimum."""
        _, difference, weights = self._difference(q, kit, assignment)
        return weights * difference

    def hessian(self, q: np.ndarray, kit: Kit, assignment: Assignment) -> ProjectionHessian:
        """Exact second derivatives over (q, p) for this assignment."""
        matrix, active = assignment.contact(q, kit)
        weights = sp.dia_array((self._weights(len(q))[None] * active, [0]), shape=(len(q), len(q)))
        penalty = sp.dia_array((self._part_weights(kit)[None], [0]), shape=(len(kit.vector),) * 2)
        weighted = weights @ matrix
        return ProjectionHessian(
            sp.csr_array(weights),
            sp.csr_array(-weighted),
            sp.csr_array(matrix.T @ weighted + penalty),
        )

    def tightness(self, q: np.ndarray, kit: Kit, assignment: Assignment) -> dict[str, float]:
        """kind -> root mean square distance of the elements to their parts, relative to the kind's
        scale."""
        _, difference, _ = self._difference(q, kit, assignment)
        squares = dict.fromkeys(self.scales, 0.0)
        for group in self._filled:
            squares[group.kind] += float(np.sum(difference[group.indices] ** 2))
        counts = self._counts()
        return {
            name: float(np.sqrt(total / counts[name])) / self.scales[name]
            for name, total in squares.items()
        }

    @property
    def _filled(self) -> list[ElementGroup]:
        return [group for group in self.groups if len(group.indices)]

    def _elements(self, q: np.ndarray) -> dict[str, KindElements]:
        return collect(self.groups, q, self.scales, self.penalties)

    def _counts(self) -> dict[str, int]:
        counts = dict.fromkeys(self.scales, 0)
        for group in self._filled:
            counts[group.kind] += len(group.indices)
        return counts

    def _weights(self, n_q: int) -> np.ndarray:
        """(n_q,) w_c / (n_kind scale^2) of each element parameter, zero outside the groups."""
        weights, counts = np.zeros(n_q), self._counts()
        for group in self._filled:
            weights[group.indices] = self.weight / (
                counts[group.kind] * self.scales[group.kind] ** 2
            )
        return weights

    def _part_weights(self, kit: Kit) -> np.ndarray:
        """(n_p,) w_c penalty / (m scale^2) of each part parameter."""
        rows = []
        for name, parts in kit.parts.items():
            own = part_kind(name).penalty
            penalty = (self.penalties or {}).get(name, 0.0 if own is None else own)
            factor = (
                self.weight / (len(parts) * self.scales[name] ** 2) if name in self.scales else 0.0
            )
            rows.append((factor * np.broadcast_to(penalty, parts.shape)).ravel())
        return np.concatenate(rows)

    def _difference(
        self, q: np.ndarray, kit: Kit, assignment: Assignment
    ) -> tuple[sp.csr_array, np.ndarray, np.ndarray]:
        """M of `Assignment.contact`, the differences (n_q,) and their weights (n_q,)."""
        matrix, active = assignment.contact(q, kit)
        return matrix, np.where(active, q - matrix @ kit.vector, 0.0), self._weights(len(q))

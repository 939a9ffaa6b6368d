"""Whether the parts are sought or given: the ways in which the stages treat a kit.

A sought kit follows the elements and is optimised; a given one (projection onto a kit that exists)
stays as it is, and only the assignment changes; of a stock there are no more pieces than it has.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from ..kit.cluster import cluster
from ..kit.groups import ElementGroup
from ..kit.parts import Assignment, Kit
from ..kit.projection import Projection, ProjectionHessian, ProjectionMinimum
from ..kit.stock import Numbers, Stock
from ..sqp.problem import LiftedTerm
from .settings import StageSettings


class KitRule(Protocol):
    """What the stages ask of a kit.

    parts_move : whether the parts are variables
    stock : pieces of which the elements have to be made, None where these can be made
    """

    @property
    def parts_move(self) -> bool: ...

    @property
    def stock(self) -> Stock | None: ...

    @property
    def sizes(self) -> Mapping[str, int]:
        """Kind -> number of parts."""

    def first(
        self,
        groups: list[ElementGroup],
        q: np.ndarray,
        projection: Projection,
        settings: StageSettings,
    ) -> tuple[Kit, Assignment]:
        """The kit that the stages begin with, and which of its parts serves which element.

        groups : the elements; q : (n_q,) their parameters
        """

    def nearest(self, projection: Projection, q: np.ndarray, kit: Kit) -> ProjectionMinimum:
        """Kit and assignment that are nearest to q (n_q,), near a kit."""

    def model(self, hessian: ProjectionHessian) -> tuple[sp.csc_matrix | None, LiftedTerm | None]:
        """The projection energy's second derivatives: what adds to the elements' own Hessian
        (n_q, n_q), and what is kept apart with the parts as further unknowns; None for nothing."""

    def growth(self, settings: StageSettings) -> int:
        """How often the kit may get one part more of every kind, where nothing else helps."""


@dataclass(frozen=True)
class SoughtKit:
    """A kit of so many parts a kind, which is to be found."""

    sizes: Mapping[str, int]
    parts_move = True
    stock = None

    def first(
        self,
        groups: list[ElementGroup],
        q: np.ndarray,
        projection: Projection,
        settings: StageSettings,
    ) -> tuple[Kit, Assignment]:
        found = cluster(
            groups,
            q,
            self.sizes,
            bounds=settings.bounds,
            restarts=settings.restarts,
            seed=settings.seed,
            penalties=projection.penalties,
        )
        return found.kit, found.assignment

    def nearest(self, projection: Projection, q: np.ndarray, kit: Kit) -> ProjectionMinimum:
        return projection.minimise(q, kit)

    def model(self, hessian: ProjectionHessian) -> tuple[None, LiftedTerm]:
        used = np.flatnonzero(hessian.pp.diagonal() > 0)  # a side that no element uses has no say
        return None, LiftedTerm(
            sp.csc_matrix(hessian.qq),
            sp.csc_matrix(sp.csc_matrix(hessian.qp)[:, used]),
            sp.csc_matrix(sp.csc_matrix(hessian.pp)[used][:, used]),
        )

    def growth(self, settings: StageSettings) -> int:
        return settings.growth


@dataclass(frozen=True)
class GivenKit:
    """A kit that exists, whose parts stay as they are."""

    kit: Kit
    parts_move = False
    stock: Stock | None = None

    @property
    def sizes(self) -> Mapping[str, int]:
        return self.kit.sizes

    def first(
        self,
        groups: list[ElementGroup],
        q: np.ndarray,
        projection: Projection,
        settings: StageSettings,
    ) -> tuple[Kit, Assignment]:
        return self.kit, self.nearest(projection, q, self.kit).assignment

    def nearest(self, projection: Projection, q: np.ndarray, kit: Kit) -> ProjectionMinimum:
        return projection.assign(q, kit)

    def model(self, hessian: ProjectionHessian) -> tuple[sp.csc_matrix, None]:
        return sp.csc_matrix(hessian.qq), None

    def growth(self, settings: StageSettings) -> int:
        return 0


@dataclass(frozen=True)
class GivenStock(GivenKit):
    """Parts that exist in limited numbers.

    design_of : (n_groups,) the design that each group of elements belongs to
    """

    design_of: tuple[int, ...] = ()

    def nearest(self, projection: Projection, q: np.ndarray, kit: Kit) -> ProjectionMinimum:
        assert self.stock is not None
        assignment = self.stock.assign(projection.groups, q, self.design_of)
        return ProjectionMinimum(kit, assignment, projection.energy(q, kit, assignment))


def rule_of(parts: Mapping[str, int] | Kit | Stock, design_of: Numbers) -> KitRule:
    """The rule for numbers of parts a kind, for a kit, or for a stock.

    design_of : (n_groups,) the design that each group of elements belongs to
    """
    if isinstance(parts, Stock):
        return GivenStock(parts.kit, parts, tuple(int(n) for n in design_of))
    return GivenKit(parts) if isinstance(parts, Kit) else SoughtKit(dict(parts))

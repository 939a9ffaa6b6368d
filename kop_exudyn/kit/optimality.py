"""How far a clustering is from the best one of as many parts: its energy, and a proven bound.

For kinds of one parameter (angles) the best clustering is known exactly (intervals.py). For others
no clustering is below the bound of dual_bound.py. Both hold for the elements that they are
computed for. They say nothing of the designs that are built from the parts: a kit of a larger
projection energy may well build better ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .dual_bound import lower_bound
from .elements import KindElements, Penalties, collect
from .groups import ElementGroup
from .intervals import optimal_centres
from .kinds import Bounds
from .parts import Kit
from .pricing import Pricing

# of the bundle method, for parts that realise intervals: their pricing takes ten times as long
_INTERVAL_STEPS = 10


@dataclass(frozen=True)
class ClusteringGap:
    """One kind's projection energy at weight 1, and what no clustering of as many parts is below.

    energy, bound : dimensionless, see `KindElements.energy`
    exact : whether the bound is the energy of the best clustering itself
    """

    energy: float
    bound: float
    exact: bool

    @property
    def gap_percent(self) -> float:
        """By how much the energy is at most above the best one, in % of itself."""
        return 100 * (1 - self.bound / self.energy) if self.energy > 0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """As result.json has it."""
        return {
            "energy": self.energy,
            "bound": self.bound,
            "gap_percent": self.gap_percent,
            "exact": self.exact,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> ClusteringGap:
        """What `to_dict` wrote."""
        return cls(data["energy"], data["bound"], data["exact"])


def clustering_gaps(
    groups: Sequence[ElementGroup],
    q: np.ndarray,
    kit: Kit,
    *,
    bounds: Bounds | None = None,
    penalties: Penalties | None = None,
) -> dict[str, ClusteringGap]:
    """By kind: how far the kit is from the best clustering of the elements into as many parts.

    q : (n_q,) parameters that the groups index
    bounds, penalties : those of the kit, as for `cluster`
    """
    return {
        name: _gap(elements, kit[name], elements.kind.bounds(bounds))
        for name, elements in collect(groups, q, penalties=penalties).items()
    }


def _gap(
    elements: KindElements, parts: np.ndarray, limits: tuple[np.ndarray, np.ndarray]
) -> ClusteringGap:
    energy = elements.energy(parts, elements.nearest(parts))
    unit = 2 * elements.n  # from energies to sums of squares in units of the scale
    numbers = elements.numbers
    if numbers is not None:
        lower, upper = (float(limit[0]) for limit in limits)
        least = optimal_centres(numbers, len(parts), lower, upper)[1] / elements.scale**2
        return ClusteringGap(energy, min(least / unit, energy), True)
    pricing = Pricing.of(elements, len(parts), limits)
    steps = {} if elements.exact else {"most_steps": _INTERVAL_STEPS}
    found = lower_bound(pricing, parts / elements.scale, **steps)
    return ClusteringGap(energy, min(found.bound / unit, energy), False)

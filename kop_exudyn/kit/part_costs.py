"""What parameters of parts cost in the objective, such as the length of slits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .elements import Penalties, collect
from .groups import ElementGroup
from .kinds import part_kind
from .parts import Kit


@dataclass(frozen=True)
class PartCosts:
    """1/2 sum over kinds of w . mean over its parts of p^2: what J rises by for a kit.

    weights : kind -> (k_p,) w; kinds whose parts cost nothing are left out
    penalties : kind -> (k_p,) the same in the units of the projection energy, where w_c is 1
    """

    weights: Mapping[str, np.ndarray] = field(default_factory=dict)
    penalties: Mapping[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def of(cls, groups: Sequence[ElementGroup], q: np.ndarray, price: float) -> PartCosts:
        """The costs of kinds that have a penalty.

        groups, q : the input elements, whose median size is what parameters are relative to
        price : of a parameter as large as that, for all parts of a kind, times two; it is shared
            among parameters as their kind's penalty is
        """
        weights, penalties = {}, {}
        for name, elements in collect(groups, q).items():
            own = part_kind(name).penalty
            if own is not None and own.any():
                penalties[name] = price * own / own.max()
                weights[name] = penalties[name] / elements.scale**2
        return cls(weights, penalties)

    def curvature(self, kit: Kit) -> np.ndarray:
        """(n_p,) second derivatives; the first ones are these times the kit's vector."""
        rows = [
            np.broadcast_to(self.weights.get(name, 0.0) / len(parts), parts.shape).ravel()
            for name, parts in kit.parts.items()
        ]
        return np.concatenate(rows)

    def value(self, kit: Kit) -> float:
        """What a kit costs."""
        if not self.weights:
            return 0.0
        return 0.5 * float(self.curvature(kit) @ kit.vector**2)

    def at_weight(self, weight: float) -> Penalties | None:
        """The penalties of a projection energy of that w_c, which come to these costs; None where
        there are none."""
        if not self.weights:
            return None
        return {name: tuple((own / weight).tolist()) for name, own in self.penalties.items()}

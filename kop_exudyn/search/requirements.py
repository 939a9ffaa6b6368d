"""What every design of a kit has to meet, whatever it costs in fidelity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError


@dataclass(frozen=True)
class Requirements:
    """What makes a design buildable; each can be switched off, to see what it costs.

    opening : every design opens by itself: the state that is judged is the one that its assembly
        leads to along the way of `Design.stations`, without a snap
    stress : the equivalent stress stays below the elastic limit in all states that a builder sees
    safety : factor by which the elastic limit is divided
    penalty : weight of a bound's excess (utilisation beyond 1), as a share of the fit's weight:
        at first 1 % of excess counts as much as a deviation of 1 % of the size at every joint

    Raises InputError.
    """

    opening: bool = True
    stress: bool = True
    safety: float = 1.0
    penalty: float = 0.01

    def __post_init__(self) -> None:
        for name in ("opening", "stress"):
            if not isinstance(getattr(self, name), bool):
                raise InputError("must be true or false", field=name, value=getattr(self, name))
        for name in ("safety", "penalty"):
            value = getattr(self, name)
            number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if not (number and np.isfinite(value) and value > 0):
                raise InputError("must be a positive number", field=name, value=value)

    @classmethod
    def none(cls) -> Requirements:
        """Nothing is required: the baselines are made so."""
        return cls(opening=False, stress=False)

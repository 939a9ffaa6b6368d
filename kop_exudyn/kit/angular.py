"""Angular parts: corners between two straight beams. Elements have signed angles, parts unsigned
ones."""

from __future__ import annotations

import numpy as np

from .kinds import PartKind, Variants, register_kind

ANGULAR = register_kind(
    PartKind(
        name="angular",
        parameter_names=("angle",),
        variants={1: Variants.of(("as is", "flipped"), [[[1]], [[-1]]])},
        canonical=np.abs,
        lower=np.zeros(1),
        upper=np.full(1, np.pi),
        angular=True,
    )
)

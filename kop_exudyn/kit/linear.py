"""Linear parts: straight beams with a joint, one length to either side of it, from corner to
corner."""

from __future__ import annotations

import numpy as np

from .kinds import PartKind, Variants, register_kind

LINEAR = register_kind(
    PartKind(
        name="linear",
        parameter_names=("l1", "l2"),
        variants={
            2: Variants.of(("as is", "mirrored"), [[[1, 0], [0, 1]], [[0, 1], [1, 0]]]),
            # The element at a rod's end has a corner on one side of its joint only: it uses either
            # side of a part.
            1: Variants.of(("side 1", "side 2"), [[[1, 0]], [[0, 1]]]),
        },
        canonical=lambda parts: np.sort(parts, axis=1),
        lower=np.zeros(2),
        upper=np.full(2, np.inf),
    )
)

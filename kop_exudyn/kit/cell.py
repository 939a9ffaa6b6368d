"""Umbrella cells: the lengths of their top and bottom arms; mirrored, the two change places."""

from __future__ import annotations

import numpy as np

from .kinds import PartKind, Variants, register_kind

CELL = register_kind(
    PartKind(
        name="cell",
        parameter_names=("top", "bottom"),
        variants={2: Variants.of(("as is", "mirrored"), [[[1, 0], [0, 1]], [[0, 1], [1, 0]]])},
        canonical=lambda parts: np.sort(parts, axis=1),
        lower=np.zeros(2),
        upper=np.full(2, np.inf),
    )
)

"""Linear parts with slit ends: a joint may sit anywhere along a slit, so a part realises an
interval of lengths.

The part (l1, l2, s) realises every length in [l1, l1 + s] on one side and in [l2, l2 + s] on the
other. Without a cost slits would grow until one part served all, hence the penalty on s
(`penalties` of the clustering and the projection sets another). A kit that has slit parts and no
linear ones makes the linear elements of them; designs may also ask for them by giving elements the
kind "slit".

A slit takes strength along its length as a bolt's hole does at its place, and stiffness that a
rod of one section doesn't lose: it may be half as long as the side that is left of its piece.
"""

from __future__ import annotations

import numpy as np

from .kinds import PartKind, Variants, register_kind

_SIDE_1, _SIDE_2, _SLIT = [1, 0, 0], [0, 1, 0], [0, 0, 1]
_SHARE = 0.5  # of either side without its slit, at most


def _sorted_sides(parts: np.ndarray) -> np.ndarray:
    return np.column_stack([np.sort(parts[:, :2], axis=1), parts[:, 2]])


SLIT = register_kind(
    PartKind(
        name="slit",
        parameter_names=("l1", "l2", "slit"),
        variants={
            2: Variants.of(
                ("as is", "mirrored"),
                [[_SIDE_1, _SIDE_2], [_SIDE_2, _SIDE_1]],
                [[_SLIT, _SLIT]] * 2,
            ),
            1: Variants.of(("side 1", "side 2"), [[_SIDE_1], [_SIDE_2]], [[_SLIT]] * 2),
        },
        canonical=_sorted_sides,
        lower=np.zeros(3),
        upper=np.full(3, np.inf),
        penalty=np.array([0.0, 0.0, 0.05]),
        limits=np.array([[-_SHARE, 0.0, 1.0], [0.0, -_SHARE, 1.0]]),
        serves="linear",
    )
)

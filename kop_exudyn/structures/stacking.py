"""The elements of several designs as one list, as a kit sees them: design by design."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..kit.groups import ElementGroup
from .base import Design


def parameter_offsets(designs: Sequence[Design]) -> np.ndarray:
    """(n_designs + 1,) where each design's parameters start in the vector of all."""
    return np.cumsum([0, *(len(design.parameters) for design in designs)])


def stacked_groups(designs: Sequence[Design]) -> list[ElementGroup]:
    """All groups of elements, indexing the vector of all parameters."""
    return [
        group.shifted(offset)
        for design, offset in zip(designs, parameter_offsets(designs))
        for group in design.groups
    ]


def stacked_parameters(designs: Sequence[Design]) -> np.ndarray:
    """(n_q,) the parameters of all designs."""
    return np.concatenate([design.parameters for design in designs])


def group_designs(designs: Sequence[Design]) -> np.ndarray:
    """(n_groups,) the place of each group's design among the designs."""
    return np.repeat(np.arange(len(designs)), [len(design.groups) for design in designs])

"""The rod element by the compiled kernel alone; scenes are assembled by it, many at once."""

from __future__ import annotations

import numpy as np

from kop_exudyn.compiled.library import address, library


def evaluate_compiled(x0, R0, x1, R1, lengths, stiffness, rest_strain, stress=None):
    """What `kop_exudyn.rods.element.evaluate` gives, with its parameters."""
    n = len(lengths)
    given = [
        np.ascontiguousarray(a, float) for a in (x0, R0, x1, R1, lengths, stiffness, rest_strain)
    ]
    sizes = ((n,), (n, 12), (n, 12, 12), (n, 6), (n, 6, 12))
    out = tuple(np.empty(size) for size in sizes)
    stress = None if stress is None else np.ascontiguousarray(stress, float)
    shapes = ((n, 3), (n, 3, 3), (n, 3), (n, 3, 3), (n,), (n, 6), (n, 6))
    library().evaluate_elements(
        n,
        *[address(array, np.float64, shape) for array, shape in zip(given, shapes)],
        None if stress is None else address(stress, np.float64, (n, 6)),
        *map(address, out),
    )
    return out

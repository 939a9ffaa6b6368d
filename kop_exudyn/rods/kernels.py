"""How the compiled kernels of rods and scenes are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba as nb

# the last one is not among numba's documented options, but as old as its reference counts
_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "_nrt": False}


def kernel(function: Callable | None = None, **options: Any) -> Any:
    """Decorator for loops over elements: `numba.njit` without reference counts and without tests of
    divisors.

    Every view of a row, as in `K[e]`, would count references, which took two fifths of the
    assembly's time. The arrays are the caller's, who keeps them; so a kernel can't make any, which
    numba complains of. A division by zero gives infinity or NaN, which the solver's safeguards see,
    and no exception in the middle of a solve.

    options : further ones of `numba.njit`
    """
    return nb.njit(function, **_OPTIONS, **options)

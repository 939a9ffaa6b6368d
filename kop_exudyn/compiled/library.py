"""The compiled kernels, found or made at first use."""

from __future__ import annotations

import ctypes
import logging
import os
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from .build import BUILT, BuildError, build, file_name

log = logging.getLogger(__name__)

OFF = "KOP_COMPILED"  # set to 0, this variable of the environment turns the kernels off


@cache
def library() -> ctypes.CDLL | None:
    """The kernels, or None where they are turned off or can't be made: callers then use NumPy."""
    if os.environ.get(OFF) == "0":
        return None
    folders = (BUILT, _user_folder())
    for folder in folders:
        if (folder / file_name()).is_file():
            return _load(folder / file_name())
    log.warning("first run: compiling the kernels, once on this machine")
    reason = ""
    for folder in folders:
        try:
            return _load(build(folder))
        except BuildError as error:
            reason = str(error)
    log.warning("no compiled kernels, so that NumPy is used, which is slower: %s", reason)
    return None


_START: Any = ctypes.c_char * 0  # of a buffer


def address(
    array: np.ndarray, kind: type = np.float64, shape: tuple[int, ...] | None = None
) -> int:
    """Where a contiguous array's numbers begin. Raises TypeError for other arrays and ValueError
    for another shape than the one given: the kernels would read or write what isn't there."""
    if shape is not None and array.shape != shape:
        raise ValueError(f"expected an array of shape {shape}, got {array.shape}")
    if array.dtype != kind or not array.flags.c_contiguous:
        raise TypeError(f"expected a contiguous array of {np.dtype(kind)}, got {array.dtype}")
    if array.flags.writeable and array.size:
        # five times as fast, which tells: small scenes call kernels as often as they compute
        return ctypes.addressof(_START.from_buffer(array))
    return array.ctypes.data


def _load(file: Path) -> ctypes.CDLL | None:
    try:
        found = ctypes.CDLL(str(file))
    except OSError as error:  # made for another system
        log.warning("%s can't be loaded, so that NumPy is used: %s", file.name, error)
        return None
    pointer, integer, count = ctypes.c_void_p, ctypes.c_int, ctypes.c_int64
    for name, result, arguments in (
        ("rotation_vectors", None, (count, pointer, pointer)),
        ("rotation_matrices", None, (count, pointer, pointer)),
        ("compose_increments", None, (count, pointer, pointer, pointer)),
        ("evaluate_elements", None, (count, *[pointer] * 13)),
        ("assemble_rods", None, (pointer, integer, integer, *[pointer] * 5)),
        ("scatter_blocks", None, (count, count, *[pointer] * 6)),
        ("predict_stress", None, (*[pointer] * 4,)),
        ("largest_forces", None, (*[pointer] * 3,)),
        ("factorise", integer, (*[pointer] * 4, count)),
        ("solve", None, (*[pointer] * 5,)),
        ("solve_columns", integer, (*[pointer] * 3, count, *[pointer] * 3, count, *[pointer] * 4)),
        ("multiply_blocks", None, (count, *[pointer] * 3, count, count, *[pointer] * 2)),
        ("actuate", ctypes.c_double, (count, *[pointer] * 9)),
        ("rasterise", None, (count, *[pointer] * 3, count, count, *[pointer] * 2)),
        (
            "descend",
            count,
            (count, count, count, count, *[pointer] * 6, ctypes.c_double, count, pointer),
        ),
        ("served_by_parts", None, (*[count] * 6, *[pointer] * 9)),
        ("most_in_boxes", None, (*[count] * 6, *[pointer] * 10)),
    ):
        function = getattr(found, name)
        function.restype, function.argtypes = result, arguments
    return found


def _user_folder() -> Path:
    """Where libraries go when the package's own folder can't be written."""
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    return (Path(base) if base else Path.home() / ".cache") / "kop_exudyn"

"""What a result was computed with: versions and machine, without the name of either user or
host."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from .. import __version__
from ..compiled.build import instruction_set
from ..compiled.library import library
from ..search import memory

# the packages whose versions can change numbers
_PACKAGES = ("exudyn", "numpy", "scipy", "qdldl", "osqp", "piqp", "libigl")


def environment() -> dict[str, Any]:
    """Versions of this package, Python and the numerical libraries; system, processor type, usable
    cores."""
    return {
        "kop_exudyn": __version__,
        "python": platform.python_version(),
        **{name: found for name in _PACKAGES if (found := _version(name)) is not None},
        "kernels": "NumPy" if library() is None else f"compiled, {instruction_set() or 'plain'}",
        "system": platform.system(),
        "processor": platform.machine(),
        "cores": usable_cores(),
    }


def usable_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def peak_memory_mb() -> float:
    """Largest memory of this process plus that of its largest ended subprocess, MB; 0 where the
    system doesn't tell."""
    return memory.peak_memory_mb() + memory.peak_memory_mb(of_ended_children=True)

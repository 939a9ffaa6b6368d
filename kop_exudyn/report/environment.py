"""What a result was computed with: versions and machine, without the name of either user or
host."""

from __future__ import annotations

import platform
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from ..compiled.build import instruction_set
from ..compiled.library import library
from ..provenance import __version__, code_digest, commit, memory_gb, processor, usable_cores
from ..search import memory

# the packages whose versions can change numbers
_PACKAGES = ("exudyn", "numpy", "scipy", "qdldl", "osqp", "piqp", "libigl")


def environment() -> dict[str, Any]:
    """Versions of this package, Python and the numerical libraries; digest of the code, commit and
    date; system, processor, usable cores and memory."""
    return {
        "kop_exudyn": __version__,
        "python": platform.python_version(),
        **{name: found for name in _PACKAGES if (found := _version(name)) is not None},
        "kernels": "NumPy" if library() is None else f"compiled, {instruction_set() or 'plain'}",
        "code": code_digest(),
        "commit": commit(),
        "date": date.today().isoformat(),
        "system": platform.system(),
        "processor": processor(),
        "cores": usable_cores(),
        "memory, GB": memory_gb(),
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def peak_memory_mb() -> float:
    """Largest memory of this process plus that of its largest ended subprocess, MB; 0 where the
    system doesn't tell."""
    return memory.peak_memory_mb() + memory.peak_memory_mb(of_ended_children=True)

"""Compiled kernels on disk, which numba keeps beside their sources.

Numba compiles a kernel anew when its own file changes, but not when a function changes that it
calls from another file. After an update of the sources it would go on with the old function.
"""

from __future__ import annotations

import time
from pathlib import Path

_KERNELS = ("njit", "@kernel")  # what a source with kernels says
_COMPILED = ("*.nbi", "*.nbc")


def drop_stale_kernels(package: Path) -> int:
    """Remove what was compiled before the newest file with kernels was written; returns how many
    files that were."""
    sources = [file for file in package.rglob("*.py") if _has_kernels(file)]
    newest = min(max((file.stat().st_mtime for file in sources), default=0.0), time.time())
    dropped = 0
    for folder in {file.parent / "__pycache__" for file in sources}:
        for pattern in _COMPILED:
            for compiled in folder.glob(pattern):
                try:
                    if compiled.stat().st_mtime < newest:
                        compiled.unlink()
                        dropped += 1
                except OSError:  # another process was quicker, or may do what this one may not
                    pass
    return dropped


def _has_kernels(source: Path) -> bool:
    text = source.read_text(encoding="utf-8")
    return any(word in text for word in _KERNELS)

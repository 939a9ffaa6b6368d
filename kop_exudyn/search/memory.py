"""How much memory a process has taken at most."""

from __future__ import annotations

import platform


def peak_memory_mb(of_ended_children: bool = False) -> float:
    """Largest resident memory of this process, or of its largest ended subprocess; MB, 0 where the
    system can't tell."""
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    unit = 1 if platform.system() == "Darwin" else 1024  # bytes there, else kilobytes
    who = resource.RUSAGE_CHILDREN if of_ended_children else resource.RUSAGE_SELF
    return resource.getrusage(who).ru_maxrss * unit / 2**20

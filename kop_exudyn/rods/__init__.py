"""One rod: rotations and rigid motions, cross-sections and materials, the element kernel."""

from pathlib import Path

from .kernel_cache import drop_stale_kernels

drop_stale_kernels(Path(__file__).parents[1])  # before any kernel is loaded

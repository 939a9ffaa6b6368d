"""Which assembly a scene's rods get."""

from __future__ import annotations

from ..compiled.library import library
from .assembly import RodAssembly
from .assembly_compiled import CompiledAssembly
from .scene import Scene
from .sparsity import Sparsity


def rod_assembly(scene: Scene, sparsity: Sparsity) -> RodAssembly:
    """The rods of a scene, compiled where there are kernels."""
    if library() is None:
        from .assembly_numpy import NumpyAssembly

        return NumpyAssembly(scene, sparsity)
    return CompiledAssembly(scene, sparsity)

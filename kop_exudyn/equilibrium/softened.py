"""A start for hopeless cases: the equilibrium of the same scene with rods that give way along their
axis.

Slender rods resist stretching 1e3 to 1e9 times more than bending. From a start far off, iterations
then follow the narrow valleys of the stretch-stiff energy, or end where an element turns by pi and
its strain is no longer defined. With stiffnesses against stretch and shear near those against
bending the landscape is benign, and its equilibrium is so near to the true one that a few
iterations lead there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..scene.scene import Scene

# Largest stretch and shear stiffness, as a multiple of an element's EI / L^2.
_LARGEST = 100.0


def softened(scene: Scene, q: np.ndarray) -> Scene:
    """The scene with its stiffnesses against stretch and shear limited, for rest lengths at q."""
    limit = _LARGEST * scene.stiffness[:, 4:].max(axis=1) / scene.rest_lengths(q) ** 2
    stiffness = scene.stiffness.copy()
    stiffness[:, :3] = np.minimum(stiffness[:, :3], limit[:, None])
    return replace(scene, stiffness=stiffness)

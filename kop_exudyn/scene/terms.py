"""What acts on a scene besides its rods: loads, springs, actuators, limits."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from .state import State


class SceneTerm(Protocol):
    """A sum of m energies (or forces without potential), each of a few unknowns of the scene.

    A term of one's own subclasses this and is given to `SceneBuilder.term` or `Scene.with_terms`.

    dofs : (m, k) the unknowns that each summand depends on, numbered as in `Scene`
    conservative : whether `energy` is the potential of the forces in `gradient_hessian`
    """

    dofs: np.ndarray
    conservative: bool = True

    def energy(self, state: State) -> float:
        """The potential at a state, summed; 0 where there is none."""
        ...

    def gradient_hessian(self, state: State) -> tuple[float, np.ndarray, np.ndarray]:
        """The energy, gradients (m, k) and symmetric Hessians (m, k, k), in increments of a body's
        position (global axes) and rotation (body axes), and of hinge angles."""
        ...

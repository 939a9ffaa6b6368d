"""What tests ask of states and systems, and the package itself never does."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from kop_exudyn.equilibrium.equilibria import Equilibrium
from kop_exudyn.equilibrium.system import System
from kop_exudyn.rods.rotations import log_so3
from kop_exudyn.scene.state import State


def increment(state: State, other: State) -> np.ndarray:
    """(6 n_bodies + n_hinges,) what moves a state to another one: the inverse of `State.moved`."""
    turn = log_so3(np.swapaxes(state.rotations, 1, 2) @ other.rotations)
    pose = np.concatenate([other.positions - state.positions, turn], axis=1)
    return np.concatenate([pose.ravel(), other.angles - state.angles])


def stiffness_matrix(system: System, equilibrium: Equilibrium | None = None) -> np.ndarray:
    """(n_free, n_free) the whole symmetric Hessian.

    equilibrium : where it is taken; default: whatever state was assembled last
    """
    if equilibrium is not None:
        system.linearise(equilibrium.state, equilibrium.q)
    upper = system.sparsity.free_matrix(system.values)
    return (upper + sp.triu(upper, 1).T).toarray()

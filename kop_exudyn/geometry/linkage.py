"""A network's laths as rigid bodies in their plane, pinned to each other at the joints: which of
them can move without bending.

A scissor net of straight laths has one such motion, in which all hinges turn: its opening. Nets of
curved laths mostly have none. What must not be is a motion of a part alone, a lath that dangles
from one joint, say, or a square beside the rest: it costs no energy, so that no equilibrium tells
where that part is, and a prescribed mean of all angles may be met by spinning it alone.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..errors import InputError
from ..wording import counted
from .network import CurveNetwork

_FREE = 1e-12  # of the largest eigenvalue of the constraints: round-off in the joints' places
_NAMED = 3  # joints, by their places
_STILL = 1e-5  # of the largest turn: hinges that don't take part in a motion


def free_turns(network: CurveNetwork) -> np.ndarray:
    """Rates (n_joints, m) at which the hinges turn in the m independent motions, rigid ones left
    out, that need no bending.

    The laths' motions (x, y, turn) that keep each joint's two points together are the null space of
    the pin constraints.
    """
    n, m = len(network.strands), network.n_joints
    rows, arms = np.arange(m), (network.joints - network.joints.mean(axis=0)) / network.size
    pins = np.zeros((2, m, 3 * n))
    for lath, sign in zip(network.pairs.T, (1.0, -1.0)):
        pins[0, rows, 3 * lath] = pins[1, rows, 3 * lath + 1] = sign
        pins[0, rows, 3 * lath + 2] = -sign * arms[:, 1]
        pins[1, rows, 3 * lath + 2] = sign * arms[:, 0]
    rigidity = pins.reshape(2 * m, 3 * n)
    values, vectors = np.linalg.eigh(rigidity.T @ rigidity)
    motions = vectors[:, values <= _FREE * values[-1]]
    first, second = network.pairs.T
    turns = motions[3 * second + 2] - motions[3 * first + 2]
    left, sizes, _ = np.linalg.svd(turns, full_matrices=False)
    return left[:, sizes > np.sqrt(_FREE)]


def refuse_loose_parts(network: CurveNetwork) -> None:
    """Raise InputError, naming the curves, where a part of the network moves without the rest."""
    turns = free_turns(network)
    if not turns.shape[1]:
        return
    if turns.shape[1] == 1:
        moving = np.abs(turns[:, 0]) > _STILL * np.abs(turns).max()
        if moving.all():
            return
    else:
        # of the motions that keep the mean angle, the one of the fewest hinges
        moving = _smallest_motion(turns)
    named = _beside_the_rest(network, moving)
    fields = [network.strands[k].curve.field.removesuffix(".points") for k in named[:4]]
    more = f" and {len(named) - 4} more" if len(named) > 4 else ""
    joints = network.joints[moving]
    others = len(joints) - _NAMED
    beside = f" and {counted(others, 'joint')} more" if others > 0 else ""
    verb = "turns" if len(named) == 1 else "move"
    raise InputError(
        f"{verb} about {{place}}{beside} without the rest of the net, at no resistance: hold it by "
        "a second joint, or leave it out",
        field=", ".join(fields) + more,
        places=joints[:_NAMED],
    )


def _beside_the_rest(network: CurveNetwork, moving: np.ndarray) -> np.ndarray:
    """The laths (k,) that the moving hinges part from the most others."""
    n, pairs = len(network.strands), network.pairs[~moving]
    held = coo_array((np.ones(len(pairs)), pairs.T), shape=(n, n))
    _, part = connected_components(held, directed=False)
    return np.flatnonzero(part != np.argmax(np.bincount(part)))


def _smallest_motion(turns: np.ndarray) -> np.ndarray:
    """Which hinges (n_joints,) turn in the most local one of several motions: each hinge in turn is
    asked for the motion in which it turns most, and that of the fewest hinges is taken."""
    shares = turns @ turns.T  # column k: the motion that turns hinge k most
    turning = np.abs(shares) > _STILL * np.abs(np.diag(shares)).max()
    counts = np.where(turning.any(axis=0), turning.sum(axis=0), len(turns) + 1)
    return turning[:, int(np.argmin(counts))]

"""Which joints are connected by rods."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ..arrays import Indices
from ..scene.scene import Scene


def joint_links(scene: Scene, joints: Indices) -> Indices:
    """(m, 2) joints between which rods run, straight or by way of corners: of bodies that are no
    joints, those that hang together connect two joints where they touch no others.

    joints : (n_joints,) their bodies
    """
    number = np.full(scene.n_bodies, -1)
    number[joints] = np.arange(len(joints))
    ends = [scene.node_body[chain.nodes[[0, -1]]] for chain in scene.chains]
    pairs = np.array(ends, int).reshape(-1, 2)
    is_joint = number[pairs] >= 0
    between = pairs[~is_joint.any(axis=1)]
    graph = sp.coo_array(
        (np.ones(len(between)), (between[:, 0], between[:, 1])), shape=(scene.n_bodies,) * 2
    )
    labels = connected_components(graph, directed=False)[1]
    touched: dict[int, set[int]] = {}
    for (a, b), (first, second) in zip(pairs.tolist(), is_joint.tolist()):
        if first != second:
            joint, other = (a, b) if first else (b, a)
            touched.setdefault(int(labels[other]), set()).add(int(number[joint]))
    found = {tuple(sorted(two)) for two in touched.values() if len(two) == 2}
    found |= {tuple(sorted(pair)) for pair in number[pairs[is_joint.all(axis=1)]].tolist()}
    return np.array(sorted(found), int).reshape(-1, 2)

"""How a scene is laid out for Exudyn: which nodes it needs, who carries whom, where each rod lies
unstressed.

Exudyn's beam takes its stress-free shape from the nodes' reference coordinates. So connected pieces
are laid out along a spanning tree, each element's nodes one rest length (and rest curvature) apart;
where an element would close a loop, its end gets a node of its own, tied rigidly to the other one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..rods.rotations import exp_se3, log_so3
from ..scene.scene import Scene


@dataclass(frozen=True)
class Carrier:
    """The item that represents one frame: a body (hinge -1), or what turns with one of its hinges,
    at its centre.

    node : Exudyn node
    frame (3, 3) : the node's axes in the frame's axes
    rigid : whether the node belongs to an added rigid body (needed where rods or hinges sit off the
        frame's origin)
    """

    body: int
    hinge: int
    node: int
    frame: np.ndarray
    rigid: bool


@dataclass(frozen=True)
class Layout:
    """Exudyn nodes and their ties.

    n_nodes : beam nodes, then nodes of added rigid bodies
    element_nodes (E, 2) : Exudyn nodes of every element
    scene_node (n_nodes,) : the scene node that each one represents, -1 for added rigid bodies
    carriers : by (body, hinge)
    ties : (carrier key, node, frame (3, 3), offset (3,)) rigid attachments of further nodes to a
        frame
    levels : elements in spanning order, those of one array independent of each other
    """

    n_nodes: int
    element_nodes: np.ndarray
    scene_node: np.ndarray
    carriers: dict[tuple[int, int], Carrier]
    ties: list[tuple[tuple[int, int], int, np.ndarray, np.ndarray]]
    levels: list[np.ndarray]

    @cached_property
    def carrier_arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """All carriers: bodies, hinges (-1: the body itself), nodes (n,) and frames (n, 3, 3)."""
        items = list(self.carriers.values())
        bodies, hinges, nodes = (
            np.array([(c.body, c.hinge, c.node) for c in items], int).reshape(-1, 3).T
        )
        return bodies, hinges, nodes, np.array([c.frame for c in items]).reshape(-1, 3, 3)

    def reference_coordinates(self, scene: Scene, lengths: np.ndarray) -> np.ndarray:
        """(n_nodes, 6) positions and rotation vectors in which every rod is unstressed."""
        p, turn = exp_se3(lengths[:, None] * scene.rest_strain)
        x = np.zeros((self.n_nodes, 3))
        R = np.tile(np.eye(3), (self.n_nodes, 1, 1))
        for elements in self.levels:
            tail, head = self.element_nodes[elements].T
            x[head] = x[tail] + np.einsum("nij,nj->ni", R[tail], p[elements])
            R[head] = R[tail] @ turn[elements]
        return np.concatenate([x, log_so3(R)], axis=1)


def layout_of(scene: Scene) -> Layout:
    """Plan the Exudyn nodes of a scene."""
    unique, node_of = _merge_coincident(scene)
    element_nodes = node_of[scene.elements]
    scene_node = unique.tolist()
    levels, element_nodes = _span(element_nodes, len(unique), scene_node)
    frames: dict[tuple[int, int], list[int]] = {}
    of_nodes = zip(scene.node_body[scene_node].tolist(), scene.node_hinge[scene_node].tolist())
    for node, key in enumerate(of_nodes):
        frames.setdefault(key, []).append(node)
    for body in range(scene.n_bodies):
        frames.setdefault((body, -1), [])
    carriers, ties = {}, []
    eccentric = {
        int(scene.node_body[n])
        for n in np.flatnonzero(scene.node_hinge >= 0)
        if scene.hinge_centre[scene.node_hinge[n]].any()
    }
    count = len(scene_node)
    offset = np.any(scene.node_offset != 0, axis=1)
    for key, nodes in sorted(frames.items()):
        origins = [scene_node[n] for n in nodes]
        centred = [n for n, o in zip(nodes, origins) if not offset[o]]
        plain = len(centred) == len(nodes) and not (key[1] < 0 and key[0] in eccentric)
        if centred and plain:
            carriers[key] = Carrier(
                *key, centred[0], scene.node_frame[scene_node[centred[0]]], False
            )
        else:
            carriers[key] = Carrier(*key, count, np.eye(3), True)
            count += 1
        ties += [
            (key, n, scene.node_frame[o], scene.node_offset[o])
            for n, o in zip(nodes, origins)
            if n != carriers[key].node
        ]
    added = count - len(scene_node)
    return Layout(count, element_nodes, np.array(scene_node + [-1] * added), carriers, ties, levels)


def _merge_coincident(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Scene nodes with the same body, hinge, frame and offset are one Exudyn node; those without
    rods are left out.

    Returns one scene node (m,) of each Exudyn node, and the Exudyn node (N,) of every scene node
    (-1: none).
    """
    used = np.unique(scene.elements)
    table = np.concatenate(
        [
            scene.node_body[:, None],
            scene.node_hinge[:, None],
            scene.node_frame.reshape(-1, 9),
            scene.node_offset,
        ],
        axis=1,
    )
    _, first, inverse = np.unique(table[used], axis=0, return_index=True, return_inverse=True)
    node_of = np.full(len(table), -1)
    node_of[used] = inverse.ravel()
    return used[first], node_of


def _span(
    element_nodes: np.ndarray, n_nodes: int, scene_node: list[int]
) -> tuple[list[np.ndarray], np.ndarray]:
    """Order the elements along a forest, tail before head; returns levels and the (changed) element
    nodes.

    A node that is already some element's head, or that would close a loop, is doubled: appended to
    scene_node.
    """
    element_nodes = element_nodes.copy()
    parent = list(range(n_nodes))
    is_head = [False] * n_nodes

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for e, (tail, head) in enumerate(element_nodes.tolist()):
        if is_head[head] or root(tail) == root(head):
            scene_node.append(scene_node[head])
            head = len(parent)
            parent.append(head)
            is_head.append(False)
            element_nodes[e, 1] = head
        is_head[head] = True
        parent[root(head)] = root(tail)
    levels, placed = [], ~np.array(is_head)
    waiting = np.arange(len(element_nodes))
    while len(waiting):
        ready = placed[element_nodes[waiting, 0]]
        levels.append(waiting[ready])
        waiting = waiting[~ready]
        placed[element_nodes[levels[-1], 1]] = True
    return levels, element_nodes

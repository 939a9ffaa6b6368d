"""Results that patterns share."""

from __future__ import annotations

import numpy as np

from kop_exudyn.equilibrium.system import System
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces
from kop_exudyn.scene.recent import Recent


def test_the_same_arrays_give_the_same_result_as_long_as_it_is_recent():
    recent, calls = Recent(), []

    def find(*arrays):
        return recent.get(lambda: calls.append(arrays) or len(calls), *arrays)

    one = np.array([1, 2, 3])
    assert find(one) == 1 and find(one.copy()) == 1
    assert find(np.array([1, 2])) == 2  # other contents, shapes, kinds and numbers of arrays
    assert find(one.reshape(1, 3)) == 3
    assert find(one.astype(np.int32)) == 4
    assert find(one[:1], one[1:]) == 5
    assert find(one[:2], one[2:]) == 6 and len(calls) == 6
    assert find(one[:2], one[2:]) == 6
    assert find(one) == 7  # too long ago


def rod(pinned: int = 0):
    builder = SceneBuilder()
    bodies = builder.bodies(np.linspace([0.0, 0, 0], [1, 0, 0], 4))
    builder.rod(builder.nodes(bodies).tolist(), np.array([1e4, 1e3, 1e3, 1, 1, 1.0]), length=1.0)
    builder.pin(pinned)
    return builder.build()


def test_scenes_of_one_topology_share_what_was_found_for_it():
    scene = rod()
    loads = [DeadForces(np.array([body]), np.array([[0, 0, -1.0]])) for body in (1, 1, 2)]
    plain, *loaded = (System(s) for s in (scene, *(scene.with_terms(load) for load in loads)))
    assert loaded[0].sparsity is loaded[1].sparsity
    assert loaded[0].sparsity is not loaded[2].sparsity and plain.sparsity is System(rod()).sparsity
    assert System(rod(3)).sparsity is not plain.sparsity  # other pins
    assert loaded[0].values is not loaded[1].values

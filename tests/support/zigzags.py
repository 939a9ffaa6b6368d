"""A toy class with both kinds of parts: zigzags of beams and corners, held a little too short."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.rods.rotations import rotation_z
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.structures.base import Design, Role, Target

STIFFNESS = np.array([1e4, 4e3, 4e3, 0.8, 1.0, 1.0])


class Zigzag(Design):
    """Straight beams with corners of given angles between them, one end clamped, the other pinned
    too near."""

    class_name = "toy_zigzag"

    def __init__(self, name: str, lengths: np.ndarray, angles: np.ndarray):
        self.name = name
        self.n = len(lengths)
        self.parameters = np.concatenate([lengths.ravel(), angles])
        self.lower = np.concatenate([np.full(2 * self.n, 0.02), np.full(self.n - 1, -3.0)])
        self.upper = np.concatenate([np.full(2 * self.n, np.inf), np.full(self.n - 1, 3.0)])
        self.groups = [
            ElementGroup("linear", np.arange(2 * self.n).reshape(-1, 2)),
            ElementGroup("angular", np.arange(2 * self.n, 3 * self.n - 1)[:, None]),
        ]
        self.roles = (Role("deployed", fitted=True),)
        self._scene = self._build(lengths, angles)

    def _build(self, lengths, angles):
        builder = SceneBuilder(len(self.parameters))
        turns = np.concatenate([[0], np.cumsum(angles)])
        steps = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
        corners = 0.97 * np.concatenate(
            [[np.zeros(3)], np.cumsum(lengths.sum(axis=1)[:, None] * steps, axis=0)]
        )
        middles = corners[:-1] + 0.97 * lengths[:, :1] * steps
        ends = builder.bodies(corners, rotation_z(np.append(turns[:1], turns)))
        self.joints = builder.bodies(middles, rotation_z(turns))
        hinges = builder.hinges(
            np.zeros(self.n - 1), parameter=np.arange(2 * self.n, 3 * self.n - 1), prescribed=True
        )
        for k in range(self.n):
            turned = -1 if k == 0 else hinges[k - 1]
            first = builder.nodes(ends[k : k + 1], np.array([turned]))[0]
            middle, last = (
                builder.nodes(b)[0] for b in (self.joints[k : k + 1], ends[k + 1 : k + 2])
            )
            builder.rod([first, middle], STIFFNESS, parameter=2 * k)
            builder.rod([middle, last], STIFFNESS, parameter=2 * k + 1)
        builder.pin(ends[0])
        builder.pin(ends[-1], (0, 1, 2))
        return builder.build()

    def scene(self, role):
        return self._scene

    def deploy(self, q=None):
        return {"deployed": solve(self.systems["deployed"], self.parameters if q is None else q)}

    @cached_property
    def target(self):
        joints = self.deploy()["deployed"].state.positions[self.joints]
        strip = np.concatenate([joints + [0, 0, z] for z in (-0.1, 0.1)])
        faces = [
            f
            for k in range(self.n - 1)
            for f in ((k, k + 1, self.n + k), (k + 1, self.n + k + 1, self.n + k))
        ]
        return Target(strip, np.array(faces), joints, float(np.linalg.norm(np.ptp(joints, axis=0))))


def zigzags() -> list[Zigzag]:
    generator = np.random.default_rng(5)
    return [
        Zigzag(f"zigzag {k}", 0.3 + 0.1 * generator.random((4, 2)), 0.6 * generator.random(3) - 0.3)
        for k in range(2)
    ]

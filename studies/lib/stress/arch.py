"""A structure class that costs next to nothing: stress tests run whole jobs with it in a second,
and the study of small optima tries every assignment.

A planar elastica arch: a straight strip of pieces in a row, its ends held closer together than it
is long. Elements are the two pieces beside a joint. Importing this module registers the class under
the name "stress_arch".
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from kop_exudyn.equilibrium import newton
from kop_exudyn.equilibrium.equilibria import Equilibrium
from kop_exudyn.errors import InputError
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.rods.rotations import rotation_z
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.scene import Scene
from kop_exudyn.structures.base import Design, Role, Solve, Target, register_class

_SECTION = np.array([1e5, 4e4, 4e4, 0.8, 1.0, 1.0])  # slender: EA L^2 / EI is about 1e5


class Arch(Design):
    """pieces : (n, 2) lengths beside each joint; span : distance of the ends; the strip bulges to
    +y."""

    class_name = "stress_arch"
    roles = (Role("deployed", fitted=True),)

    def __init__(
        self, name: str, pieces: Any, span: float, bounds: tuple[float, float] = (0.02, np.inf)
    ):
        self.name, self.span = name, float(span)
        self.parameters = np.asarray(pieces, float).ravel()
        n = len(self.parameters)
        self.lower, self.upper = np.full(n, bounds[0]), np.full(n, bounds[1])
        self.groups = [ElementGroup("linear", np.arange(n).reshape(-1, 2))]
        self._scene = self._build()

    def _build(self) -> Scene:
        q = self.parameters
        stations = np.concatenate([[0], np.cumsum(q)]) / q.sum()
        fine = np.interp(np.linspace(0, len(q), 2 * len(q) + 1), np.arange(len(q) + 1), stations)
        rise = 0.5 * np.sqrt(max(q.sum() ** 2 - self.span**2, 0.0))
        positions = np.stack([fine * self.span, rise * np.sin(np.pi * fine), 0 * fine], axis=1)
        slopes = np.arctan2(rise * np.pi * np.cos(np.pi * fine), self.span)
        builder = SceneBuilder(len(q))
        bodies = builder.bodies(positions, rotation_z(slopes))
        nodes = builder.nodes(bodies)
        for k in range(len(q)):
            builder.rod(nodes[2 * k : 2 * k + 3].tolist(), _SECTION, parameter=k)
        builder.pin(bodies[0], (0, 1, 2, 3, 4))
        builder.pin(bodies[-1], (0, 1, 2, 3))
        self.joints = bodies[2:-1:4]
        return builder.build()

    def scene(self, role: str = "deployed") -> Scene:
        return self._scene

    def deploy(
        self, q: np.ndarray | None = None, solve: Solve | None = None
    ) -> dict[str, Equilibrium]:
        own = newton.solve if solve is None else solve
        return {"deployed": own(self.systems["deployed"], self.parameters if q is None else q)}

    @cached_property
    def target(self) -> Target:
        joints = self.deploy()["deployed"].state.positions[self.joints]
        strip = np.concatenate([joints + [0, 0, z] for z in (-0.1, 0.1)])
        n = len(joints)
        faces = [f for k in range(n - 1) for f in ((k, k + 1, n + k), (k + 1, n + k + 1, n + k))]
        return Target(strip, np.array(faces), joints, float(np.linalg.norm(np.ptp(joints, axis=0))))


@register_class("stress_arch")
def read_arch(data: Mapping[str, Any], source: str) -> Arch:
    """The arch of a design file's content. Raises InputError."""
    for field in ("pieces", "span"):
        if field not in data:
            raise InputError("is missing", source=source, field=field)
    return Arch(data["name"], data["pieces"], data["span"])


def arch_data(count: int = 2, joints: int = 5, seed: int = 3) -> list[dict[str, Any]]:
    """Contents of design files: arches of uneven pieces."""
    rng = np.random.default_rng(seed)
    pieces = [0.1 + 0.04 * rng.random((joints, 2)) for _ in range(count)]
    return [
        {
            "format": "kop_exudyn/design",
            "version": 1,
            "class": "stress_arch",
            "name": f"arch {k}",
            "pieces": p.tolist(),
            "span": 0.8 * float(p.sum()),
        }
        for k, p in enumerate(pieces)
    ]


def arches(count: int = 2, joints: int = 5, seed: int = 3) -> list[Arch]:
    """Such designs."""
    return [read_arch(data, data["name"]) for data in arch_data(count, joints, seed)]

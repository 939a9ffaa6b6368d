"""A structure class is one file: this one is added from outside, and a kit is found for it without
other changes.

The class is a planar elastica arch: a straight strip with J marked joints, clamped at nothing, its
ends pinned closer together than it is long. Elements are the strip's pieces around a joint (two
lengths).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.rods.rotations import rotation_z
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.structures.base import (
    Design,
    Role,
    Target,
    class_names,
    design_from_dict,
    register_class,
)

SECTION = np.array([1e5, 4e4, 4e4, 0.8, 1.0, 1.0])  # slender: EA L^2 / EI is about 1e5


class Arch(Design):
    """Pieces of given lengths in a row, their outer ends pinned `span` apart; bulges to +y."""

    class_name = "toy_arch"

    def __init__(self, name: str, pieces: np.ndarray, span: float):
        self.name, self.span = name, span
        self.parameters = np.asarray(pieces, float).ravel()
        n = len(self.parameters)
        self.lower, self.upper = np.full(n, 0.02), np.full(n, np.inf)
        self.groups = [ElementGroup("linear", np.arange(n).reshape(-1, 2))]
        self.roles = (Role("deployed", fitted=True),)
        self._scene = self._build()

    def _build(self):
        q = self.parameters
        stations = np.concatenate([[0], np.cumsum(q)]) / q.sum()
        fine = np.interp(np.linspace(0, len(q), 2 * len(q) + 1), np.arange(len(q) + 1), stations)
        rise = 0.5 * np.sqrt(q.sum() ** 2 - self.span**2)
        x = np.stack([fine * self.span, rise * np.sin(np.pi * fine), 0 * fine], axis=1)
        slope = np.arctan2(rise * np.pi * np.cos(np.pi * fine), self.span)
        builder = SceneBuilder(len(q))
        bodies = builder.bodies(x, rotation_z(slope))
        nodes = builder.nodes(bodies)
        for k in range(len(q)):
            builder.rod(nodes[2 * k : 2 * k + 3], SECTION, parameter=k)
        builder.pin(bodies[0], (0, 1, 2, 3, 4))
        builder.pin(bodies[-1], (0, 1, 2, 3))
        self.joints = bodies[2:-1:4]
        return builder.build()

    def scene(self, role):
        return self._scene

    def deploy(self, q=None):
        from kop_exudyn.equilibrium.newton import solve

        return {"deployed": solve(self.systems["deployed"], self.parameters if q is None else q)}

    @cached_property
    def target(self):
        joints = self.deploy()["deployed"].state.positions[self.joints]
        strip = np.concatenate([joints + [0, 0, z] for z in (-0.1, 0.1)])
        n = len(joints)
        faces = [f for k in range(n - 1) for f in ((k, k + 1, n + k), (k + 1, n + k + 1, n + k))]
        return Target(strip, np.array(faces), joints, float(np.linalg.norm(np.ptp(joints, axis=0))))


@register_class("toy_arch")
def read(data, source):
    if "pieces" not in data:
        raise InputError("missing", source=source, field="pieces")
    return Arch(data["name"], np.array(data["pieces"]), data["span"])


def designs():
    rng = np.random.default_rng(3)
    pieces = [0.1 + 0.04 * rng.random((6, 2)) for _ in range(3)]
    return [
        design_from_dict(
            {"class": "toy_arch", "name": f"arch {k}", "pieces": p.tolist(), "span": 0.8 * p.sum()}
        )
        for k, p in enumerate(pieces)
    ]


def test_the_class_is_registered_beside_the_built_in_ones():
    names = class_names()
    assert "toy_arch" in names and "c_shell" in names


def test_two_stages_beat_the_direct_projection():
    outcome = optimize_kit(designs(), {"linear": 3}, settings=JobSettings(jobs=1))
    direct, assigned = outcome.stages["direct"], outcome.stages["assigned"]
    assert assigned.value < 0.5 * direct.value
    for evaluation in assigned.designs:
        assert evaluation.confirmations["deployed"].moved < 1e-8
        assert evaluation.equilibria["deployed"].stable
    realised = assigned.assignment.matrix(assigned.kit) @ assigned.kit.vector
    np.testing.assert_array_equal(np.concatenate([e.q for e in assigned.designs]), realised)


def test_results_do_not_depend_on_the_number_of_processes():
    settings = StageSettings(schedule=(1e3, 1e5))
    one, two = (
        optimize_kit(designs(), {"linear": 3}, settings=JobSettings(jobs=jobs, stages=settings))
        for jobs in (1, 2)
    )
    np.testing.assert_array_equal(
        one.stages["assigned"].kit.vector, two.stages["assigned"].kit.vector
    )


def test_more_parts_than_elements_are_refused():
    with pytest.raises(InputError, match="more parts than elements"):
        optimize_kit(designs(), {"linear": 30}, settings=JobSettings(jobs=1))

"""Rods of the classical problems."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from kop_exudyn.equilibrium import exudyn_confirm
from kop_exudyn.equilibrium.newton import refine, solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.rods.rotations import exp_se3
from kop_exudyn.scene.builder import SceneBuilder

NONE = np.zeros(0)


def axes_along(tangent, normal) -> np.ndarray:
    """Rod axes (3, 3): x along the tangent, z along the part of the normal across it."""
    x = np.asarray(tangent, float) / np.linalg.norm(tangent)
    y = np.cross(normal, x)
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def add_rod(
    builder: SceneBuilder,
    n: int,
    start,
    axes,
    length: float,
    stiffness,
    *,
    first=None,
    strain=None,
    rest_strain=None,
) -> np.ndarray:
    """Add a rod of n elements from a point, along constant strain (default straight); returns its
    bodies (n + 1,).

    first : body to start from; strain : (6,) in which it is placed; rest_strain : (6,) in which it
        is unstressed
    """
    strain = np.array([1.0, 0, 0, 0, 0, 0]) if strain is None else np.asarray(strain, float)
    s = np.linspace(0, length, n + 1)
    p, R = exp_se3(s[:, None] * strain)
    x, R = np.asarray(start, float) + p @ axes.T, axes @ R
    if first is None:
        bodies = builder.bodies(x, R)
        nodes = builder.nodes(bodies)
    else:
        bodies = np.concatenate([[first], builder.bodies(x[1:], R[1:])])
        there = np.concatenate(builder._rotations)[first]
        nodes = np.concatenate(
            [builder.nodes([first], frame=there.T @ axes), builder.nodes(bodies[1:])]
        )
    builder.rod(nodes, stiffness, length=length, rest_strain=rest_strain)
    return bodies


def hold_plane(builder: SceneBuilder, bodies, normal: int) -> None:
    """Take a plane's out-of-plane freedoms from bodies that have the normal (1: y, 2: z) among
    their own axes."""
    others = [k for k in range(3) if k != normal]
    for body in bodies:
        builder.pin(body, (normal, *(3 + k for k in others)))


def equilibrium(scene, start=None, confirm=True):
    """Solve; and let Exudyn confirm it."""
    system = System(scene)
    eq = solve(system, NONE, start)
    if confirm:
        confirmation = exudyn_confirm.confirm(scene, refine(system, eq))
        assert confirmation.newton_steps <= 2 and confirmation.moved < 1e-8
    return eq


@pytest.fixture(scope="session")
def rods():
    return SimpleNamespace(
        axes_along=axes_along,
        add=add_rod,
        hold_plane=hold_plane,
        equilibrium=equilibrium,
        none=NONE,
    )


@pytest.fixture
def classical(record_property):
    """Tells studies/stress.py what a classical case compared: the case, its source, rod elements,
    and two numbers."""

    def record(case: str, source: str, elements: int, reference: float, found: float) -> None:
        record_property(
            "classical",
            {
                "case": case,
                "source": source,
                "elements": elements,
                "reference": float(reference),
                "found": float(found),
            },
        )

    return record

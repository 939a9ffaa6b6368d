"""Nets that bend in one way first and turn into another one on the way: which of its two mirror
images they come out as is no matter of rounding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import kop_exudyn as kop
from kop_exudyn.structures.opening import Way

ANGLE = np.radians(20)
# of sets of errors in the curves' places, some of which once led to the other side
ERRORS = [(0, 1e-6), (1, 1e-5), (2, 1e-6), (3, 1e-4)]


def rhombic_net(seed: int, size: float) -> kop.Design:
    """Ten curves of a rhombic lattice's image under sinh, each moved and stretched a little."""
    rng = np.random.default_rng(seed)
    t, curves = np.linspace(-1.1, 1.1, 31), []
    for family in (1, -1):
        for k in np.linspace(-1, 1, 5):
            z = t * np.exp(1j * family * ANGLE) + k * np.exp(-1j * family * ANGLE) + 0.3
            w = np.sinh(0.55 * z)
            points = np.column_stack([w.real, w.imag])
            points += np.outer(np.linspace(0, 1, len(t)), rng.normal(size=2) * size)
            points += rng.normal(size=2) * size
            curves.append({"type": "spline", "points": points.tolist()})
    return kop.design_from_dict(
        {
            "format": "kop_exudyn/design",
            "version": 2,
            "class": "c_shell",
            "name": "rhombic",
            "material": {"young": 2.1e9, "poisson": 0.35},
            "section": {"type": "rectangle", "width": 0.03, "height": 0.004},
            "curves": curves,
            "opening": {"angle": np.radians(35)},
        }
    )


@pytest.mark.parametrize("seed, size", ERRORS)
def test_a_net_opens_to_the_side_of_its_target(seed, size):
    assert kop.simulate(rhombic_net(seed, size)).fit.max_percent < 0.1


def test_the_way_at_other_parameters_ends_on_the_same_side():
    """As searches follow it, where the one that is known came out on the wanted side."""
    design = rhombic_net(0, 0.0)
    found = design.deploy()
    way, q = design.way, design.parameters
    opened = way.opened(design.systems, q, design.assembled(q, found))
    for seed in range(3):
        errors = np.random.default_rng(seed).normal(size=len(q)) * 1e-5
        near = q * (1 + errors)
        own = design.deploy(near)["deployed"]
        followed = way.followed(design.systems, near, opened[:-1], own)
        assert len(followed) == len(way.stations)
        assert way.apart(own, found["deployed"]) < 1e-2


def test_mirror_images_are_told_apart_wherever_they_lie():
    design = rhombic_net(0, 0.0)
    state = design.deploy()["deployed"].state
    way: Way = design.way
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = state.transformed(turn, np.array([3.0, -2.0, 7.0]))
    mirrored = mirror_image(state)
    assert not way._mirrored(state, moved)
    assert way._mirrored(mirrored, moved) and way._mirrored(moved, mirrored)


def mirror_image(state):
    return replace(state, positions=state.positions * (1.0, 1.0, -1.0))

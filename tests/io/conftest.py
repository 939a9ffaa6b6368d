"""Two small C-shells and the kit that their elements are clustered to: what workshop files are
tested with."""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.structures.base import design_from_dict


def shell(name: str, stretch: float):
    """Three curves across two, with corners everywhere and one length at each curve's ends; units
    are metres."""
    along = [[[-1.2, y - 0.1], [0, y], [1.2, y - 0.1 * stretch]] for y in (-0.5, 0.4 * stretch)]
    across = [
        [[x, -0.9], [x * 1.1 + 0.02, 0], [x, 0.9 * stretch]] for x in (-0.8, 0.05, 0.7 * stretch)
    ]
    return design_from_dict(
        {
            "class": "c_shell",
            "name": name,
            "opening": {"angle": 0.2},
            "crossings": "find",
            "free_ends": False,
            "material": {"young": 2.1e9, "poisson": 0.35, "elastic_limit": 4e7},
            "section": {"type": "rectangle", "width": 0.03, "height": 0.004},
            "curves": [
                {"type": "spline", "points": points, "closed": False} for points in along + across
            ],
        }
    )


@pytest.fixture(scope="session")
def shells():
    return [shell("first", 1.0), shell("second", 1.1)]


@pytest.fixture(scope="session")
def clustering(shells):
    """Kit and assignment of all elements of both shells."""
    offsets = np.cumsum([0, *(len(design.parameters) for design in shells)])
    groups = [
        group.shifted(offset) for design, offset in zip(shells, offsets) for group in design.groups
    ]
    return cluster(
        groups, np.concatenate([d.parameters for d in shells]), {"linear": 3, "angular": 2}, seed=1
    )


@pytest.fixture(scope="session")
def parts(shells, clustering):
    return parts_list(clustering.kit, clustering.assignment, shells)

"""The size that percentages are taken of: exact for simple bodies, and the same in any place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from kop_exudyn.geometry.extent import mean_width, size_of_points

GRID = np.stack(np.meshgrid(*[np.linspace(-1, 1, 5)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
CASES = {
    "cube of many points": GRID,
    "plate": GRID * [1.0, 1.0, 0.0],
    "leaf": GRID * [1.0, 1.0, 1e-9],
    "stick": GRID * [1.0, 0.0, 0.0],
    "saddle": np.column_stack([GRID[:, :2], GRID[:, 0] ** 2 - GRID[:, 1] ** 2]),
    "shallow bowl": np.column_stack([GRID[:, :2], 1e-4 * (GRID[:, :2] ** 2).sum(axis=1)]),
}


def test_mean_widths_of_known_bodies():
    """A box's is half the sum of its edges, a plate's a quarter of its perimeter, a stick's half
    its length; a ball's its diameter, and a size of sqrt(3) times it, as its box has."""
    assert mean_width(GRID * [1.0, 2.0, 3.0]) == pytest.approx(6.0, rel=1e-12)
    assert mean_width(GRID * [1.0, 2.0, 0.0]) == pytest.approx(3.0, rel=1e-12)
    assert mean_width(GRID[:, :2]) == pytest.approx(2.0, rel=1e-12)
    assert mean_width(GRID * [1.0, 0.0, 0.0]) == pytest.approx(1.0, rel=1e-12)
    assert mean_width(GRID[:1]) == 0.0
    ball = np.random.default_rng(0).normal(size=(4000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    assert size_of_points(ball) == pytest.approx(2 * np.sqrt(3), rel=2e-3)


def test_the_mean_width_is_a_mean_over_directions():
    """Of the widths of a cloud across 100,000 directions."""
    rng = np.random.default_rng(1)
    points, ways = rng.normal(size=(30, 3)), rng.normal(size=(100000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    widths = np.ptp(points @ ways.T, axis=0)
    assert mean_width(points) == pytest.approx(widths.mean(), rel=5 * widths.std() / 300)


@pytest.mark.parametrize("points", CASES.values(), ids=CASES)
@settings(max_examples=30, deadline=None)
@given(
    st.tuples(*[st.floats(-np.pi, np.pi)] * 3),
    st.tuples(*[st.floats(-100, 100)] * 3),
    st.floats(1e-6, 1e6),
    st.sampled_from([1.0, -1.0]),
)
def test_sizes_neither_turn_nor_move(points, vector, shift, scale, mirror):
    turned = (points * [1, 1, mirror]) @ Rotation.from_rotvec(vector).as_matrix().T
    found = size_of_points(scale * (turned + np.array(shift)))
    # places are rounded by 1e-14, and angles between the faces of a leaf of 1e-9 by 1e-5
    thin = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[-1]
    tolerance = 1e-7 if 0 < thin < 1e-6 else 1e-11
    assert found == pytest.approx(scale * size_of_points(points), rel=tolerance)


@pytest.mark.parametrize("seed", [0, 251, 445])
def test_the_hull_of_a_leaf_is_found_however_its_places_are_rounded(seed):
    """Qhull merged the facets of these for ever."""
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec([rng.uniform(-np.pi, np.pi), 0.0, 0.0]).as_matrix()
    scale = 10.0 ** rng.uniform(-6, 6)
    placed = scale * (CASES["leaf"] @ turn.T + np.array([0, *rng.uniform(-100, 100, 2)]))
    assert mean_width(placed) == pytest.approx(2 * scale, rel=1e-7)


@pytest.mark.parametrize("thickness", [1e-10, 1e-8, 0.99e-6, 1.01e-6, 1e-4])
def test_thin_boxes_have_the_mean_width_of_boxes(thickness):
    box = GRID * [1.0, 2.0, thickness]
    assert mean_width(box) == pytest.approx(3.0 + thickness, rel=1e-12)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_sizes_change_by_no_more_than_their_points(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(12, 3)) * 10.0 ** rng.uniform(-6, 0, size=3)
    moved = points + 1e-3 * rng.uniform(-1, 1, size=points.shape)
    apart = np.linalg.norm(moved - points, axis=1).max()
    assert abs(mean_width(moved) - mean_width(points)) <= 2 * apart + 1e-12

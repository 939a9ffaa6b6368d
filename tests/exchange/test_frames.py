"""The plane of a drawing: its axes are right-handed wherever it lies, so that what is on one side
of a net is on the same side of its design."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kop_exudyn.exchange.drawing import DrawnCurve
from kop_exudyn.exchange.drawn_networks import Drawing, drawn_network
from kop_exudyn.exchange.frames import frame_of

PLANES = {
    "xy": np.eye(3),
    "xz": Rotation.from_euler("x", 90, degrees=True).as_matrix(),
    "yz": Rotation.from_rotvec(np.ones(3) / 3**0.5 * 2 * np.pi / 3).as_matrix(),
    "nearly xz": Rotation.from_euler("x", 85, degrees=True).as_matrix(),
    "tilted": Rotation.from_euler("zxz", [20, 35, -10], degrees=True).as_matrix(),
}


def net(turn):
    """Three laths along one axis and three along the other, in a plane of its own."""
    laths = [((-0.2, k), (2.2, k)) for k in range(3)] + [((k, -0.2), (k, 2.2)) for k in range(3)]
    flat = [np.column_stack([np.array(lath, float), [0, 0]]) for lath in laths]
    return [DrawnCurve(x @ turn.T, False, f"line {k}") for k, x in enumerate(flat)]


@pytest.mark.parametrize("plane", PLANES)
def test_axes_are_right_handed_and_heights_stay_on_their_side(plane):
    turn = PLANES[plane]
    curves = net(turn)
    frame = frame_of(curves, 3.4)
    assert np.linalg.det(frame.axes) == pytest.approx(1.0)
    points = np.random.default_rng(1).normal(size=(5, 3))
    assert np.allclose(frame.back(frame(points)), points)
    above = np.array([1.0, 1.0, 0.5]) @ turn.T
    assert frame(above)[2] - frame(curves[0].points)[0, 2] == pytest.approx(0.5)
    drawn = drawn_network(Drawing(curves))
    assert drawn.network.n_joints == 9


@pytest.mark.parametrize("plane", ["xy", "xz", "yz"])
def test_axes_of_coordinate_planes_are_the_drawings(plane):
    """To the last digit: none is turned a little."""
    frame = frame_of(net(np.round(PLANES[plane])), 3.4)
    assert set(np.abs(frame.axes).ravel().tolist()) == {0.0, 1.0}
    assert (frame.axes[2] == PLANES[plane].round()[:, 2]).all()

"""Pictures of pavilions show all of them."""

import numpy as np
import pytest

from kop_exudyn.drawing.render import Camera
from lib.pavilion_scene import in_view

CAMERA = Camera(np.array([0.0, -10.0, 0.0]), np.zeros(3), 2 * np.arctan(0.5))


@pytest.mark.parametrize(
    "point, seen",
    [
        ([0, 0, 0], True),
        ([0, 0, 4.7], True),  # half of the height is 5 there
        ([0, 0, 5.1], False),
        ([0, 0, -5.1], False),
        ([9.4, 0, 0], True),  # and twice as wide
        ([-10.2, 0, 0], False),
        ([0, -20, 0], False),  # behind
    ],
)
def test_what_a_camera_sees(point, seen):
    assert in_view(np.array([[0.0, 0.0, 0.0], point]), CAMERA, 2.0) is seen

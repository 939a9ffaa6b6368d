"""Pictures of designs: what is in them, and how large it says that it is."""

import numpy as np
import pytest
from PIL import Image

from kop_exudyn.drawing.render import Body
from kop_exudyn.exchange.meshes import tube
from kop_exudyn.report.kit_picture import Solid, joined, picture
from kop_exudyn.report.surroundings import scale_bar, upright
from kop_exudyn.units import Units

RED = (0.9, 0.1, 0.1)


def bar(length: float) -> Solid:
    """A red bar along x on the ground."""
    half = 0.02 * length
    ring = np.array([[half, half], [-half, half], [-half, -half], [half, -half]])
    ends = [
        np.column_stack([np.full(4, x), ring[:, 0], ring[:, 1] + half])
        for x in (-length / 2, length / 2)
    ]
    rods = Body.of(np.concatenate(ends), tube(2, ring), RED)
    joints = np.array([[-length / 2, 0, half], [length / 2, 0, half]])
    return Solid(rods, joints, 2 * half, np.array([length, 2 * half]), 2 * half)


def pixels(image: Image.Image) -> np.ndarray:
    return np.asarray(image.convert("RGB"), float) / 255


def dark(image: Image.Image) -> int:
    """Pixels as dark as the person and the scale bar."""
    return int((pixels(image).max(axis=2) < 0.35).sum())


@pytest.mark.parametrize("length", [1e-3, 1.0, 2.5e4])
def test_a_design_fills_its_picture_at_any_size(length):
    image = pixels(picture(bar(length), None, 200, 150, fine=False))
    red = np.argwhere((image[..., 0] > 0.3) & (image[..., 1] < 0.3))
    assert 0.45 * 200 < np.ptp(red[:, 1]) < 200 and 0 < red[:, 1].min() < red[:, 1].max() < 199


def test_a_person_stands_beside_what_is_large_enough():
    """The same picture but for the person: at 6 m there is one; at 2.7 and 0.6 m, where it would
    take the picture from the design, none."""
    tall, shell, small = (
        dark(picture(bar(length), Units("m"), 200, 150, fine=False)) for length in (6.0, 2.7, 0.6)
    )
    assert tall > small + 100 and abs(shell - small) < 50


def test_the_scale_bar_has_its_length():
    along = np.array([0.6, 0.8, 0.0])
    body = scale_bar(np.array([1.0, 2.0, 0.0]), along, 0.5, 0.01)
    assert np.ptp(body.vertices @ along) == pytest.approx(0.5)


def test_a_design_that_stands_keeps_its_z_and_one_on_its_side_is_laid_down():
    x, y = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9))
    dome = np.stack([x, y, 0.2 * (2 - x**2 - y**2)], axis=-1).reshape(-1, 3)
    np.testing.assert_array_equal(upright(dome), np.eye(3))
    turned = dome[:, [2, 0, 1]] @ upright(dome[:, [2, 0, 1]]).T
    assert np.ptp(turned[:, 2]) == pytest.approx(np.ptp(dome[:, 2]))
    assert turned[40, 2] == pytest.approx(turned[:, 2].max())  # the crown is up


def test_several_pictures_in_one_file():
    one = Image.new("RGB", (60, 40), "red")
    assert joined([one, None, one], ["a", "b", "c"])[:4] == b"\x89PNG"

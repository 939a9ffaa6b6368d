"""Pictures of solids: what hides what, what lies in the shade."""

import numpy as np

from kop_exudyn.drawing.render import Body, Camera, Light, render

LIGHT = Light(sun=(0.0, 0.0, 1.0), softness=1e-3, suns=2, skies=8, buffer=200)
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
FACES = np.array([[0, 1, 2], [0, 2, 3]])
ABOVE = Camera(np.array([0.0, -0.01, 10.0]), np.zeros(3), 0.5)


def test_nearer_faces_hide_farther_ones():
    red, blue = (
        Body.of(SQUARE, FACES, (1, 0, 0)),
        Body.of(0.4 * SQUARE + [0, 0, 1], FACES, (0, 0, 1)),
    )
    for bodies in ([red, blue], [blue, red]):
        picture = render(bodies, ABOVE, 60, 60, light=LIGHT, samples=1)
        middle, edge = picture[30, 30], picture[30, 21]
        assert middle[2] > 0.5 > 0.1 > middle[0] and edge[0] > 0.4 > 0.1 > edge[2]


def test_shade_lies_under_things_only():
    floor = Body.of(SQUARE, FACES, (0.8, 0.8, 0.8))
    roof = Body.of(0.3 * SQUARE + [0, 0, 0.8], FACES, (0.8, 0.8, 0.8))
    low = Camera(np.array([0.0, -8.0, 4.0]), np.zeros(3), 0.4)
    alone, under = (
        render(bodies, low, 80, 80, light=LIGHT, samples=1)[40, 40]
        for bodies in ([floor], [floor, roof])
    )
    assert under.mean() < 0.8 * alone.mean()


def test_the_background_is_where_nothing_is():
    picture = render(
        [Body.of(SQUARE, FACES, (1, 0, 0))],
        ABOVE,
        40,
        20,
        light=LIGHT,
        background=(0.2, 0.4, 0.6),
        samples=1,
    )
    assert picture.shape == (20, 40, 3) and np.allclose(picture[0, 0], (0.2, 0.4, 0.6), atol=1e-6)


def test_the_same_scene_gives_the_same_picture():
    body = Body.of(SQUARE + [0, 0, 0.2], FACES, (0.3, 0.6, 0.3))
    assert np.array_equal(
        *(render([body], ABOVE, 30, 30, light=LIGHT, samples=2) for _ in range(2))
    )

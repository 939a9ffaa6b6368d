from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.rods.sections import (
    Material,
    circle,
    general,
    material_from_dict,
    rectangle,
    section_from_dict,
)

# Timoshenko and Goodier, Theory of Elasticity, art. 109, table: a/b, J / (a b^3), tau_max / (G
# theta b)
TORSION_TABLE = [
    (1.0, 0.1406, 0.675),
    (1.2, 0.166, 0.759),
    (1.5, 0.196, 0.848),
    (2.0, 0.229, 0.930),
    (2.5, 0.249, 0.968),
    (3.0, 0.263, 0.985),
    (4.0, 0.281, 0.997),
    (5.0, 0.291, 0.999),
    (10.0, 0.312, 1.000),
    (1e6, 0.333, 1.000),
]


@pytest.mark.parametrize("ratio, k1, k", TORSION_TABLE)
def test_torsion_of_rectangles_against_the_table(ratio, k1, k):
    b = 0.7
    for section in (rectangle(ratio * b, b), rectangle(b, ratio * b)):
        assert section.torsion / (ratio * b**4) == pytest.approx(k1, abs=6e-4)
        assert section.torsion_modulus / b == pytest.approx(k, abs=6e-4)


def test_torsion_of_the_square_to_eight_digits():
    """J / a^4 = 0.14057701 (Roark's Formulas for Stress and Strain, and any summation of the
    series)."""
    assert rectangle(2.0, 2.0).torsion / 16 == pytest.approx(0.14057701, abs=1e-8)


@given(width=st.floats(1e-6, 1e6), height=st.floats(1e-6, 1e6))
def test_rectangle_integrals(width, height):
    section = rectangle(width, height)
    y, z = section.outline.T
    assert section.area == pytest.approx(0.5 * abs(np.sum(y * np.roll(z, -1) - z * np.roll(y, -1))))
    assert section.inertia_y == pytest.approx(width * height**3 / 12)
    assert section.inertia_z == pytest.approx(height * width**3 / 12)
    thin, long = sorted((width, height))
    assert section.torsion < long * thin**3 / 3
    assert section.torsion < section.inertia_y + section.inertia_z  # the polar moment bounds it
    assert rectangle(height, width).torsion == pytest.approx(section.torsion, rel=1e-14)


def test_circle():
    section = circle(0.3)
    assert section.torsion == pytest.approx(section.inertia_y + section.inertia_z)
    assert section.inertia_y == section.inertia_z == pytest.approx(np.pi * 0.3**4 / 4)
    assert np.allclose(np.linalg.norm(section.outline, axis=1), 0.3)


def test_stiffness_order_and_axes():
    material = Material(young=210.0, poisson=0.25)
    section = rectangle(width=0.4, height=0.1)
    EA, GAy, GAz, GJ, EIy, EIz = section.stiffness(material)
    G = 210.0 / 2.5
    assert (EA, GAy, GAz) == pytest.approx((210 * 0.04, G * 0.04 * 5 / 6, G * 0.04 * 5 / 6))
    assert pytest.approx(G * section.torsion) == GJ
    assert EIz == pytest.approx(16 * EIy)  # width along y: stiff against bending about z


def test_general_section_draws_a_rectangle_of_the_same_inertia():
    like = rectangle(0.4, 0.1)
    section = general(like.area, like.inertia_y, like.inertia_z, like.torsion)
    assert np.allclose(section.outline, like.outline)
    assert section.torsion_modulus == pytest.approx(0.1)
    assert np.allclose(section.stiffness(Material(1.0, 0.3)), like.stiffness(Material(1.0, 0.3)))


def test_sections_and_materials_from_dicts():
    assert section_from_dict({"type": "circle", "radius": 2}).area == circle(2).area
    assert (
        section_from_dict({"type": "rectangle", "width": 1, "height": 2}).torsion
        == rectangle(1, 2).torsion
    )
    assert material_from_dict({"young": 1e9, "poisson": 0.3, "density": 1.0}).density == 1.0


@pytest.mark.parametrize(
    "data, field",
    [
        ({"type": "rectangle", "width": 0.0, "height": 1.0}, "section.width"),
        ({"type": "rectangle", "width": 1.0, "height": -1.0}, "section.height"),
        ({"type": "rectangle", "width": float("nan"), "height": 1.0}, "section.width"),
        ({"type": "rectangle", "width": True, "height": 1.0}, "section.width"),
        ({"type": "rectangle", "width": "1", "height": 1.0}, "section.width"),
        ({"type": "circle", "radius": float("inf")}, "section.radius"),
        ({"type": "circle", "radius": 1.0, "width": 1.0}, "section"),
        ({"type": "circle"}, "section"),
        ({"type": "ellipse"}, "section.type"),
        ({}, "section.type"),
        (
            {"type": "general", "area": 1.0, "inertia_y": 1.0, "inertia_z": 0.0, "torsion": 1.0},
            "section.inertia_z",
        ),
        (
            {
                "type": "general",
                "area": 1.0,
                "inertia_y": 1.0,
                "inertia_z": 1.0,
                "torsion": 1.0,
                "outline": [[0, 0], [1, 1]],
            },
            "section.outline",
        ),
        (
            {
                "type": "general",
                "area": 1.0,
                "inertia_y": 1.0,
                "inertia_z": 1.0,
                "torsion": 1.0,
                "outline": [[0, 0], [1, 1], [2]],
            },
            "section.outline",
        ),
        (
            {
                "type": "general",
                "area": 1.0,
                "inertia_y": 1.0,
                "inertia_z": 1.0,
                "torsion": 1.0,
                "torsion_modulus": -1.0,
            },
            "section.torsion_modulus",
        ),
    ],
)
def test_bad_sections(data, field):
    with pytest.raises(InputError) as caught:
        section_from_dict(data)
    assert caught.value.field == field


@pytest.mark.parametrize(
    "data, field",
    [
        ({"young": 0.0, "poisson": 0.3}, "material.young"),
        ({"young": 1.0, "poisson": 0.6}, "material.poisson"),
        ({"young": 1.0, "poisson": -1.0}, "material.poisson"),
        ({"young": 1.0, "poisson": "x"}, "material"),
        ({"young": 1.0, "poisson": float("nan")}, "material.poisson"),
        ({"young": 1.0, "poisson": 0.3, "density": -1.0}, "material.density"),
        ({"young": 1.0, "poisson": 0.3, "elastic_limit": 0.0}, "material.elastic_limit"),
        ({"young": 1.0}, "material"),
    ],
)
def test_bad_materials(data, field):
    with pytest.raises(InputError) as caught:
        material_from_dict(data)
    assert caught.value.field == field

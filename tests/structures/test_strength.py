"""Strength against closed forms of beam theory."""

import numpy as np
import pytest

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.rods.sections import Material, circle, general, rectangle
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import BodyMoments, DeadForces
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.strength import design_strength, materials_of, rod_strength

MATERIAL = Material(2e9, 0.35, elastic_limit=4e7)
SECTION = rectangle(0.03, 0.004)
LENGTH = 0.5


def cantilever(*terms, section=SECTION, elements=3, n_bodies=None):
    """A clamped straight rod along x; terms are made from its tip's body."""
    builder = SceneBuilder()
    bodies = builder.bodies(np.linspace([0, 0, 0], [LENGTH, 0, 0], elements + 1))
    builder.rod(builder.nodes(bodies), section.stiffness(MATERIAL), length=LENGTH, section=section)
    builder.pin(bodies[0])
    for term in terms:
        builder.term(term(bodies[-1]))
    scene = builder.build()
    return scene, solve(System(scene), np.empty(0))


def force(*components):
    return lambda tip: DeadForces([tip], [components])


def moment(*components):
    return lambda tip: BodyMoments([tip], [components])


def test_tension():
    scene, eq = cantilever(force(1000.0, 0, 0))
    found = rod_strength(scene, eq, [MATERIAL])
    expected = 1000 / (0.03 * 0.004)
    for values in (found.axial, found.normal, found.equivalent):
        np.testing.assert_allclose(values, expected, rtol=1e-6)
    np.testing.assert_allclose(found.utilisation, expected / 4e7, rtol=1e-6)


@pytest.mark.parametrize(
    "component, modulus, elements",
    [
        (1, 0.004 * 0.03**2 / 6, 1),
        (2, 0.03 * 0.004**2 / 6, 1),
        (1, 0.004 * 0.03**2 / 6, 5),
        (2, 0.03 * 0.004**2 / 6, 5),
    ],
)
def test_transverse_force_bends_most_at_the_clamp(component, modulus, elements):
    load = np.zeros(3)
    load[component] = 1e-3  # so small that the lever stays what it was
    scene, eq = cantilever(force(*load), elements=elements)
    found = rod_strength(scene, eq)
    assert found.normal[0] == pytest.approx(1e-3 * LENGTH / modulus, rel=1e-5)
    if elements > 1:
        levers = np.arange(elements, 0, -1) / elements
        np.testing.assert_allclose(found.normal, 1e-3 * LENGTH * levers / modulus, rtol=1e-5)


def test_biaxial_bending_adds_up_in_one_corner():
    scene, eq = cantilever(moment(0, 2e-6, -3e-6))
    found = rod_strength(scene, eq)
    expected = 2e-6 * 6 / (0.03 * 0.004**2) + 3e-6 * 6 / (0.004 * 0.03**2)
    np.testing.assert_allclose(found.normal, expected, rtol=1e-6)


@pytest.mark.parametrize("y, z", [(0.004, 0.0), (-0.004, 0.0), (0.0, 0.0007), (0.0, -0.0007)])
def test_sign_of_normal_stress_agrees_with_the_rods_own_kinematics(y, z):
    """Pulled outside its axis, the fibres on that side are stretched more; seen in a lopsided
    outline."""
    corners = np.array([[0.02, 0.001], [-0.01, 0.002], [-0.01, -0.003]])
    section = general(1.2e-4, 1.6e-10, 9e-9, 6e-10, outline=corners)
    scene, eq = cantilever(
        lambda tip: DeadForces([tip], [[1e-4, 0, 0]], [[0, y, z]]), section=section
    )
    found = rod_strength(scene, eq)
    stress = 1e-4 * (1 / 1.2e-4 + y * corners[:, 0] / 9e-9 + z * corners[:, 1] / 1.6e-10)
    np.testing.assert_allclose(found.normal, np.abs(stress).max(), rtol=1e-4)


def test_torsion_of_a_circle():
    scene, eq = cantilever(moment(5.0, 0, 0), section=circle(0.01))
    found = rod_strength(scene, eq)
    tau = 2 * 5.0 / (np.pi * 0.01**3)
    np.testing.assert_allclose(found.shear, tau, rtol=1e-6)
    np.testing.assert_allclose(found.equivalent, np.sqrt(3) * tau, rtol=1e-6)


def test_torsion_of_a_thin_rectangle_against_the_published_table():
    """Timoshenko and Goodier, art. 109: tau = T / (0.246 a b^2) for sides 2:1."""
    scene, eq = cantilever(moment(1e-2, 0, 0), section=rectangle(0.02, 0.01))
    np.testing.assert_allclose(
        rod_strength(scene, eq).shear, 1e-2 / (0.246 * 0.02 * 0.01**2), rtol=1e-3
    )


def test_limits_belong_to_the_material_that_explains_the_stiffness():
    other = Material(1e9, 0.3, elastic_limit=1.0)
    scene, eq = cantilever(force(1.0, 0, 0))
    np.testing.assert_array_equal(rod_strength(scene, eq, [other, MATERIAL]).limit, 4e7)
    unknown = rod_strength(scene, eq, [other])
    assert np.isnan(unknown.limit).all() and unknown.largest is None
    assert unknown.to_dict()["equivalent_stress"] == pytest.approx(1 / SECTION.area, rel=1e-6)


def test_rods_without_section_have_no_stress():
    builder = SceneBuilder()
    bodies = builder.bodies([[0, 0, 0], [1, 0, 0]])
    builder.rod(builder.nodes(bodies), np.ones(6), length=1.0)
    builder.pin(bodies[0])
    scene = builder.build()
    found = rod_strength(scene, solve(System(scene), np.empty(0)))
    assert np.isnan(found.equivalent).all() and found.to_dict()["element"] is None


def test_a_design_brings_its_materials():
    design = design_from_dict(
        {
            "class": "c_shell",
            "name": "cross",
            "opening": {"angle": 0.2},
            "crossings": "find",
            "free_ends": True,
            "material": {"young": 2.1e9, "poisson": 0.35, "elastic_limit": 4e7},
            "section": {"type": "rectangle", "width": 0.03, "height": 0.004},
            "curves": [
                {"type": "spline", "points": points, "closed": False}
                for points in (
                    [[-1, -0.3], [0, -0.25], [1, -0.3]],
                    [[-1, 0.3], [0, 0.4], [1, 0.3]],
                    [[-0.4, -1], [-0.5, 0], [-0.4, 1]],
                    [[0.4, -1], [0.3, 0], [0.4, 1]],
                )
            ],
        }
    )
    assert materials_of(design) == (Material(2.1e9, 0.35, elastic_limit=4e7),)
    equilibria = design.deploy()
    found = design_strength(design, equilibria)
    assert set(found) == {"deployed", "rest"}
    for role, strength in found.items():
        assert len(strength.limit) == len(design.scene(role).elements)
        assert 0 <= strength.largest < 1

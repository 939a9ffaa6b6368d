"""Strength against closed forms of beam theory."""

import numpy as np
import pytest
from support.moments import BodyMoments

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import InputError
from kop_exudyn.rods.sections import (
    Material,
    circle,
    drilled,
    general,
    half_lapped,
    rectangle,
    section_from_dict,
)
from kop_exudyn.scene.builder import SceneBuilder
from kop_exudyn.scene.loads import DeadForces
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.strength import (
    design_strength,
    materials_of,
    rod_strength,
    section_stress,
)

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


def test_a_half_lap_is_a_bar_half_as_high_under_its_eccentric_force():
    """N, bending and torsion at a slotted end, by the handbook's formulas for the bar that is
    left."""
    section = half_lapped(rectangle(0.006, 0.04))
    left = section.cut
    assert left.area == pytest.approx(0.006 * 0.02) and left.centre == (0.0, -0.01)
    N, My, Mz = 120.0, 0.8, 0.3
    stress = np.array([[N, 0.0, 0.0, 0.0, My, Mz]])
    axial, normal, _, _ = section_stress(left, stress, np.array([1.0]), (0.5,))
    b, h = 0.006, 0.02
    moment = My + N * 0.01  # the force acts h / 2 above the middle of what is left
    wanted = N / (b * h) + 6 * moment / (b * h**2) + 6 * Mz / (h * b**2)
    assert axial[0] == pytest.approx(N / (b * h)) and normal[0] == pytest.approx(wanted)
    # from the whole section's own middle: eight times the stress of the uncut bar under a force
    alone = section_stress(left, stress * [1, 0, 0, 0, 0, 0], np.array([1.0]))[1]
    assert alone[0] == pytest.approx(8 * N / (0.006 * 0.04))


def test_a_hole_leaves_the_edges():
    section = drilled(rectangle(0.03, 0.004), 0.006)
    Mz = 0.5
    stress = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, Mz]])
    normal = section_stress(section.cut, stress, np.array([1.0]))[1]
    assert normal[0] == pytest.approx(Mz * 0.015 / (0.004 * (0.03**3 - 0.006**3) / 12))
    with pytest.raises(InputError, match="joint_hole"):
        drilled(rectangle(0.03, 0.004), 0.03)


@pytest.mark.parametrize(
    "fields, factor",
    [({"half_lap": False}, 1.0), ({}, 4.0), ({"joint_hole": 0.003}, 0.006 / 0.003)],
)
def test_design_files_say_how_joints_are_cut(fields, factor):
    """In-plane bending of a grid's lamella: the section modulus of what is left at its joints."""
    given = {"type": "rectangle", "width": 0.006, "height": 0.04, **fields}
    section = section_from_dict(given, half_lap=True)
    left = section.cut or section
    stress = np.array([[0.0, 0.0, 0.0, 0.0, 1.0, 0.0]])
    whole = section_stress(section, stress, np.array([1.0]))[1]
    assert section_stress(left, stress, np.array([1.0]))[1] == pytest.approx(factor * whole)
    with pytest.raises(InputError, match="slot or a hole"):
        section_from_dict({**given, "half_lap": True, "joint_hole": 0.001})


def test_only_ends_at_joints_are_weakened():
    """A cantilever clamped at its second end: cut there, its largest stress is that of what is
    left; cut at the free end, nothing changes."""
    section = half_lapped(rectangle(0.006, 0.04))
    stress = {}
    for cut in ((False, False), (True, False), (False, True)):
        builder = SceneBuilder()
        bodies = builder.bodies([[0, 0, 0], [0.5, 0, 0], [1, 0, 0]])
        stiffness = section.stiffness(MATERIAL)
        builder.rod(builder.nodes(bodies), stiffness, length=1.0, section=section, cut=cut)
        builder.pin(int(bodies[2]))
        builder.term(DeadForces([bodies[0]], [[0.0, 0.0, -1e-3]]))
        scene = builder.build()
        stress[cut] = rod_strength(scene, solve(System(scene), np.empty(0)))
    none, free, clamped = stress.values()
    assert free.normal.max() == pytest.approx(none.normal.max(), rel=1e-6)
    assert clamped.normal.max() == pytest.approx(4 * none.normal.max(), rel=1e-3)
    np.testing.assert_array_equal(clamped.normal[0], none.normal[0])


def test_grids_and_shells_are_cut_at_their_joints_only(shells):
    for design in shells[:1]:
        scene = design.scene("deployed")
        for chain in scene.chains:
            at = np.isin(scene.node_body[chain.nodes[[0, -1]]], design.joints)
            assert chain.cut == tuple(at)

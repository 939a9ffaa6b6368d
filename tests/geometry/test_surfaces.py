"""Surfaces: exact derivatives, textbook curvatures, meshes followed by smooth surfaces, and traced
curves."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.exchange.polygons import write_mesh_obj
from kop_exudyn.geometry.mesh_surface import MeshSurface, load_mesh_surface
from kop_exudyn.geometry.surface_tracing import Domain, asymptotic_line, curvature_line, geodesic
from kop_exudyn.geometry.surfaces import FAMILIES, AnalyticSurface

COEFFICIENTS = {
    "sphere": {"radius": 1.3},
    "torus": {"radius": 2.0, "tube": 0.7},
    "cylinder": {"radius": 0.8},
    "paraboloid": {"a": 0.6, "b": -0.4},
    "hypar": {"c": 0.7},
    "enneper": {"scale": 1.2},
    "catenoid": {"scale": 0.9},
    "helicoid": {"scale": 0.6},
    "scherk": {"scale": 1.5},
    "pseudosphere": {"scale": 1.1},
    "polynomial": {"coefficients": [[0.1, 0.0, 0.3], [0.2, -0.5], [0.4]]},
    "gaussians": {"bumps": [[0.5, 0.2, 0.1, 0.6], [-0.3, -0.4, 0.5, 0.8]]},
}
POINTS = np.random.default_rng(1).uniform(0.2, 0.8, (20, 2))


def surface(name: str) -> AnalyticSurface:
    return AnalyticSurface(name, COEFFICIENTS[name])


def bumpy_mesh(n: int = 31, overhang: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A triangulated height field over [-1, 1]^2, n x n vertices; its border may be pulled in below
    itself."""
    x, y = (
        a.ravel() for a in np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    )
    z = 0.4 * np.cos(1.5 * x) * np.cos(y) + 0.1 * x * y
    angle = overhang * np.hypot(x, y)
    if overhang:
        r = np.sin(angle) / np.maximum(angle, 1e-9) * overhang
        x, y, z = r * x, r * y, np.cos(angle)
    k = np.arange(n * n).reshape(n, n)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    return np.column_stack([x, y, z]), np.concatenate(
        [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
    )


@pytest.mark.parametrize("name", sorted(FAMILIES))
def test_derivatives_follow_taylor(name):
    s, direction = surface(name), np.array([0.6, -0.8])
    x, first, second = s.derivatives(POINTS)
    errors = []
    for h in (2e-2, 1e-2):
        taylor = (
            x
            + h * first @ direction
            + 0.5 * h * h * np.einsum("niab,a,b->ni", second, direction, direction)
        )
        errors.append(np.abs(s.points(POINTS + h * direction) - taylor).max())
    assert errors[1] < 1e-13 or errors[0] / errors[1] > 6  # third order


@pytest.mark.parametrize("name", ["enneper", "catenoid", "helicoid", "scherk"])
def test_minimal_surfaces_have_no_mean_curvature(name):
    local = surface(name).at(POINTS)
    assert (local.gauss < -1e-3).all()
    np.testing.assert_allclose(local.mean, 0, atol=1e-12)


def test_constant_curvatures():
    np.testing.assert_allclose(surface("sphere").at(POINTS).gauss, 1.3**-2, rtol=1e-12)
    # normal outwards
    np.testing.assert_allclose(surface("sphere").at(POINTS).mean, -1 / 1.3, rtol=1e-12)
    np.testing.assert_allclose(surface("pseudosphere").at(POINTS).gauss, -(1.1**-2), rtol=1e-11)
    np.testing.assert_allclose(surface("cylinder").at(POINTS).gauss, 0, atol=1e-14)
    np.testing.assert_allclose(surface("cylinder").at(POINTS).mean, -0.5 / 0.8, rtol=1e-13)


@given(u=st.floats(-0.9, 0.9), v=st.floats(-0.9, 0.9), angle=st.floats(0, np.pi))
@settings(max_examples=40, deadline=None)
def test_euler_relates_normal_curvatures_to_principal_ones(u, v, angle):
    local = surface("gaussians").at([[u, v]])
    (low, high), directions = local.principal()[0][0], local.principal()[1][0]
    turned = directions @ np.array([np.cos(angle), np.sin(angle)])
    expected = low * np.cos(angle) ** 2 + high * np.sin(angle) ** 2
    assert local.normal_curvatures(turned[None])[0] == pytest.approx(expected, abs=1e-12)


def test_unusable_surfaces_are_refused():
    with pytest.raises(InputError, match="unknown surface"):
        AnalyticSurface("klein_bottle")
    with pytest.raises(InputError, match="surface.radius.*missing"):
        AnalyticSurface("sphere", {})
    with pytest.raises(InputError, match="surface.radius.*positive"):
        AnalyticSurface("sphere", {"radius": -1.0})
    with pytest.raises(InputError, match="surface.tube.*no coefficient"):
        AnalyticSurface("sphere", {"radius": 1.0, "tube": 1.0})
    with pytest.raises(InputError, match=r"surface.bumps\[0\]"):
        AnalyticSurface("gaussians", {"bumps": [[1.0, 2.0]]})
    with pytest.raises(InputError, match="no tangent plane"):
        AnalyticSurface("paraboloid", {"a": 1e200, "b": 1e200}).at([[1e200, 1e200]])
    with pytest.raises(InputError, match="no tangent plane"):
        AnalyticSurface("scherk", {"scale": 1.0}).at([[2.0, 0.0]])
    with pytest.raises(InputError, match="outside"):
        surface("pseudosphere").at([[-1.0, 0.0]])


# -- meshes ------------------------------------------------------------------------------------
def test_mesh_surface_has_the_curvatures_of_the_surface_it_was_sampled_from():
    mesh = MeshSurface(*bumpy_mesh())
    assert mesh.deviation < 1e-4
    u, v = (POINTS - 0.5).T
    zx, zy = (
        -0.6 * np.sin(1.5 * u) * np.cos(v) + 0.1 * v,
        -0.4 * np.cos(1.5 * u) * np.sin(v) + 0.1 * u,
    )
    zxx, zyy = -0.9 * np.cos(1.5 * u) * np.cos(v), -0.4 * np.cos(1.5 * u) * np.cos(v)
    zxy = 0.6 * np.sin(1.5 * u) * np.sin(v) + 0.1
    gauss = (zxx * zyy - zxy**2) / (1 + zx**2 + zy**2) ** 2
    np.testing.assert_allclose(mesh.at(POINTS - 0.5).gauss, gauss, atol=0.01)


def test_conformal_chart_takes_an_overhanging_mesh():
    # a spherical patch down to below its equator at the corners
    vertices, faces = bumpy_mesh(overhang=1.3)
    with pytest.raises(InputError, match="folds over"):
        MeshSurface(vertices, faces)
    sphere = MeshSurface(vertices, faces, chart="conformal")
    middle = sphere.at(np.random.default_rng(2).uniform(-0.5, 0.5, (20, 2)))
    np.testing.assert_allclose(middle.gauss, 1.0, rtol=0.04)
    cosine = middle.metric[:, 0, 1] / np.sqrt(middle.metric[:, 0, 0] * middle.metric[:, 1, 1])
    np.testing.assert_allclose(cosine, 0, atol=0.02)
    assert (middle.first[:, 0, 0] > 0).all()  # u follows x


def test_mesh_surface_knows_its_border():
    mesh = MeshSurface(*bumpy_mesh())
    assert mesh.contains(np.array([[0.0, 0.0], [1.0, -1.0], [1.01, 0.0]])).tolist() == [
        True,
        True,
        False,
    ]
    with pytest.raises(InputError, match="outside"):
        mesh.at([[1.2, 0.0]])


def test_rough_meshes_are_refused():
    vertices, faces = bumpy_mesh(15)
    vertices[:, 2] += np.random.default_rng(0).uniform(-0.2, 0.2, len(vertices))
    with pytest.raises(InputError, match="too rough"):
        MeshSurface(vertices, faces)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl"])
def test_mesh_files_give_the_same_surface(tmp_path, suffix):
    vertices, faces = bumpy_mesh(15)
    trimesh.Trimesh(vertices, faces, process=False).export(tmp_path / f"patch{suffix}")
    loaded = load_mesh_surface(tmp_path / f"patch{suffix}")
    np.testing.assert_allclose(
        loaded.points(POINTS), MeshSurface(vertices, faces).points(POINTS), atol=1e-6
    )


def test_unreadable_mesh_files_are_named(tmp_path):
    (tmp_path / "bad.ply").write_bytes(b"ply\nformat nonsense\n")
    for name, message in (
        ("none.obj", "no such file"),
        ("bad.ply", "cut off"),
        ("a.txt", "no mesh file"),
    ):
        with pytest.raises(InputError, match=message):
            load_mesh_surface(tmp_path / name)


# -- traced curves -----------------------------------------------------------------------------
def test_geodesics_of_a_sphere_are_great_circles():
    s = surface("sphere")
    line = geodesic(Domain(s, [-0.9, -0.9], [0.9, 0.9]), [0.3, -0.2], 0.7)
    x = s.points(line)
    assert np.abs(x @ np.linalg.svd(x)[2][2]).max() < 1e-7  # in a plane through the centre
    assert np.abs(np.abs(line[[0, -1]]).max(axis=1) - 0.9).max() < 1e-9  # from border to border


@given(angle=st.floats(0.2, 1.3))
@settings(max_examples=10, deadline=None)
def test_geodesics_of_a_cylinder_are_straight_in_its_development(angle):
    line = geodesic(Domain(surface("cylinder"), [-1, -1], [1, 1]), [0.1, 0.2], angle)
    np.testing.assert_allclose((line - [0.1, 0.2]) @ [-np.sin(angle), np.cos(angle)], 0, atol=1e-9)


@pytest.mark.parametrize("family", [0, 1])
def test_asymptotic_lines_of_the_enneper_surface_are_diagonals(family):
    s = surface("enneper")
    line = asymptotic_line(Domain(s, [-0.6, -0.6], [0.6, 0.6]), [0.1, 0.05], family)
    conserved = (line @ [1.0, -1.0], line @ [1.0, 1.0])
    assert min(np.ptp(c) for c in conserved) < 1e-9 and max(np.ptp(c) for c in conserved) > 1
    assert np.abs(s.at(line).normal_curvatures(np.gradient(line, axis=0))).max() < 1e-6


def test_the_two_asymptotic_families_differ():
    domain = Domain(surface("hypar"), [-1, -1], [1, 1])
    a, b = (asymptotic_line(domain, [0.2, 0.3], family) for family in (0, 1))
    # the straight lines of u and of v
    assert {np.ptp(a, axis=0).argmin(), np.ptp(b, axis=0).argmin()} == {0, 1}


def test_curvature_lines_of_a_torus_are_its_circles():
    domain = Domain(surface("torus"), [-1, -1], [1, 1])
    lines = [curvature_line(domain, [0.1, 0.2], family) for family in (0, 1)]
    assert [np.ptp(line, axis=0).min() < 1e-8 for line in lines] == [True, True]


def test_tracing_needs_directions():
    with pytest.raises(InputError, match="Gaussian curvature"):
        asymptotic_line(Domain(surface("sphere"), [-1, -1], [1, 1]), [0.1, 0.2], 0)
    with pytest.raises(InputError, match="umbilic"):
        curvature_line(
            Domain(AnalyticSurface("paraboloid", {"a": 1, "b": 1}), [-1, -1], [1, 1]), [0, 0], 0
        )
    with pytest.raises(InputError, match="outside the domain"):
        geodesic(Domain(surface("sphere"), [-1, -1], [1, 1]), [2, 0], 0.0)
    with pytest.raises(InputError, match="network.domain"):
        Domain(surface("sphere"), [1, -1], [-1, 1])


def test_asymptotic_lines_end_where_the_curvature_changes_sign():
    torus = surface("torus")
    line = asymptotic_line(Domain(torus, [-1, 0], [1, np.pi]), [0.0, 2.5], 0)
    assert line[:, 1].min() > np.pi / 2 - 1e-3 and (torus.at(line).gauss < 1e-3).all()


def test_sheets_above_each_other_are_refused():
    """The surface went between them, where nothing is drawn."""
    vertices, faces = bumpy_mesh()
    both = np.concatenate([vertices, vertices - [0, 0, 0.02]])
    with pytest.raises(InputError, match="two sheets above each other, seen along z"):
        MeshSurface(both, np.concatenate([faces, faces + len(vertices)]))
    beside = np.concatenate([vertices, vertices + [3.0, 0, 0]])  # which hides nothing
    assert MeshSurface(beside, np.concatenate([faces, faces + len(vertices)])).contains([[0, 0]])


def test_what_is_no_sheet_is_named_with_its_place(tmp_path):
    vertices, faces = bumpy_mesh()
    side = np.concatenate([vertices, [[0.0, 0.0, 5.0], [0.1, 0.0, 5.0], [0.0, 0.0, 6.0]]])
    n = len(vertices)
    write_mesh_obj(tmp_path / "fin.obj", side + 100.0, np.concatenate([faces, [[n, n + 1, n + 2]]]))
    with pytest.raises(InputError) as caught:
        load_mesh_surface(tmp_path / "fin.obj", scale=2.0, origin=np.full(3, 50.0))
    said = str(caught.value)
    assert "surface.file = 'fin.obj'" in said and "near (100.033, 100, 105.333)" in said
    assert "1 of its" in said and "without sides" in said and "conformal" not in said

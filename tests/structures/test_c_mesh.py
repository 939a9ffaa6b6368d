"""Grids that are C-meshes, which collapse to a straight strip."""

from __future__ import annotations

from support.grids import CYLINDER, SADDLE, grid_data, isolines, lines

from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.grid.c_mesh import c_mesh_residuals

PSEUDOSPHERE = grid_data(
    {"name": "pseudosphere", "scale": 1.0},
    {
        "type": "asymptotic",
        "domain": [[0.4, -0.6], [1.6, 0.6]],
        "points": [[1.0, s] for s in lines(0.3, 4)],
    },
)


def c_mesh(data):
    grid = design_from_dict(data)
    return c_mesh_residuals(grid.surface, grid.network.joints, grid.straight.lamellas)


def test_asymptotic_lines_of_the_pseudosphere_collapse_to_a_straight_strip():
    residuals = c_mesh(PSEUDOSPHERE)
    assert residuals.collapses and residuals.chebyshev < 1e-6 and residuals.gauss < 1e-6


def test_spheres_and_free_forms_do_not():
    sphere = c_mesh(grid_data({"name": "sphere", "radius": 1.0}, isolines(0.4, 4)))
    assert sphere.gauss < 1e-12 and not sphere.collapses  # the curvature is constant, sides differ
    bumps = {"name": "gaussians", "bumps": [[0.2, 0.0, 0.1, 0.4]]}
    free = c_mesh(grid_data(bumps, isolines(0.5, 4)))
    assert free.gauss > 0.1 and not free.collapses


def test_users_are_told_what_may_collapse_unless_joints_are_held():
    (told,) = design_from_dict(CYLINDER).cautions
    assert "collapse to a flat strip" in told and '"held"' in told
    assert design_from_dict(CYLINDER | {"held": "corners"}).cautions == []
    assert design_from_dict(SADDLE).cautions == []

"""Umbrella designs of our own: patches, the rule for arm lengths, and the committed models."""

from __future__ import annotations

import importlib.util
import json
import sys

import numpy as np
import pytest

from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.errors import InputError
from kop_exudyn.files.documents import check_schema
from kop_exudyn.geometry.triangles import TriangleSurface
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures.fitting import TargetFitting
from kop_exudyn.structures.strength import design_strength
from kop_exudyn.structures.umbrella.generator import (
    design_on_surface,
    height_field,
    hexagon_patch,
    parallelogram_patch,
    parametric_patch,
    triangle_patch,
)
from kop_exudyn.structures.umbrella.layout import BaseMesh, Plates

EDGE = 30 + 3 * np.sqrt(3)
MODELS = ["dome", "hill", "monkey", "oval", "saddle", "wave"]


@pytest.mark.parametrize(
    "patch, n_cells, n_edges",
    [
        (hexagon_patch(1, EDGE), 6, 6),
        (hexagon_patch(2, EDGE), 24, 30),
        (parallelogram_patch(4, 3, EDGE), 24, 29),
        (triangle_patch(5, EDGE), 25, 30),
    ],
)
def test_patches_are_lattices_of_equilateral_triangles(patch, n_cells, n_edges):
    base = BaseMesh(*patch)
    assert len(base.faces) == n_cells and len(base.inner) == n_edges
    assert base.edge == pytest.approx(EDGE)
    assert np.allclose(base.vertices.mean(axis=0), 0)


def test_on_a_plane_all_cells_grow_alike_and_follow_the_rule():
    base, plates = BaseMesh(*hexagon_patch(1, EDGE)), Plates()
    data = design_on_surface(
        "flat",
        base,
        *height_field(lambda x, y: 0.1 * x, 1000.0, 10),
        plates=plates,
        least_growth=4.5,
    )
    check_schema(data, "umbrella")
    expected = np.sqrt((4.5 * EDGE / np.sqrt(12) - 30 / np.sqrt(12)) ** 2 + 6.0**2)
    assert np.array(data["lengths"]) == pytest.approx(expected, abs=1e-3)
    spans = np.linalg.norm(np.diff(np.array(data["target"]["plates"])[[0, 2]], axis=0))
    assert spans == pytest.approx(4.5 * EDGE / np.sqrt(3) * np.sqrt(3), rel=1e-3)


def test_growth_on_a_sphere_is_that_of_the_stereographic_projection():
    def sphere(u, v):
        """Stereographic, radius 1000."""
        rr = u**2 + v**2
        return 2000 * u / (1 + rr), 2000 * v / (1 + rr), 1000 * (1 - rr) / (1 + rr)

    base = BaseMesh(*hexagon_patch(2, EDGE))
    data = design_on_surface("sphere", base, *parametric_patch(sphere, 36))
    lengths = np.array(data["lengths"])[:, 0]
    growth = (np.sqrt(lengths**2 - 6.0**2) + 30 / np.sqrt(12)) / (EDGE / np.sqrt(12))
    distance = np.linalg.norm(base.centres, axis=1)
    inner, outer = distance < distance.min() * 1.01, distance > distance.max() * 0.99
    assert growth.min() == pytest.approx(4.0, abs=1e-3)
    ratio = growth[outer].mean() / growth[inner].mean()

    def projected(radius):  # radius in the base plane, where the middle grows by `growth[inner]`
        return 1 / (1 + (radius * growth[inner].mean() / 2000) ** 2)

    assert ratio == pytest.approx(projected(distance.max()) / projected(distance.min()), rel=5e-3)


def test_a_patch_too_large_for_its_surface_is_refused():
    with pytest.raises(InputError, match="beyond the surface"):
        design_on_surface(
            "flat", BaseMesh(*hexagon_patch(3, EDGE)), *height_field(lambda x, y: 0 * x, 500.0, 6)
        )


@pytest.fixture(scope="module")
def script(repository):
    path = repository / "models" / "umbrellas" / "make.py"
    spec = importlib.util.spec_from_file_location("make_umbrellas", path)
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)  # for its dataclass
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("folder, table", [("umbrellas", "DESIGNS"), ("umbrellas_large", "LARGE")])
def test_the_script_makes_every_model(script, repository, folder, table):
    files = list((repository / "models" / folder).glob("*.json"))
    assert sorted(path.stem for path in files) == sorted(getattr(script, table))
    assert all(path.stat().st_size < 200_000 for path in files)


# the quickest two: fitting them takes longer than all else
@pytest.mark.parametrize("name", ["dome", "hill"])
def test_models_are_what_the_script_writes(script, repository, name):
    made = script.make(name)
    written = json.loads(
        (repository / "models" / "umbrellas" / f"{name}.json").read_text(encoding="utf-8")
    )
    assert np.allclose(written["lengths"], made["lengths"], atol=0.02)
    assert np.allclose(written["target"]["crossings"], made["target"]["crossings"], atol=0.02)
    assert written["base"]["faces"] == made["base"]["faces"]
    assert (
        written["materials"] == made["materials"] and made["materials"]["arms"]["density"] == 9e-10
    )


def test_large_models_are_large(repository):
    files = (repository / "models" / "umbrellas_large").glob("*.json")
    cells = [len(json.loads(path.read_text(encoding="utf-8"))["lengths"]) for path in files]
    assert min(cells) >= 80 and max(cells) == 150


@pytest.mark.parametrize(
    "name", [*(f"umbrellas/{name}" for name in MODELS), "umbrellas_large/pinned_ridge"]
)
def test_models_deploy_stably_near_their_target(repository, name):
    design = load_design(repository / "models" / f"{name}.json")
    assert 24 <= design.mesh.n_cells <= 150
    state = design.deployed
    assert state.stable
    assert design.spacings(state.state) == pytest.approx(15.0, rel=0.02)
    fit = TargetFitting(design.target, 0.1)(state.state.positions[design.joints])
    assert fit.max_percent < 0.25 and fit.mean_percent < 0.11
    confirmation = confirm(design.scene(), state)
    assert confirmation.residual < 1e-6
    strength = design_strength(design, {"deployed": state})["deployed"]
    assert np.isfinite(strength.limit).all() and 0.2 < strength.largest < 0.6


@pytest.mark.parametrize("n", [1, 2, 30])
def test_a_coarse_surface_keeps_the_faces_below_the_design(n):
    """However large faces are: those that reach below the patch are its target."""
    vertices, faces = height_field(lambda x, y: -(x**2 + y**2) / 2000, 900.0, n)
    base = BaseMesh(*hexagon_patch(1, 30 + np.sqrt(3) * Plates().thickness))
    data = design_on_surface("coarse", base, vertices, faces, plates=Plates())
    target = TriangleSurface(data["target"]["vertices"], data["target"]["faces"])
    apart = np.sqrt(target.closest(np.array(data["target"]["crossings"])).squared_distances)
    assert apart.max() < 1e-2
    assert np.abs(np.array(data["target"]["crossings"]).mean(axis=0)[:2]).max() < 30.0

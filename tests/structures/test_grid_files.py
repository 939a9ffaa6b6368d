"""Files of grids: the shipped designs, bad input, meshes beside the design, fitted lengths and
angles."""

from __future__ import annotations

import json

import numpy as np
import pytest
from support.grids import SADDLE

from kop_exudyn.errors import InputError
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.fitting import TargetFitting


def test_shipped_designs_keep_to_their_surfaces(repository):
    designs = [
        *load_designs(repository / "models" / "grids"),
        *load_designs(repository / "models" / "grids_hard"),
    ]
    assert len(designs) >= 9
    for design in designs:
        state = design.deploy()["deployed"]
        fit = TargetFitting(design.target)(state.state.positions[design.joints])
        assert state.stable and fit.max_percent < 0.01, design.name


@pytest.mark.parametrize(
    "change, field",
    [
        ({"surface": {"type": "analytic", "name": "dodecahedron"}}, "surface.name"),
        ({"surface": {"type": "analytic", "name": "sphere", "radius": 0}}, "surface.radius"),
        ({"surface": {"type": "analytic"}}, "surface"),
        ({"surface": {"type": "analytic", "name": "sphere", "radius": "1"}}, "surface"),
        ({"surface": {"type": "mesh", "file": "missing.obj"}}, "surface.file"),
        ({"surface": {"type": "mesh", "file": "x.obj", "expression": "x*y"}}, "surface"),
        ({"network": {"type": "isolines", "u": [0, 0.2], "v": [0.2, 0.1]}}, "network.v"),
        ({"network": {"type": "isolines", "u": [0, 0.2]}}, "network"),
        ({"network": {"type": "hexagons"}}, "network.type"),
        (
            {
                "network": {
                    "type": "geodesics",
                    "domain": [[-1, -1], [1, 1]],
                    "through": [[0, 2, 0.0], [0, 0, 1.0]],
                }
            },
            "network.through[0]",
        ),
        (
            {"network": {"type": "asymptotic", "domain": [[1, -1], [-1, 1]], "points": [[0, 0]]}},
            "network.domain",
        ),
        (
            {
                "network": {
                    "type": "curves",
                    "curves": [{"points": [[0, 0], [1, 0]]}, {"points": [[0, 1], [1, 1]]}],
                }
            },
            "network.curves[0].points: crosses no other",
        ),
        (
            {
                "network": {
                    "type": "curves",
                    "curves": [{"points": [[0, 0], [1, y]]} for y in (0, 1, 2)],
                }
            },
            "network.curves[2].points: passes through one point (0, 0) with "
            "network.curves[0].points, network.curves[1].points",
        ),
        ({"elements_per_piece": 0}, "elements_per_piece"),
        ({"sections": 3}, "sections"),
    ],
)
def test_bad_design_files_are_named_with_their_field(write_json_file, change, field):
    with pytest.raises(InputError) as caught:
        load_design(write_json_file("bad.json", {**SADDLE, **change}))
    assert "bad.json" in str(caught.value) and field in str(caught.value)
    assert "\n" not in str(caught.value)


def test_mesh_files_lie_beside_the_design(write_json_file, tmp_path):
    side = np.linspace(-0.6, 0.6, 13)
    x, y = (a.ravel() for a in np.meshgrid(side, side, indexing="ij"))
    k = np.arange(169).reshape(13, 13)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4) + 1
    rows = [f"v {a} {b} {0.45 * a * a - 0.35 * b * b}" for a, b in zip(x, y)]
    rows += [f"f {a} {b} {c}\nf {a} {c} {d}" for a, b, c, d in quads]
    (tmp_path / "patch.obj").write_text("\n".join(rows))
    path = write_json_file(
        "meshed.json", {**SADDLE, "surface": {"type": "mesh", "file": "patch.obj"}}
    )
    grid, exact = load_design(path), design_from_dict(SADDLE)
    lengths = exact.straight.numbering.is_length
    np.testing.assert_allclose(grid.parameters[lengths], exact.parameters[lengths], rtol=1e-3)
    np.testing.assert_allclose(grid.parameters[~lengths], exact.parameters[~lengths], atol=2e-3)
    beyond = json.loads(path.read_text())
    beyond["network"]["u"] = [-0.9, 0.0, 0.4]
    with pytest.raises(InputError, match="leaves the surface"):
        load_design(write_json_file("beyond.json", beyond))


def test_lengths_and_angles_of_a_fitted_grid_replace_those_of_its_curves(repository):
    file = repository / "models" / "grids" / "05_free_form.json"
    data = json.loads(file.read_text(encoding="utf-8"))
    values = data["straightened"]
    fitted = design_from_dict(data, str(file))
    drawn = design_from_dict({k: v for k, v in data.items() if k != "straightened"}, str(file))
    numbering = fitted.straight.numbering
    assert numbering.split(fitted.parameters, digits=7) == values
    lengths = fitted.parameters[numbering.is_length]
    assert not np.array_equal(lengths, drawn.parameters[numbering.is_length])
    off = [
        TargetFitting(grid.target, 0.1)(
            grid.deploy()["deployed"].state.positions[grid.joints]
        ).max_percent
        for grid in (fitted, drawn)
    ]
    assert off[0] < 0.01 < 0.2 < off[1]

    def refused(match, **changes):
        with pytest.raises(InputError, match=match):
            design_from_dict(data | {"straightened": values | changes}, str(file))

    refused(r"straightened.lengths.*have \d+ lengths", lengths=values["lengths"][1:])
    refused(r"straightened.angles.*have \d+ angles", angles=[*values["angles"], 0.0])
    refused(r"must be positive", lengths=[-0.1, *values["lengths"][1:]])


def test_ends_beyond_the_last_joint_may_overhang_the_surface(write_json_file, tmp_path):
    """They are left out of the grid; only what is built has to lie on the roof."""
    t = np.linspace(0.0, 2.0, 9)
    x, y = (values.ravel() for values in np.meshgrid(t, t, indexing="ij"))
    rows = [f"v {a} {b} {0.2 * a * b}" for a, b in zip(x, y)]
    faces = [(9 * i + j + 1, 9 * i + j + 10, 9 * i + j + 11) for i in range(8) for j in range(8)]
    rows += [f"f {a} {b} {c}\nf {a} {c} {c - 9}" for a, b, c in faces]
    (tmp_path / "roof.obj").write_text("\n".join(rows))

    def laths(over: float, first: float) -> dict:
        ends = [[[-over, k], [2 + over, k]] for k in (first, 1.0, 1.9)]
        both = [*ends, *([p[::-1] for p in pair] for pair in ends)]
        return {"type": "curves", "curves": [{"type": "polyline", "points": p} for p in both]}

    surface = {"type": "mesh", "file": "roof.obj"}

    def grid(network: dict) -> dict:
        return {**SADDLE, "surface": surface, "network": network}

    over = load_design(write_json_file("over.json", grid(laths(0.3, 0.1))))
    flush = load_design(write_json_file("flush.json", grid(laths(0.0, 0.1))))
    np.testing.assert_allclose(over.parameters, flush.parameters, atol=1e-9)
    with pytest.raises(InputError, match="leaves the surface"):
        load_design(write_json_file("off.json", grid(laths(0.3, -0.1))))

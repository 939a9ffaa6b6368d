"""Lamellas and what lies over what: read back from assembly plans."""

import numpy as np
import pytest

from kop_exudyn.fabrication.assembly import assembly_plan, joint_table
from kop_exudyn.fabrication.assembly_order import assembly_steps, fasteners
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.lamellas import Lamellas
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.fabrication.placement import PlacedPieces
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.structures.base import design_from_dict


def grid():
    data = {
        "class": "grid",
        "name": "dome",
        "material": {"young": 2.1e9, "poisson": 0.35},
        "section": {"type": "rectangle", "width": 0.004, "height": 0.03},
        "surface": {"type": "analytic", "name": "paraboloid", "a": -0.5, "b": -0.3},
        "network": {"type": "isolines", "u": [-0.6, 0.0, 0.5], "v": [-0.5, 0.1, 0.6]},
    }
    return design_from_dict(data)


@pytest.fixture(scope="module")
def dome():
    design = grid()
    found = cluster(design.groups, design.parameters, {"linear": 2, "angular": 1})
    return parts_list(found.kit, found.assignment, [design])


def three_families():
    """Three sets of two lines that all cross each other: no two families."""
    turns = np.radians([0, 60, 120])
    lines = []
    for turn in turns:
        along = np.array([np.cos(turn), np.sin(turn)])
        across = np.array([-along[1], along[0]])
        lines += [
            [(-1.5 * along + d * across).tolist(), (1.5 * along + d * across).tolist()]
            for d in (-0.31, 0.42)
        ]
    return design_from_dict(
        {
            "class": "c_shell",
            "name": "kagome",
            "opening": {"angle": 0.1},
            "crossings": "find",
            "free_ends": True,
            "material": {"young": 2.1e9, "poisson": 0.35},
            "section": {"type": "rectangle", "width": 0.03, "height": 0.004},
            "curves": [{"type": "polyline", "points": points} for points in lines],
        }
    )


def test_lamellas_are_the_designs_curves(parts, shells):
    placed = PlacedPieces.of(parts.designs[0])
    lamellas = Lamellas(placed).all
    strands = shells[0].network.strands
    found = [[placed.joint_of(p) - 1 for p in lamella.straight] for lamella in lamellas]
    assert sorted(found) == sorted(strand.joints.tolist() for strand in strands)
    assert all(len(lamella.pieces) == 2 * len(lamella.straight) - 1 for lamella in lamellas)


def test_one_family_is_lower_and_its_slots_open_upwards(dome):
    rows = [row for row in assembly_plan(dome, "dome", "m") if row["kind"] == "linear"]
    of = {}
    for row in rows:
        assert row["slot"] == {"lower": "up", "upper": "down"}[row["layer"]]
        of.setdefault(row["lamella"], set()).add(row["layer"])
    assert all(len(layers) == 1 for layers in of.values())
    joints = {}
    for row in rows:
        joints.setdefault(row["joint"], []).append(row)
    for pair in joints.values():
        assert {row["layer"] for row in pair} == {"lower", "upper"}
        assert pair[0]["crosses"] == pair[1]["lamella"] and pair[1]["crosses"] == pair[0]["lamella"]


def test_flat_strips_have_layers_but_no_slots(parts):
    rows = assembly_plan(parts, "first", "m")
    assert not any("slot" in row for row in rows)
    assert {row["layer"] for row in rows if row["kind"] == "linear"} == {"lower", "upper"}


def test_where_there_are_no_families_every_joint_still_has_a_lower_and_an_upper_piece():
    design = three_families()
    found = cluster(design.groups, design.parameters, {"linear": 2, "angular": 1})
    parts = parts_list(found.kit, found.assignment, [design])
    lamellas = Lamellas(PlacedPieces.of(parts.designs[0]))
    assert not lamellas.by_family and len(lamellas.crossings) == len(design.joints) == 12
    steps = assembly_steps(Blanks(parts, "m"), "kagome")
    joined = [joint for step in steps for joint in (step.get("joints") or "").split()]
    assert sorted(map(int, joined)) == list(range(1, 13))


def test_steps_join_every_joint_once_and_lower_lamellas_come_first(dome):
    steps = assembly_steps(Blanks(dome, "m"), "dome")
    plan = {row["element"]: row for row in assembly_plan(dome, "dome", "m")}
    laid = [step for step in steps if step["action"] != "bolt together"]
    layers = [{plan[int(e)]["layer"] for e in step["elements"].split()} for step in laid]
    assert layers == [{"lower"}] * 3 + [{"upper"}] * 3
    joints = [int(j) for step in laid for j in (step["joints"] or "").split()]
    assert sorted(joints) == list(range(1, 10))
    assert [step["step"] for step in steps] == list(range(1, 13))


def test_fasteners_are_counted(parts, dome):
    joints, corners = fasteners(Blanks(parts, "m"))
    assert joints["pieces"] == 6 and joints["clamps_mm"] == pytest.approx(8.0)
    turns = sum(p.kind == "angular" for p in parts.designs[0].pieces)
    assert corners["in_first"] == 4 * turns
    (only,) = fasteners(Blanks(dome, "m"))
    assert only["item"].endswith("corners")  # lamellas in slots need no bolts at their joints


def test_the_table_of_joints_has_places_and_angles(dome):
    placed = PlacedPieces.of(dome.designs[0])
    design = placed.design
    points = placed.scene.initial.positions[design.joints]
    rows = joint_table(dome, "dome", "m", points)
    np.testing.assert_allclose(
        [[row["x_mm"], row["y_mm"], row["z_mm"]] for row in rows], 1000 * points, atol=6e-4
    )
    u = np.array([-0.6, 0.0, 0.5])
    for row, (x, y, _) in zip(rows, points):
        assert min(abs(u - x)) < 1e-9
        # tangents of the paraboloid's lines of x and of y
        first, second = np.array([1.0, 0.0, -0.5 * x]), np.array([0.0, 1.0, -0.3 * y])
        cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
        assert row["angle_deg"] == pytest.approx(np.degrees(np.arccos(abs(cosine))), abs=0.01)

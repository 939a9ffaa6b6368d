"""Cut lists, bills and assembly plans: read back by csv, counted and measured again from the
designs themselves."""

import csv
from collections import Counter

import numpy as np
import pytest
from support.umbrellas import HARDWARE

from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.assembly import assembly_plan, write_assembly_plan
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.cutlist import bill_of_pieces, cut_list, write_bill, write_cut_list
from kop_exudyn.fabrication.options import Tolerances, millimetres
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.structures.base import design_from_dict


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_cut_list_has_every_part_with_its_dimensions(parts, tmp_path):
    rows = read(write_cut_list(tmp_path / "cut.csv", Blanks(parts, "m"), Tolerances(0.25, 0.1)))
    assert [row["part"] for row in rows] == ["A1", "A2", "L1", "L2", "L3"]
    for row, angle in zip(rows[:2], parts.kit["angular"][:, 0]):
        assert float(row["angle_deg"]) == pytest.approx(np.degrees(angle), abs=1e-4)
        assert row["tolerance_deg"] == "0.1" and row["l1_mm"] == ""
    for row, (l1, l2) in zip(rows[2:], parts.kit["linear"]):
        assert float(row["l1_mm"]) == pytest.approx(1000 * l1, abs=1e-3)
        back = float(row["setback_mm"])
        assert back > 1.0 and row["tolerance_mm"] == "0.25"
        assert float(row["cut_length_mm"]) == pytest.approx(1000 * (l1 + l2) - 2 * back, abs=2e-3)
        assert float(row["hole_from_end_mm"]) == pytest.approx(1000 * l1 - back, abs=2e-3)


def test_pieces_are_those_of_the_neediest_design(parts, clustering):
    rows = cut_list(Blanks(parts, "m"))
    for row in rows:
        assert row["pieces"] == max(row["in_first"], row["in_second"])
    assert sum(row["in_first"] for row in rows) == parts.designs[0].design.n_elements
    counts = clustering.assignment.pieces(clustering.kit)
    for kind in ("linear", "angular"):
        found = [row["in_first"] + row["in_second"] for row in rows if row["kind"] == kind]
        np.testing.assert_array_equal(found, counts[kind])


def test_bills_of_subsets(parts, tmp_path):
    one, both = (bill_of_pieces(parts, names) for names in (["second"], None))
    together = bill_of_pieces(parts, together=True)
    elements = [d.design.n_elements for d in parts.designs]
    assert sum(row["pieces"] for row in one) == elements[1]
    assert sum(row["pieces"] for row in together) == sum(elements)
    assert max(elements) <= sum(row["pieces"] for row in both) <= sum(elements)
    written = read(write_bill(tmp_path / "bill.csv", parts, ["second"]))
    assert [(row["part"], int(row["pieces"])) for row in written] == [
        (row["part"], row["pieces"]) for row in one
    ]
    with pytest.raises(InputError, match="no such design"):
        bill_of_pieces(parts, ["third"])


def test_units():
    assert millimetres("in") == 25.4
    with pytest.raises(InputError, match="unknown unit"):
        millimetres("furlong")


def test_assembly_plan_builds_the_design_again(parts, tmp_path):
    """Following the plan from corner to corner along a rod gives the lengths that the scene has
    there."""
    rows = read(write_assembly_plan(tmp_path / "plan.csv", parts, "first", "m"))
    placed = parts.designs[0]
    assert [int(row["element"]) for row in rows] == list(range(1, len(placed.pieces) + 1))
    realised = parts.kit["linear"] * 1000
    scene = placed.design.scene("rest")
    q = np.zeros(len(placed.design.parameters))
    for piece in placed.pieces:
        q[list(piece.parameters)] = piece.values
    for row, piece in zip(rows, placed.pieces):
        if row["kind"] == "angular":
            turn = np.degrees(parts.kit["angular"][piece.part, 0])
            assert abs(float(row["turn_deg"])) == pytest.approx(turn, abs=1e-4)
            assert row["before"] and row["after"] and row["before"] != row["after"]
            continue
        part = realised[int(row["part"][1:]) - 1]
        for side, parameter in enumerate(piece.parameters, 1):
            length = float(row[f"side_{side}_mm"])
            assert length == pytest.approx(part[("l1", "l2").index(row[f"side_{side}"])], abs=1e-4)
            elements = scene.length_parameter == parameter
            assert scene.rest_lengths(q)[elements].sum() * 1000 == pytest.approx(length, abs=1e-4)
            assert row[f"side_{side}_towards"].startswith("corner")


def test_every_corner_is_met_from_two_sides(parts):
    rows = assembly_plan(parts, "second", "m")
    corners = {row["element"]: row for row in rows if row["kind"] == "angular"}
    met = Counter()
    for row in rows:
        for side in ("side_1_towards", "side_2_towards"):
            if row.get(side):
                number = int(row[side].split()[1])
                assert str(row["element"]) in (corners[number]["before"], corners[number]["after"])
                met[number] += 1
    assert met == dict.fromkeys(corners, 2)


def test_every_joint_carries_two_beams(parts):
    joints = Counter(
        row["joint"] for row in assembly_plan(parts, "first", "m") if row["kind"] == "linear"
    )
    assert joints == {str(number): 2 for number in range(1, 7)}


def test_an_assignment_of_other_designs_is_refused(parts, clustering, shells):
    with pytest.raises(InputError, match="not of these designs"):
        parts_list(clustering.kit, clustering.assignment, shells[:1])


def test_umbrella_cells_are_sets_of_bars():
    """A triangle in the middle of three others: three arms on each side of it, one on each side of
    its neighbours."""
    s = np.sqrt(3) / 2
    design = design_from_dict(
        {
            "class": "umbrella",
            **HARDWARE,
            "name": "small",
            "lengths": [[32, 33], [34, 35], [34, 35], [34, 35]],
            "base": {
                "vertices": [
                    [40 * x, 40 * y]
                    for x, y in ((0, 0), (1, 0), (0.5, s), (0.5, -s), (1.5, s), (-0.5, s))
                ],
                "faces": [[0, 1, 2], [0, 3, 1], [1, 4, 2], [2, 5, 0]],
            },
        }
    )
    found = cluster(design.groups, design.parameters, {"cell": 2})
    parts = parts_list(found.kit, found.assignment, [design])
    rows = cut_list(Blanks(parts, "mm"))
    assert [row["part"] for row in rows] == ["C1", "C2"]
    by_length = {row["top_mm"]: row for row in rows}
    inner, outer = by_length[32.0], by_length[34.0]
    # the triangle in the middle has three arms on each side, its neighbours one each
    assert inner["pieces"] == 1 and outer["pieces"] == 3
    for side in ("top", "bottom"):
        counts = [sum(row.get(f"arms_{side}_{sort}", 0) for sort in "ab") for row in (inner, outer)]
        assert counts == [3, 3]
    plan = assembly_plan(parts, "small", "mm")
    assert plan[0]["joint"] == "1 2 3" and sorted(row["joint"] for row in plan[1:]) == [
        "1",
        "2",
        "3",
    ]

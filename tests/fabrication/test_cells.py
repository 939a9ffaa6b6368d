"""Cells as things that can be made: pins, discs and hinges, put together again on the table."""

from collections import Counter

import numpy as np
import pytest
import shapely

import kop_exudyn as kop
from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.assembly import assembly_plan
from kop_exudyn.fabrication.assembly_layout import assembly_drawing
from kop_exudyn.fabrication.assembly_order import assembly_steps, fasteners
from kop_exudyn.fabrication.assembly_pages import explanation
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.cutlist import cut_list, totals
from kop_exudyn.fabrication.cutsheets import cut_sheets
from kop_exudyn.fabrication.folder import export_workshop
from kop_exudyn.fabrication.options import CutOptions
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.fabrication.shapes import Hole, Polyline
from kop_exudyn.kit.cluster import cluster


@pytest.fixture(scope="module")
def hill(repository):
    return kop.load_design(repository / "models" / "umbrellas" / "hill.json")


@pytest.fixture(scope="module")
def parts(hill):
    found = cluster(hill.groups, hill.parameters, {"cell": 4})
    return parts_list(found.kit, found.assignment, [hill])


def test_pieces_of_every_design_add_up(hill, parts):
    """Two boards an arm, a hinge an arm, as many plates as the mesh has; by design as in all."""
    found = Blanks(parts, "mm").cells.templates()
    boards = sum(t.by_design[0] for t in found if t.label not in ("P", "E"))
    counts = {t.label: t.by_design for t in found}
    assert boards == 2 * len(hill.hardware.arms) == 2 * counts["E"][0]
    assert counts["P"] == (hill.hardware.plates,)
    assert all(t.count == max(t.by_design) for t in found)


def holes(template):
    return [shape for shape in template.shapes if isinstance(shape, Hole)]


def outline(template):
    return shapely.Polygon(template.shapes[0].points)


def of(blanks, label):
    return next(t for t in blanks.cells.templates() if t.label == label)


def test_pins_of_every_arm_are_where_the_mesh_has_its_joints(hill, parts):
    """Distance of both holes: that of the mesh's joints, their axis left out (pins run along it).

    The mesh is compact, its arms upright; the kit's arms are as long as their parts."""
    blanks = Blanks(parts, "mm")
    mesh, rods = hill.mesh, hill.mesh.rods
    kit = parts.kit["cell"]
    arms = np.flatnonzero(rods.arms)
    sorts = {t.label: t for t in blanks.cells.templates()}
    compared = 0
    for arm, data in zip(arms, hill.hardware.arms):
        at_plate, at_crossing = mesh.positions[rods.joints[arm]]
        axis = np.cross(rods.normals[arm], [0.0, 0.0, 1.0])
        between = at_crossing - at_plate
        between = between - (between @ axis) * axis
        piece = parts.designs[0].by_parameter[data.parameter]
        column = piece.columns[piece.parameters.index(data.parameter)]
        name = ("top", "bottom")[column]
        lengths = mesh.lengths[rods.cells[arm], rods.sides[arm]]
        label = f"{parts.label(piece)} {name} {'b' if data.opposite else 'a'}1"
        plate_pin, axle = holes(sorts[label])[:2]
        step = axle.centre - plate_pin.centre
        across = abs(between @ rods.normals[arm])
        assert abs(between[2]) == pytest.approx(lengths)
        assert abs(step[0]) == pytest.approx(kit[piece.part, column])
        assert abs(step[1]) == pytest.approx(across, abs=1e-6)
        compared += 1
    assert compared == len(arms) == sum(t.count for t in sorts.values() if t.label.endswith("1"))


def test_two_arms_make_a_straight_beam_about_one_axle(parts):
    """An arm and another one turned by half a turn about the axle: their discs and locking pins
    coincide, their bars lie in one line; boards 1 do not meet boards 1 but in the discs."""
    blanks = Blanks(parts, "mm")
    first, second = of(blanks, "C1 top b1"), of(blanks, "C2 bottom b1")
    axle = holes(first)[1].centre
    turned = {}
    for name, template in (("first", first), ("second", second)):
        middle = holes(template)[1].centre
        sign = 1 if name == "first" else -1
        turned[name] = [sign * (hole.centre - middle) for hole in holes(template)]
    np.testing.assert_allclose(turned["first"][1], turned["second"][1])  # the axle
    locks = {tuple(np.round(at, 9)) for at in turned["first"][2:]}
    assert locks == {tuple(np.round(at, 9)) for at in turned["second"][2:]} and len(locks) == 2
    short = of(blanks, "C1 top b2")
    assert not outline(short).intersects(
        shapely.Point(axle).buffer(3.0)
    )  # room for the other's disc
    assert short.thickness == first.thickness == 2.5


@pytest.mark.parametrize("name", ["hill", "dome", "saddle"])
def test_laid_up_as_told_the_discs_of_a_beam_lie_side_by_side(name, repository):
    """Board 1, with the disc, lies below board 2 as drawn. With the pins where the mesh has them,
    the two arms of every beam have their boards 1 on different sides; all were on the same one."""
    design = kop.load_design(repository / "models" / "umbrellas" / f"{name}.json")
    found = cluster(design.groups, design.parameters, {"cell": 2})
    parts = parts_list(found.kit, found.assignment, [design])
    drawn = {arm.label.split()[-1]: arm.offsets for arm in Blanks(parts, "mm").cells.arms}
    mesh, rods = design.mesh, design.mesh.rods
    arms = np.flatnonzero(rods.arms)
    below = []
    for arm, data in zip(arms, design.hardware.arms):
        ends = mesh.rod_ends[arm]
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        normal = rods.normals[arm] - (rods.normals[arm] @ along) * along
        normal /= np.linalg.norm(normal)
        pins = -rods.offsets[arm] @ normal  # of plate and crossing, from the rod's axis
        sides = np.sign(pins * drawn[data.sort])
        assert sides[0] == sides[1]  # as drawn, or seen from behind
        below.append(np.cross(along, -sides[0] * normal))
    beams = 0
    for joint in np.unique(rods.joints[arms, 1]):
        four = np.flatnonzero(rods.joints[arms, 1] == joint)
        axis = below[four[0]]
        places = (mesh.rod_ends[arms[four], 1] - mesh.positions[joint]) @ axis
        for beam in (four[places > 0], four[places < 0]):
            if len(beam) == 2:
                assert below[beam[0]] @ below[beam[1]] == pytest.approx(-1.0)
                beams += 1
    assert beams == len(arms) / 2


def test_holes_keep_off_the_edges(parts):
    for template in Blanks(parts, "mm").cells.templates():
        shape = outline(template)
        assert shape.is_valid
        for hole in holes(template):
            disc = shapely.Point(hole.centre).buffer(hole.diameter / 2)
            assert shape.contains(disc) and shape.exterior.distance(disc) > 0.2 * hole.diameter


def test_plates_take_arm_and_ear_at_every_edge(hill, parts):
    """The notch clears the arm's lug and the ear; the ear's pin lies on the plate's edge."""
    blanks = Blanks(parts, "mm")
    plate, ear = of(blanks, "P"), of(blanks, "E")
    shape, h = outline(plate), hill.hardware
    inradius = h.edge / (2 * np.sqrt(3))
    low = h.arm_position - h.width / 2
    lug = shapely.box(low, -inradius - 2.25, low + h.width, -inradius + 2.25)
    beside = shapely.box(low - 0.2 - 3.0, -inradius - 2.25, low - 0.2, -inradius + 2.25)
    slots = [s for s in plate.shapes[1:] if isinstance(s, Polyline)]
    assert len(slots) == 3 and plate.count == 72 and ear.count == 180
    for k in range(3):
        for thing in (lug, beside):
            around = shapely.affinity.rotate(thing, 120 * k, origin=(0, 0))
            assert shape.intersection(around).area < 1e-9
        assert shape.contains(shapely.Polygon(slots[k].points))
    tab = np.ptp(shapely.Polygon(slots[0].points).exterior.coords, axis=0)
    np.testing.assert_allclose(sorted(tab), [3.2, 3.95], atol=1e-9)  # the tab with its clearance
    assert holes(ear)[0].centre.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("clearance", [0.0, 0.2, 0.5])
def test_plates_have_no_thin_places(parts, clearance):
    """Walls beside slots were 0.45 mm, and corners hung on less than 0.8 mm."""
    blanks = Blanks(parts, "mm", CutOptions(clearance=clearance))
    plate = of(blanks, "P")
    slots = [shapely.Polygon(s.points) for s in plate.shapes[1:] if isinstance(s, Polyline)]
    assert not blanks.problems
    for slot in slots:
        assert outline(plate).exterior.distance(slot) >= 1.5
    whole = outline(plate) - shapely.union_all(slots)
    assert isinstance(whole.buffer(-0.7), shapely.Polygon)  # hangs together where 1.4 mm are left


@pytest.mark.parametrize("clearance", [1.1, 2.0, 50.0])
def test_clearances_that_leave_no_walls_are_refused(parts, clearance, tmp_path):
    """Slots ran into notches without a word; from 0.8 mm on there was a traceback."""
    options = CutOptions(clearance=clearance)
    with pytest.raises(InputError, match="walls of only|no room|too short"):
        export_workshop(parts, tmp_path / "out", "mm", options=options)
    assert not (tmp_path / "out").exists()
    export_workshop(parts, tmp_path / "out", "mm", options=options, force=True)


def test_lists_count_arms_plates_and_pins(hill, parts):
    blanks = Blanks(parts, "mm")
    rows = cut_list(blanks)
    arms = sum(v for row in rows for name, v in row.items() if name.startswith("arms_"))
    assert arms == len(hill.hardware.arms) == 180
    assert not blanks.problems and not blanks.bars and not blanks.strips
    pins = {row["item"]: row["pieces"] for row in fasteners(blanks)}
    assert list(pins.values()) == [180, 45, 180]
    assert [row["pieces"] for row in totals(blanks)] == [72, 180, 360]
    on_sheets = {}
    for sheet in cut_sheets(blanks):
        assert sheet.thickness in (3.0, 2.5)
        for label, count in sheet.labels.items():
            on_sheets[label] = on_sheets.get(label, 0) + count
    assert on_sheets == {t.label: t.count for t in blanks.cells.templates()}


def test_smaller_holes_are_taken_and_plates_without_room_are_named(parts, repository):
    small = Blanks(parts, "mm", CutOptions(joint_hole=1.0))
    assert {hole.diameter for hole in holes(of(small, "E"))} == {1.0}
    import json

    data = json.loads((repository / "models" / "umbrellas" / "hill.json").read_text())
    data["plates"] |= {"width": 12.0}
    wide = kop.design_from_dict(data)
    found = cluster(wide.groups, wide.parameters, {"cell": 2})
    blanks = Blanks(parts_list(found.kit, found.assignment, [wide]), "mm")
    assert "no room at plate edges" in blanks.problems[0]
    with pytest.raises(InputError, match="no room"):
        blanks.check()


def test_the_folder_of_a_kit_of_cells(parts, tmp_path):
    files = {path.name for path in export_workshop(parts, tmp_path, "mm", formats=["dxf"])}
    assert {"workshop.pdf", "cut_list.csv", "fasteners.csv", "joints_hill.csv"} <= files
    assert "steps_hill.csv" in files and "bars.csv" not in files


def test_which_arms_are_where_is_written_and_drawn(hill, parts):
    """Arms of one length come in two sorts. Nothing said once which of them a cell takes."""
    hardware = hill.hardware
    wanted = {arm.parameter: "ab"[arm.opposite] for arm in hardware.arms}
    plan = {row["element"]: row for row in assembly_plan(parts, "hill", "mm")}
    steps = [s for s in assembly_steps(Blanks(parts, "mm"), "hill") if "element" in s]
    texts = [label.text for label in _labels(parts)]
    used = Counter()
    for piece, step in zip(parts.designs[0].pieces, steps, strict=True):
        sorts = {wanted[p] for p in piece.parameters if p in wanted}
        assert plan[piece.element]["arms"] == "".join(sorts)
        turned = "m" if piece.variant == "mirrored" else ""
        label = parts.label(piece)
        assert f"{label}{turned}·{plan[piece.element]['arms']}\n{piece.element}" in texts
        for plate in ("upper_plate", "lower_plate"):
            number, arm = step[plate].split(" x ")
            used[arm] += int(number)
    # as many of every label as are cut
    cut = {t.label: t.by_design[0] for t in Blanks(parts, "mm").cells.templates()}
    assert used == {label[:-1]: n for label, n in cut.items() if label.endswith("1")}


def _labels(parts):
    drawing = assembly_drawing(parts, "hill", "mm")
    return drawing.labels(drawing.scale)[0]


def test_plates_are_drawn_as_seen_from_above(hill, parts):
    def turning(corners):
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        return np.sign(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])

    drawing = assembly_drawing(parts, "hill", "mm")
    np.testing.assert_array_equal(turning(drawing.cells), turning(hill.hardware.corners))
    assert "seen from above" in explanation(drawing.placed)


def test_a_beam_is_one_cells_upper_arm_and_the_others_lower_one(hill):
    """As the steps say: rods on one side of an X joint."""
    rods = hill.mesh.rods
    for joint in hill.mesh.crossings:
        arms = np.flatnonzero(rods.arms & (rods.joints[:, 1] == joint))
        for side in (True, False):
            beam = arms[rods.behind[arms, 1] == side]
            assert sorted(rods.sides[beam]) == [0, 1] and len(set(rods.cells[beam])) == 2

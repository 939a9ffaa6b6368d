"""Cut sheets measured back: DXF by ezdxf, SVG as plain XML."""

import xml.etree.ElementTree as ElementTree
from collections import Counter
from dataclasses import replace

import ezdxf
import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.cutlist import cut_list
from kop_exudyn.fabrication.cutsheets import cut_sheets, template_sheets
from kop_exudyn.fabrication.dxf import write_dxf
from kop_exudyn.fabrication.options import CutOptions
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.fabrication.placement import PlacedPieces
from kop_exudyn.fabrication.svg import write_svg
from kop_exudyn.fabrication.templates import templates
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.kit.parts import Kit
from kop_exudyn.structures.base import design_from_dict

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def documents(parts, tmp_path_factory):
    """The kit's sheets, as ezdxf reads them."""
    folder = tmp_path_factory.mktemp("sheets")
    return [
        ezdxf.readfile(write_dxf(folder / f"{n}.dxf", sheet))
        for n, sheet in enumerate(cut_sheets(Blanks(parts, "m")))
    ]


def holes_in(space, outline):
    """Circles (x, y, diameter) inside an outline's box."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    found = np.array([[*c.dxf.center.vec2, 2 * c.dxf.radius] for c in space.query("CIRCLE")])
    return found[np.all((found[:, :2] > low) & (found[:, :2] < high), axis=1)]


def labels_in(space, outline):
    low, high = outline.min(axis=0), outline.max(axis=0)
    return [
        t.dxf.text
        for t in space.query('TEXT[layer=="ENGRAVE"]')
        if np.all(
            (np.array(t.dxf.align_point.vec2) > low) & (np.array(t.dxf.align_point.vec2) < high)
        )
    ]


def outlines(space):
    return [np.array(p.get_points("xy")) for p in space.query('LWPOLYLINE[layer=="CUT"]')]


def test_files_are_sound_and_in_millimetres(documents):
    for document in documents:
        assert not document.audit().has_errors
        assert document.units == ezdxf.units.MM


def test_every_piece_is_there_as_often_as_needed(parts, documents):
    found = Counter()
    for document in documents:
        for outline in outlines(document.modelspace()):
            found[
                next(text for text in labels_in(document.modelspace(), outline) if text != "1")
            ] += 1
    needed = {
        label: n
        for kind, counts in parts.needed().items()
        for label, n in zip(parts.labels[kind], counts)
        if n
    }
    assert found == needed


def test_sheets_are_what_the_cut_list_says(parts, documents):
    """Every strip, measured: its length, its joint's and its bolts' places from the end of
    side 1."""
    rows = {row["part"]: row for row in cut_list(Blanks(parts, "m"))}
    measured = 0
    for document in documents:
        space = document.modelspace()
        for outline in outlines(space):
            texts = labels_in(space, outline)
            if "1" not in texts:
                continue
            row = rows[next(t for t in texts if t != "1")]
            low, high = outline.min(axis=0), outline.max(axis=0)
            assert np.round(high - low, 3).tolist() == [row["cut_length_mm"], 30.0]
            holes = holes_in(space, outline)
            joint = holes[np.isclose(holes[:, 2], 4.0)]
            assert np.round(joint[:, 0] - low[0], 3).tolist() == [row["hole_from_end_mm"]]
            assert joint[0, 1] == pytest.approx((low[1] + high[1]) / 2)
            bolts = np.sort(holes[np.isclose(holes[:, 2], row["bolt_hole_mm"]), 0]) - low[0]
            assert " ".join(f"{x:.3f}" for x in bolts) == row["bolts_from_end_mm"]
            measured += 1
    assert measured == parts.needed()["linear"].sum()


def test_corner_plates_measured(parts, documents):
    """The angle between the bolts of both legs is the part's; bolts fit those of the strips."""
    angles = dict(zip(parts.labels["angular"], parts.kit["angular"][:, 0]))
    strip = next(t for t in templates(Blanks(parts, "m")) if t.label == "L1")
    bolts = np.sort([s.centre[0] for s in strip.shapes if getattr(s, "diameter", None) == 3.0])[:2]
    measured = 0
    for document in documents:
        space = document.modelspace()
        for outline in outlines(space):
            texts = labels_in(space, outline)
            if texts and texts[0] in angles:
                holes = holes_in(space, outline)[:, :2]
                holes = holes[np.argsort(holes[:, 0])]
                first, second = holes[1] - holes[0], holes[3] - holes[2]
                turn = np.arctan2(first[0] * second[1] - first[1] * second[0], first @ second)
                assert turn == pytest.approx(angles[texts[0]], abs=1e-9)
                assert np.linalg.norm(first) == pytest.approx(np.diff(bolts)[0], abs=1e-9)
                measured += 1
    assert measured == parts.needed()["angular"].sum()


def test_strips_at_the_sharpest_corner_touch_but_do_not_overlap(parts):
    """Their inner corners meet: mitred ends would be as long as the axes, square ones are set
    back."""
    strip = next(s for s in Blanks(parts, "m").strips if s.label == "L1")
    angle = parts.kit["angular"].max()
    along = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-np.sin(angle), np.cos(angle)])
    before, after = [-strip.setback, 15.0], strip.setback * along + 15.0 * across
    np.testing.assert_allclose(before, after, atol=1e-9)


def test_pieces_keep_their_distance(parts):
    for sheet in cut_sheets(Blanks(parts, "m")):
        boxes = np.array([s.box for s in sheet.shapes if s.layer == "CUT" and hasattr(s, "points")])
        low, high = boxes[:, 0], boxes[:, 1]
        apart = ((low[:, None] > high[None] + 4.9) | (low[None] > high[:, None] + 4.9)).any(axis=2)
        assert (apart | np.eye(len(boxes), dtype=bool)).all()
        assert (low > 10).all() and (high < np.array(sheet.size) - 10).all()


def test_svg_agrees_with_dxf(parts, documents, tmp_path):
    for n, (sheet, document) in enumerate(zip(cut_sheets(Blanks(parts, "m")), documents)):
        root = ElementTree.parse(write_svg(tmp_path / f"{n}.svg", sheet)).getroot()
        assert root.get("width") == "1000mm" and root.get("height") == "600mm"
        assert root.get("viewBox") == "0 0 1000 600"  # so one unit is a millimetre
        cut = next(g for g in root.iter(f"{SVG}g") if g.get("id") == "CUT")
        circles = sorted(
            (float(c.get("cx")), 600 - float(c.get("cy")), 2 * float(c.get("r")))
            for c in cut.iter(f"{SVG}circle")
        )
        wanted = sorted(
            (*c.dxf.center.vec2, 2 * c.dxf.radius) for c in document.modelspace().query("CIRCLE")
        )
        np.testing.assert_allclose(circles, wanted, atol=1e-4)
        assert len(list(cut.iter(f"{SVG}polygon"))) == len(outlines(document.modelspace()))


def test_sheets_say_thickness_and_scale(documents):
    for document in documents:
        notes = [t.dxf.text for t in document.modelspace().query('TEXT[layer=="NOTES"]')]
        assert any("4 mm thick" in note for note in notes)
        bar = [p for p in document.modelspace().query('LWPOLYLINE[layer=="NOTES"]') if not p.closed]
        assert np.ptp(np.array(bar[0].get_points("xy"))[:, 0]) == pytest.approx(100.0)


def test_the_scale_bar_keeps_off_its_caption(parts):
    for size in ((1000.0, 600.0), (950.0, 200.0)):
        for sheet in cut_sheets(Blanks(parts, "m", CutOptions(sheet=size))):
            notes = [
                s for s in sheet.shapes if s.layer == "NOTES" and not getattr(s, "closed", False)
            ]
            caption = next(s for s in notes if hasattr(s, "text"))
            bars = [s for s in notes if not hasattr(s, "text")]
            assert max(bar.box[1, 1] for bar in bars) < caption.box[0, 1]
            assert caption.box[1, 0] < size[0]


def test_templates_have_one_of_each_with_its_dimensions(parts):
    (sheet,) = template_sheets(Blanks(parts, "m"))
    assert sheet.labels == {
        label: 1
        for kind, counts in parts.needed().items()
        for label, n in zip(parts.labels[kind], counts)
        if n
    }
    texts = " ".join(s.text for s in sheet.shapes if hasattr(s, "text"))
    assert f"{Blanks(parts, 'm').strips[0].cut_length:.1f} long" in texts
    assert f"{np.degrees(parts.kit['angular'][0, 0]):.2f} deg" in texts


def test_the_same_kit_gives_the_same_bytes(parts, tmp_path):
    sheet = cut_sheets(Blanks(parts, "m"))[0]
    assert (
        write_dxf(tmp_path / "a.dxf", sheet).read_bytes()
        == write_dxf(tmp_path / "b.dxf", sheet).read_bytes()
    )


def test_pieces_larger_than_a_sheet_are_refused(parts):
    with pytest.raises(InputError, match="larger than a sheet"):
        cut_sheets(Blanks(parts, "m", CutOptions(sheet=(200.0, 600.0), stock=())))


def test_holes_without_room_are_named_but_strips_can_be_had_alone(parts):
    wide = Blanks(parts, "m", CutOptions(bolt_hole=12.0))
    assert any("bolt holes of 12 mm are too wide" in problem for problem in wide.problems)
    broad = Blanks(parts, "m", CutOptions(bolt_hole=9.0, joint_hole=11.0))
    assert any("joint hole of 11 mm" in problem for problem in broad.problems)
    with pytest.raises(InputError, match="joint hole"):
        broad.check()
    alone = Blanks(parts, "m", CutOptions(bolt_hole=12.0, corners=False))
    assert not alone.problems and not alone.plates
    assert alone.strips[0].cut_length == pytest.approx(1000 * parts.kit["linear"][0].sum())


def test_sides_too_short_for_their_holes_are_named(parts):
    linear = parts.kit["linear"].copy()
    linear[1, 0] = 0.014
    short = replace(parts, kit=Kit({**parts.kit.parts, "linear": linear}))
    (problem,) = Blanks(short, "m").problems
    assert problem.startswith("part L2: its shorter side of 14.0 mm is too short for its holes")
    assert not Blanks(parts, "m").problems


@pytest.mark.parametrize("options", [{"gap": -1}, {"sheet": (0, 10)}, {"joint_hole": np.nan}])
def test_unusable_options(options):
    with pytest.raises(InputError):
        CutOptions(**options)


def test_lamellas_on_edge_get_slots():
    """Grids: the joints' axis lies in the board, so lamellas cross in slots half as deep as they
    are broad."""
    design = design_from_dict(
        {
            "class": "grid",
            "name": "dome",
            "material": {"young": 2.1e9, "poisson": 0.35},
            "section": {"type": "rectangle", "width": 0.004, "height": 0.03},
            "surface": {"type": "analytic", "name": "paraboloid", "a": -0.5, "b": -0.3},
            "network": {"type": "isolines", "u": [-0.6, 0.0, 0.5], "v": [-0.5, 0.1, 0.6]},
        }
    )
    found = cluster(design.groups, design.parameters, {"linear": 2, "angular": 1})
    parts = parts_list(found.kit, found.assignment, [design])
    blanks = Blanks(parts, "m")
    placed = PlacedPieces.of(parts.designs[0])
    angles = placed.crossing_angles(placed.scene.initial)
    sharpest = dict.fromkeys(parts.labels["linear"], np.pi / 2)
    for piece in parts.designs[0].pieces:
        if piece.kind == "linear":
            label = parts.label(piece)
            sharpest[label] = min(sharpest[label], angles[placed.joint_of(piece)])
    assert min(sharpest.values()) < np.radians(88)
    for template in templates(blanks):
        if template.label not in sharpest:
            continue
        strip = next(s for s in blanks.strips if s.label == template.label)
        slot = template.shapes[0].points[3:7]
        assert template.thickness == pytest.approx(4.0)
        assert slot[:, 0].mean() == pytest.approx(strip.hole_from_end)
        assert np.ptp(slot[:, 1]) == pytest.approx(15.0)
        # a lamella of 4 mm passes through a board of 4 mm, turned by the angle, with 0.1 mm to
        # spare on either side: the outermost of its corners touch the slot's walls
        phi = sharpest[template.label]
        on_faces = [
            (2.0 * face * np.cos(phi) - 2.0 * side) / np.sin(phi)
            for side in (-1, 1)
            for face in (-1, 1)
        ]
        assert np.ptp(slot[:, 0]) == pytest.approx(np.ptp(on_faces) + 0.2)

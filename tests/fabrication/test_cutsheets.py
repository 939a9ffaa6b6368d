"""Cut sheets measured back: DXF by ezdxf, SVG as plain XML."""

import xml.etree.ElementTree as ElementTree
from collections import Counter

import ezdxf
import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.cutsheets import cut_sheets, template_sheets
from kop_exudyn.fabrication.dxf import write_dxf
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.fabrication.svg import write_svg
from kop_exudyn.fabrication.templates import CutOptions, templates
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.structures.base import design_from_dict

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def documents(parts, tmp_path_factory):
    """The kit's sheets, as ezdxf reads them."""
    folder = tmp_path_factory.mktemp("sheets")
    return [
        ezdxf.readfile(write_dxf(folder / f"{n}.dxf", sheet))
        for n, sheet in enumerate(cut_sheets(parts, "m"))
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


def test_strips_measured(parts, documents):
    """Joint holes are where the kit says, from the marked axis's ends; side 1 is marked on its
    side."""
    lengths = {
        label: 1000 * values for label, values in zip(parts.labels["linear"], parts.kit["linear"])
    }
    measured = 0
    for document in documents:
        space = document.modelspace()
        axes = [np.array(p.get_points("xy")) for p in space.query('LWPOLYLINE[layer=="ENGRAVE"]')]
        for outline in outlines(space):
            texts = labels_in(space, outline)
            if "1" not in texts:
                continue
            l1, l2 = lengths[next(t for t in texts if t != "1")]
            assert np.ptp(outline[:, 1]) == pytest.approx(30.0)
            middle = outline.mean(axis=0)
            axis = next(a for a in axes if np.allclose(a.mean(axis=0), middle, atol=1e-6))
            holes = holes_in(space, outline)
            joint = holes[np.isclose(holes[:, 2], 4.0)]
            assert len(joint) == 1 and len(holes) == 5
            ends = np.sort(axis[:, 0])
            assert joint[0, 0] - ends[0] == pytest.approx(l1, abs=1e-6)
            assert ends[1] - joint[0, 0] == pytest.approx(l2, abs=1e-6)
            assert joint[0, 1] == pytest.approx(middle[1])
            measured += 1
    assert measured == parts.needed()["linear"].sum()


def test_corner_plates_measured(parts, documents):
    """The angle between the bolts of both legs is the part's; bolts fit those of the strips."""
    angles = dict(zip(parts.labels["angular"], parts.kit["angular"][:, 0]))
    strip = next(t for t in templates(parts, "m") if t.label == "L1")
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


def test_strips_do_not_overlap_at_the_sharpest_corner(parts):
    strip = next(t for t in templates(parts, "m") if t.label == "L1")
    setback = strip.shapes[0].points[:, 0].min()
    sharpest = parts.kit["angular"].max()
    assert setback == pytest.approx(15 * np.tan(sharpest / 2))


def test_pieces_keep_their_distance(parts):
    for sheet in cut_sheets(parts, "m"):
        boxes = np.array([s.box for s in sheet.shapes if s.layer == "CUT" and hasattr(s, "points")])
        low, high = boxes[:, 0], boxes[:, 1]
        apart = ((low[:, None] > high[None] + 4.9) | (low[None] > high[:, None] + 4.9)).any(axis=2)
        assert (apart | np.eye(len(boxes), dtype=bool)).all()
        assert (low > 10).all() and (high < np.array(sheet.size) - 10).all()


def test_svg_agrees_with_dxf(parts, documents, tmp_path):
    for n, (sheet, document) in enumerate(zip(cut_sheets(parts, "m"), documents)):
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
        assert any("thickness 4 mm" in note for note in notes)
        bar = [p for p in document.modelspace().query('LWPOLYLINE[layer=="NOTES"]') if not p.closed]
        assert np.ptp(np.array(bar[0].get_points("xy"))[:, 0]) == pytest.approx(100.0)


def test_templates_have_one_of_each_with_its_dimensions(parts):
    (sheet,) = template_sheets(parts, "m")
    assert sheet.labels == {
        label: 1
        for kind, counts in parts.needed().items()
        for label, n in zip(parts.labels[kind], counts)
        if n
    }
    texts = " ".join(s.text for s in sheet.shapes if hasattr(s, "text"))
    assert f"l1 {1000 * parts.kit['linear'][0, 0]:.2f}" in texts
    assert f"{np.degrees(parts.kit['angular'][0, 0]):.2f} deg" in texts


def test_the_same_kit_gives_the_same_bytes(parts, tmp_path):
    sheet = cut_sheets(parts, "m")[0]
    assert (
        write_dxf(tmp_path / "a.dxf", sheet).read_bytes()
        == write_dxf(tmp_path / "b.dxf", sheet).read_bytes()
    )


def test_pieces_larger_than_a_sheet_are_refused(parts):
    with pytest.raises(InputError, match="larger than a sheet"):
        cut_sheets(parts, "m", CutOptions(sheet=(200.0, 600.0)))


def test_corners_without_room_are_refused_but_strips_can_be_had_alone(parts):
    with pytest.raises(InputError, match="no room for plates"):
        cut_sheets(parts, "m", CutOptions(bolt_hole=40.0))
    alone = templates(parts, "m", CutOptions(bolt_hole=40.0, corners=False))
    assert {t.label[0] for t in alone} == {"L"}
    assert np.ptp(alone[0].shapes[0].points[:, 0]) == pytest.approx(
        1000 * parts.kit["linear"][0].sum()
    )


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
    strips = [
        t
        for t in templates(parts_list(found.kit, found.assignment, [design]), "m")
        if t.label[0] == "L"
    ]
    for strip, (l1, _) in zip(strips, found.kit["linear"]):
        slot = strip.shapes[0].points[3:7]
        assert strip.thickness == pytest.approx(4.0)
        assert slot[:, 0].mean() == pytest.approx(1000 * l1)
        assert np.ptp(slot[:, 0]) == pytest.approx(4.2) and np.ptp(slot[:, 1]) == pytest.approx(
            15.0
        )

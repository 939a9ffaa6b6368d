"""Assembly drawings: every piece is labelled, at its place."""

import re
from collections import Counter

import numpy as np
import pytest
import shapely
from matplotlib.backends.backend_agg import FigureCanvasAgg
from support.umbrellas import HARDWARE

from kop_exudyn.drawing.labels import Label, place
from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.assembly_layout import assembly_drawing
from kop_exudyn.fabrication.assembly_pages import (
    _tiles,
    assembly_pages,
    draw_assembly,
    explanation,
)
from kop_exudyn.fabrication.paper import SCALES, Book, Page
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.io.designs import load_design
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.structures.base import design_from_dict


@pytest.fixture(scope="module")
def shell():
    along = [[[-1.2, y - 0.1], [0, y], [1.2, y - 0.1]] for y in (-0.5, 0.4)]
    across = [[[x, -0.9], [x * 1.1 + 0.02, 0], [x, 0.9]] for x in (-0.8, 0.05, 0.7)]
    return design_from_dict(
        {
            "class": "c_shell",
            "name": "shell",
            "opening": {"angle": 0.2},
            "crossings": "find",
            "free_ends": False,
            "material": {"young": 2.1e9, "poisson": 0.35},
            "section": {"type": "rectangle", "width": 0.03, "height": 0.004},
            "curves": [
                {"type": "spline", "points": points, "closed": False} for points in along + across
            ],
        }
    )


@pytest.fixture(scope="module")
def parts(shell):
    found = cluster(shell.groups, shell.parameters, {"linear": 2, "angular": 2})
    return parts_list(found.kit, found.assignment, [shell])


def texts_of(drawing):
    return [text.get_text() for text in draw_assembly(drawing).axes[0].texts]


def test_every_piece_and_joint_has_its_label(shell, parts):
    texts = texts_of(assembly_drawing(parts, "shell", "m"))
    labels = Counter(text.split("·")[0] for text in texts)
    wanted = Counter(parts.label(piece) for piece in parts.designs[0].pieces)
    assert {label: labels[label] for label in wanted} == wanted
    linear = [piece.element for piece in parts.designs[0].pieces if piece.kind == "linear"]
    numbers = Counter(text for text in texts if text.isdigit())
    assert numbers == Counter(map(str, linear)) + Counter(
        str(k + 1) for k in range(len(shell.joints))
    )
    flipped = sum(
        piece.values[0] < 0 for piece in parts.designs[0].pieces if piece.kind == "angular"
    )
    assert sum(text.endswith("·f") for text in texts) == flipped > 0
    assert {f"({k})" for k in range(1, 6)} <= set(texts)  # lamellas


def test_labels_stand_on_side_1(shell, parts):
    """The bold label lies beside the rod piece whose length is the part's l1."""
    drawing = assembly_drawing(parts, "shell", "m")
    piece = next(p for p in parts.designs[0].pieces if p.kind == "linear" and len(p.columns) == 2)
    scene = shell.scene("rest")
    chain = next(
        k
        for k, c in enumerate(scene.chains)
        if scene.length_parameter[c.elements[0]] == piece.parameters[piece.columns.index(0)]
    )
    line = drawing.lines[chain] / drawing.scale
    along = (line[-1] - line[0]) / np.linalg.norm(line[-1] - line[0])
    labels, places, _ = drawing.labels(drawing.scale)
    near = []
    for label, at in zip(labels, places):
        if label.weight == "bold" and label.text == parts.label(piece):
            t, across = along @ (at - line[0]), np.array([-along[1], along[0]]) @ (at - line[0])
            near.append(abs(across) if 0 < t < np.linalg.norm(line[-1] - line[0]) else np.inf)
    assert min(near) < 4.0  # mm on paper


def test_drawing_keeps_proportions_and_handedness(shell, parts):
    """Seen from above: distances in the flat state are those of the design in millimetres,
    counter-clockwise stays so."""
    x = 1000 * shell.scene("rest").initial.positions[shell.joints][:, :2]
    drawn = assembly_drawing(parts, "shell", "m").joints
    step, wanted = drawn[1:3] - drawn[0], x[1:3] - x[0]
    np.testing.assert_allclose(
        np.linalg.norm(step, axis=1), np.linalg.norm(wanted, axis=1), rtol=1e-9
    )
    assert np.linalg.det(step) == pytest.approx(np.linalg.det(wanted))


def lattice(across, down, wanted=lambda i, j: True):
    """An umbrella mesh over a parallelogram of triangles, or over the wanted ones of its rhombi."""
    s = np.sqrt(3) / 2
    points = [[40 * (i + j / 2), 40 * s * j] for j in range(down + 1) for i in range(across + 1)]
    n = across + 1
    faces = []
    for j in range(down):
        for i in range(across):
            a = j * n + i
            if wanted(i, j):
                faces += [[a, a + 1, a + n], [a + 1, a + n + 1, a + n]]
    used, numbers = np.unique(faces, return_inverse=True)
    points, faces = np.array(points)[used].tolist(), numbers.reshape(-1, 3).tolist()
    lengths = [[32 + k % 5, 33 + k % 3] for k in range(len(faces))]
    return design_from_dict(
        {
            "class": "umbrella",
            **HARDWARE,
            "name": "lattice",
            "lengths": lengths,
            "base": {"vertices": points, "faces": faces},
        }
    )


def drawn(figure):
    """Boxes of all texts of a drawing, as the renderer measures them."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    return [
        shapely.box(*text.get_window_extent(renderer).extents)
        for text in figure.axes[0].texts
        if not text.get_rotation()
    ]


def test_labels_of_250_cells_do_not_overlap():
    design = lattice(16, 8)
    assert design.n_elements == 256
    found = cluster(design.groups, design.parameters, {"cell": 8})
    parts = parts_list(found.kit, found.assignment, [design])
    drawing = assembly_drawing(parts, "lattice", "mm")
    texts = texts_of(drawing)
    assert sum(text.startswith("C") for text in texts) == 256
    assert sum(text.isdigit() for text in texts) == len(design.joints)
    boxes = [box.buffer(-0.5) for box in drawn(draw_assembly(drawing))]
    tree = shapely.STRtree(boxes)
    pairs = tree.query(boxes, "intersects")
    assert len(boxes) > 600 and (pairs[0] == pairs[1]).all()


def test_a_large_drawing_is_split_into_pages_that_show_everything():
    design = lattice(16, 8)
    found = cluster(design.groups, design.parameters, {"cell": 8})
    parts = parts_list(found.kit, found.assignment, [design])
    book = Book("a4", "lattice")
    assembly_pages(book, assembly_drawing(parts, "lattice", "mm"))
    assert len(book.pages) >= 3
    first, *others = book.pages
    assert {str(n) for n in range(1, len(others) + 1)} <= {t.get_text() for t in first.ax.texts}
    shown = Counter(
        text for page in others for text in {t.get_text() for t in page.ax.texts} if "\n" in text
    )
    assert len(shown) == 256


def test_pages_that_show_nothing_are_left_out():
    """An L of cells: of the pages that cover its box, those in its empty corner aren't printed, and
    the others have all cells."""
    design = lattice(44, 44, lambda i, j: min(i, j) < 1)
    found = cluster(design.groups, design.parameters, {"cell": 2})
    parts = parts_list(found.kit, found.assignment, [design])
    drawing = assembly_drawing(parts, "lattice", "mm")
    book = Book("a4", "lattice")
    assembly_pages(book, drawing)
    first, *others = book.pages
    texts = [{t.get_text() for t in page.ax.texts if "\n" in t.get_text()} for page in others]
    assert all(texts) and len(set.union(*texts)) == design.n_elements
    inner = Page("a4", "").room - [12.0, 18.0]
    counts, _ = _tiles(np.ptp(drawing.box, axis=0), inner, drawing.scale)
    assert 1 < len(others) < counts.prod()
    assert first.heading.endswith(f"where its {len(others)} pages are")
    notes = " ".join(page.ax.texts[-1].get_text() for page in others)
    beside = re.findall(r"(?:left|right|above|below) (\d+)", notes)
    assert {int(word) for word in beside} <= set(range(1, len(others) + 1))


@pytest.mark.parametrize("asked", [1.0, 2.0, 5.0, 10.0, 50.0])
def test_as_large_as_the_pages_allow(asked):
    """On as many pages as a scale needs, the drawing could not be larger."""
    size, inner = np.array([2900.0, 1700.0]), np.array([259.0, 160.0])
    counts, scale = _tiles(size, inner, asked)
    assert scale <= asked
    larger = [s for s in SCALES if s < scale]
    for s, wanted in ((scale, True), *((s, False) for s in larger[-1:])):
        fits = (size / s + 14.0 - 12.0 <= counts * inner + 1e-9).all()
        assert bool(fits) is wanted


@pytest.mark.parametrize("height", [-0.5, 0.5])
def test_corners_of_upright_lamellas_say_which_way_they_bend(height):
    """The drawing is a plan, so it can't show what the legend says instead: corners as drawn bend
    so that the lamella rises towards the reader at its ends, flipped ones so that it falls."""
    design = design_from_dict(
        {
            "class": "grid",
            "name": "grid",
            "material": {"young": 2.1e9, "poisson": 0.35},
            "section": {"type": "rectangle", "width": 0.004, "height": 0.03},
            "surface": {"type": "analytic", "name": "paraboloid", "a": height, "b": 0.6 * height},
            "network": {"type": "isolines", "u": [-0.6, 0.0, 0.5], "v": [-0.5, 0.1, 0.6]},
        }
    )
    found = cluster(design.groups, design.parameters, {"linear": 2, "angular": 1})
    parts = parts_list(found.kit, found.assignment, [design])
    drawing = assembly_drawing(parts, "grid", "m")
    assert "rises towards you" in explanation(drawing.placed)
    placed, state = drawing.placed, drawing.placed.scene.initial
    towards_reader = state.rotations[design.joints][:, :, 2].mean(axis=0)
    flipped = 0
    for corner in placed.corners.values():
        piece = placed.corner_pieces[corner.body]
        ends = [
            state.positions[int(body)] - state.positions[corner.body]
            for chain in (*corner.before, *corner.after)
            for body in placed.ends[chain]
            if int(body) != corner.body
        ]
        rise = float(np.mean(ends, axis=0) @ towards_reader)
        assert np.sign(rise) == np.sign(piece.values[0])
        flipped += piece.values[0] < 0
    texts = texts_of(drawing)
    assert sum(text.endswith("·f") for text in texts) == flipped


def test_labels_that_find_no_place_are_counted():
    crowd = [Label("100", 6.0, np.zeros((1, 2))) for _ in range(3)]
    assert place(crowd)[1] == 2
    apart = [Label("100", 6.0, np.array([[0.0, 0.0], [0.0, 9.0 * k]])) for k in range(3)]
    places, crowded = place(apart)
    assert crowded == 0 and [at[1] for at in places] == [0.0, 9.0, 18.0]


def test_unknown_design(shell, parts):
    with pytest.raises(InputError, match="no such design"):
        assembly_drawing(parts, "other", "m")


@pytest.mark.parametrize("name", ["dome", "hill", "saddle"])
def test_joints_of_cells_are_drawn_between_their_plates(name, repository):
    """All of them before anything is opened: the joint that a mesh is held at was drawn where it
    is in the end, beside the plan."""
    design = load_design(repository / "models" / "umbrellas" / f"{name}.json")
    found = cluster(design.groups, design.parameters, {"cell": 3})
    parts = parts_list(found.kit, found.assignment, [design])
    drawing = assembly_drawing(parts, name, "mm")
    plates = shapely.union_all([shapely.Polygon(corners) for corners in drawing.cells])
    edge = design.hardware.edge
    away = shapely.distance(plates, shapely.points(drawing.joints))
    assert len(away) == len(design.joints) and away.max() < 0.5 * edge
    # a joint stands in the gap between two plates, or at a plate's free edge
    assert np.linalg.norm(drawing.joints, axis=1).max() < 0.6 * np.hypot(*np.ptp(
        drawing.cells.reshape(-1, 2), axis=0))  # fmt: skip
    # and the name of a cell in the middle of its plate: arms, which aren't drawn, pushed it aside
    labels, places, crowded = drawing.labels(drawing.scale)
    names = {label.text: at for label, at in zip(labels, places) if "\n" in label.text}
    assert len(names) == len(drawing.cells) and not crowded
    for text, at in names.items():
        middle = drawing.cells[int(text.split("\n")[1]) - 1].mean(axis=0) / drawing.scale
        np.testing.assert_allclose(at, middle, atol=1e-9)


def test_every_page_of_a_large_grid_has_its_lamellas_numbers(repository):
    """Steps say "lay out lamella n", turns count from its first end: on inner pages no number told
    which is which."""
    design = load_design(repository / "models" / "grids" / "01_dome.json")
    found = cluster(design.groups, design.parameters, {"linear": 4, "angular": 2}, restarts=1)
    drawing = assembly_drawing(parts_list(found.kit, found.assignment, [design]), "dome", "m")
    book = Book("a4", "dome")
    assembly_pages(book, drawing)
    first, *others = book.pages
    assert len(others) > 1
    numbers = {f"({lamella.number})" for lamella in drawing.lamellas.all}
    shown = [{t.get_text() for t in page.ax.texts} & numbers for page in (first, *others)]
    assert shown[0] == numbers and set.union(*shown[1:]) == numbers
    for page, own in zip(others, shown[1:]):
        elements = [
            int(t.get_text()) for t in page.ax.texts if t.get_size() == 5 and t.get_rotation()
        ]
        there = {f"({drawing.lamellas.place[number][0]})" for number in elements}
        assert there and there <= own

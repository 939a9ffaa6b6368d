"""Assembly drawings: every piece is labelled, at its place."""

from collections import Counter

import numpy as np
import pytest

from kop_exudyn.drawing.style import figure_bytes
from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.assembly_drawing import draw_assembly
from kop_exudyn.fabrication.pieces import parts_list
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


def test_every_piece_and_joint_has_its_label(shell, parts):
    figure = draw_assembly(parts, "shell", shell.scene("rest").initial, "rest")
    texts = [text.get_text() for text in figure.axes[0].texts]
    labels = Counter(text.split("·")[0].lstrip("-") for text in texts)
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
    assert sum(text.startswith("-") for text in texts) == flipped > 0


def test_labels_stand_on_side_1(shell, parts):
    """The bold label lies beside the rod piece whose length is the part's l1."""
    state = shell.scene("rest").initial
    figure = draw_assembly(parts, "shell", state, "rest")
    lines = figure.axes[0].collections[0].get_segments()
    piece = next(p for p in parts.designs[0].pieces if p.kind == "linear" and len(p.columns) == 2)
    scene = shell.scene("rest")
    chain = next(
        k
        for k, c in enumerate(scene.chains)
        if scene.length_parameter[c.elements[0]] == piece.parameters[piece.columns.index(0)]
    )
    middle = (lines[chain][0] + lines[chain][-1]) / 2
    bold = [
        t
        for t in figure.axes[0].texts
        if t.get_weight() == "bold" and t.get_text() == parts.label(piece)
    ]
    assert min(np.linalg.norm(np.array(t.xy) - middle) for t in bold) < 1e-9


def test_drawing_keeps_proportions_and_handedness(shell, parts):
    """Seen from above: distances in the flat state are those of the design, counter-clockwise stays
    so."""
    x = shell.scene("rest").initial.positions[shell.joints][:, :2]
    figure = draw_assembly(parts, "shell", shell.scene("rest").initial, "rest")
    drawn = np.asarray(figure.axes[0].collections[1].get_offsets())
    step, wanted = drawn[1:3] - drawn[0], x[1:3] - x[0]
    np.testing.assert_allclose(
        np.linalg.norm(step, axis=1), np.linalg.norm(wanted, axis=1), rtol=1e-9
    )
    assert np.linalg.det(step) == pytest.approx(np.linalg.det(wanted))
    assert len(figure_bytes(figure, "svg")) > 10_000


def test_cells_are_labelled_in_their_middle():
    s = np.sqrt(3) / 2
    design = design_from_dict(
        {
            "class": "umbrella",
            "name": "pair",
            "lengths": [[32, 33], [34, 35]],
            "base": {
                "vertices": [[0, 0], [40, 0], [20, 40 * s], [20, -40 * s]],
                "faces": [[0, 1, 2], [0, 3, 1]],
            },
        }
    )
    found = cluster(design.groups, design.parameters, {"cell": 2})
    parts = parts_list(found.kit, found.assignment, [design])
    figure = draw_assembly(parts, "pair", design.scene().initial, "deployed")
    assert sum(text.get_text().startswith("C") for text in figure.axes[0].texts) == 2


def test_unknown_design(shell, parts):
    with pytest.raises(InputError, match="no such design"):
        draw_assembly(parts, "other", shell.scene("rest").initial, "rest")

"""A person with the exported files only lays the designs out again, to 0.1 mm.

What is read: the cut list, the cut sheets (strips and plates measured in the DXF files, not looked
up), the assembly plan. What it is compared with: the rest lengths and turns of the scenes that were
simulated, and the joints of an equilibrium with the parameters that the files give.
"""

import csv

import ezdxf
import numpy as np
import pytest

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.fabrication.folder import export_workshop
from kop_exudyn.fabrication.options import CutOptions
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.structures.base import design_from_dict

MM = 0.1


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


class Files:
    """Everything of a workshop folder that a person needs."""

    def __init__(self, folder):
        self.folder = folder
        self.list = {row["part"]: row for row in read(folder / "cut_list.csv")}
        self.sides, self.turns = {}, {}  # part -> side -> mm from joint to corner; part -> rad
        for path in sorted(folder.glob("cut_sheet_*.dxf")):
            self._measure(ezdxf.readfile(path).modelspace())

    def _measure(self, space):
        circles = np.array(
            [[*c.dxf.center.vec2, 2 * c.dxf.radius] for c in space.query("CIRCLE")]
        ).reshape(-1, 3)
        texts = [
            (t.dxf.text, np.array(t.dxf.align_point.vec2))
            for t in space.query('TEXT[layer=="ENGRAVE"]')
        ]
        for line in space.query('LWPOLYLINE[layer=="CUT"]'):
            outline = np.array(line.get_points("xy"))
            low, high = outline.min(axis=0), outline.max(axis=0)
            inside = np.all((circles[:, :2] > low) & (circles[:, :2] < high), axis=1)
            found = {t: at for t, at in texts if (at > low).all() and (at < high).all()}
            label = next(t for t in found if t != "1")
            if "1" in found:
                self.sides[label] = self._strip(outline, circles[inside], self.list[label])
            else:
                self.turns[label] = self._plate(circles[inside][:, :2])

    @staticmethod
    def _strip(outline, circles, row):
        """Sawn lengths on either side of the joint, and what they were set back."""
        low, high = outline.min(axis=0), outline.max(axis=0)
        if row.get("slot_width_mm"):
            joint = outline[3:7, 0].mean()
        else:
            joint = circles[np.isclose(circles[:, 2], float(row["joint_hole_mm"])), 0][0]
        assert high[0] - low[0] == pytest.approx(float(row["cut_length_mm"]), abs=1e-3)
        assert joint - low[0] == pytest.approx(float(row["hole_from_end_mm"]), abs=1e-3)
        back = float(row["setback_mm"])
        return {"l1": joint - low[0] + back, "l2": high[0] - joint + back}

    @staticmethod
    def _plate(holes):
        """The turn from the first leg's bolts to those of the second."""
        holes = holes[np.argsort(holes[:, 0])]
        first, second = holes[1] - holes[0], holes[3] - holes[2]
        return np.arctan2(first[0] * second[1] - first[1] * second[0], first @ second)

    def lamellas(self, name):
        """Lamella -> its rows of the assembly plan, in order."""
        found = {}
        for row in read(self.folder / f"assembly_{name}.csv"):
            found.setdefault(int(row["lamella"]), []).append(row)
        return {k: sorted(rows, key=lambda r: int(r["place"])) for k, rows in found.items()}

    def laid_out(self, rows):
        """Joint -> its place (2,) in the lamella's own plane; the lamella begins at 0 along x."""
        at, direction, joints = np.zeros(2), 0.0, {}
        for k, row in enumerate(rows):
            if row["kind"] == "angular":
                sign = {"as is": 1, "flipped": -1}[row["variant"]]
                direction += sign * self.turns[row["part"]]
                continue
            ahead = np.array([np.cos(direction), np.sin(direction)])
            own = self.sides[row["part"]]
            sides = [own[row[f"side_{n}"]] for n in (1, 2) if row.get(f"side_{n}")]
            if k or len(sides) == 2:  # the piece before the joint
                at = at + sides.pop(0) * ahead
            joints[int(row["joint"])] = at
            if sides:
                at = at + sides[0] * ahead
        return joints


def shells_case(shells, clustering):
    return shells, parts_list(clustering.kit, clustering.assignment, shells)


def grids_case():
    designs = [
        design_from_dict(
            {
                "class": "grid",
                "name": name,
                "held": "corners",
                "material": {"young": 1.1e10, "poisson": 0.3},
                "section": {"type": "rectangle", "width": 0.006, "height": 0.04},
                "surface": {"type": "analytic", "name": "paraboloid", "a": a, "b": b},
                "network": {"type": "isolines", "u": [-1.2, -0.4, 0.5, 1.1], "v": [-1.1, 0.1, 0.9]},
            }
        )
        for name, a, b in (("vault", -0.3, -0.05), ("saddle", -0.2, 0.2))
    ]
    offsets = np.cumsum([0, *(len(design.parameters) for design in designs)])
    groups = [g.shifted(at) for d, at in zip(designs, offsets) for g in d.groups]
    q = np.concatenate([design.parameters for design in designs])
    found = cluster(groups, q, {"linear": 4, "angular": 3}, seed=2)
    return designs, parts_list(found.kit, found.assignment, designs)


@pytest.fixture(scope="module", params=["shells", "grids"])
def case(request, shells, clustering, tmp_path_factory):
    """Designs (in metres), their pieces, the folder of files."""
    designs, parts = shells_case(shells, clustering) if request.param == "shells" else grids_case()
    folder = tmp_path_factory.mktemp(request.param)
    export_workshop(parts, folder, "m", options=CutOptions(sheet=(2500.0, 1250.0)))
    return designs, parts, Files(folder)


def realised(pieces):
    q = np.array(pieces.design.parameters)
    for piece in pieces.pieces:
        q[list(piece.parameters)] = piece.values
    return q


def test_every_lamella_is_laid_out_as_it_was_simulated(case):
    """Joints of every lamella in its own plane, from the files and from the scene's rest shape."""
    _, parts, files = case
    compared = 0
    for pieces in parts.designs:
        scene = pieces.design.scene(pieces.design.fitted_role.name)
        q = realised(pieces)
        lengths = scene.rest_lengths(q)
        for rows in files.lamellas(pieces.design.name).values():
            joints = files.laid_out(rows)
            wanted = rest_shape(pieces, scene, q, lengths, rows)
            assert list(joints) == list(wanted)
            for joint, at in joints.items():
                np.testing.assert_allclose(at, 1000 * wanted[joint], atol=MM)
                compared += 1
    assert compared == 2 * sum(len(p.design.joints) for p in parts.designs)


def rest_shape(pieces, scene, q, lengths, rows):
    """Joint -> its place along the lamella whose first joint is that of the rows, by walking the
    scene's rods from body to body."""
    joints = {int(body): n for n, body in enumerate(pieces.design.joints, 1)}
    own = {p.element: p for p in pieces.pieces}
    chains = {
        int(scene.length_parameter[c.elements[0]]): c for c in scene.chains if len(c.elements)
    }
    angle_of = {int(p): q[p] for p in scene.driven.parameters}
    at, direction, found = np.zeros(2), 0.0, {}
    for row in rows:
        for parameter in own[int(row["element"])].parameters:
            if parameter in angle_of and parameter not in chains:
                direction += angle_of[parameter]
                continue
            chain = chains[parameter]
            first, last = (int(scene.node_body[chain.nodes[k]]) for k in (0, -1))
            if first in joints:
                found[joints[first]] = at
            length = lengths[chain.elements].sum()
            at = at + length * np.array([np.cos(direction), np.sin(direction)])
            if last in joints:
                found[joints[last]] = at
    return found


def test_what_is_sawn_stands_where_it_was_simulated(case):
    """The designs, solved with lengths and turns measured in the files: joints to 0.1 mm."""
    designs, parts, files = case
    for design, pieces in zip(designs, parts.designs):
        q = np.array(design.parameters)
        for row in (r for rows in files.lamellas(design.name).values() for r in rows):
            parameters = pieces.pieces[int(row["element"]) - 1].parameters
            if row["kind"] == "angular":
                sign = {"as is": 1, "flipped": -1}[row["variant"]]
                q[parameters[0]] = sign * files.turns[row["part"]]
                continue
            own = files.sides[row["part"]]
            for n, parameter in enumerate(parameters, 1):
                q[parameter] = own[row[f"side_{n}"]] / 1000
        role = design.fitted_role
        system = design.systems[role.name]
        planned = design.deploy(realised(pieces))[role.name]
        built = solve(system, q, planned, role.opening)
        moved = np.linalg.norm(built.state.positions - planned.state.positions, axis=1)
        assert 1000 * moved[design.joints].max() < MM
        assert not np.array_equal(q, realised(pieces))  # measured, not looked up


def test_strips_as_long_as_their_axes_would_be_seen(case):
    """The fault that this page is against: without the setback the layout is off by millimetres."""
    _, _, files = case
    lamella = next(iter(files.lamellas(case[0][0].name).values()))
    right = files.laid_out(lamella)
    for part, sides in files.sides.items():
        back = float(files.list[part]["setback_mm"])
        files.sides[part] = {side: length - back for side, length in sides.items()}
    wrong = files.laid_out(lamella)
    for part, sides in files.sides.items():
        back = float(files.list[part]["setback_mm"])
        files.sides[part] = {side: length + back for side, length in sides.items()}
    last = list(right)[-1]
    assert np.linalg.norm(right[last] - wrong[last]) > 10 * MM

"""What a person does with a workshop's files alone: measures parts in the sheets, and lays them
out."""

from __future__ import annotations

import csv

import ezdxf
import numpy as np
import pytest


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


class Files:
    """A workshop's folder, its parts measured in the DXF sheets, not looked up.

    folder : with the cut list, the sheets, the assembly plans
    """

    def __init__(self, folder):
        self.folder = folder
        self.list = {row["part"]: row for row in read(folder / "cut_list.csv")}
        # part -> side -> mm from joint to corner; part -> rad; part -> mm that it slides
        self.sides, self.turns, self.slides = {}, {}, {}
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
        outlines, long_holes = {}, []
        for line in space.query('LWPOLYLINE[layer=="CUT"]'):
            outline = np.array(line.get_points("xy"))
            low, high = outline.min(axis=0), outline.max(axis=0)
            inside = np.all((circles[:, :2] > low) & (circles[:, :2] < high), axis=1)
            found = {t: at for t, at in texts if (at > low).all() and (at < high).all()}
            label = next((t for t in found if t != "1"), None)
            if label is None:  # a hole that a bolt slides in
                long_holes.append((low, high))
            elif "1" in found:
                self.sides[label] = self._strip(outline, circles[inside], self.list[label])
                outlines[label] = (low, high)
            else:
                self.turns[label] = self._plate(circles[inside][:, :2])
        for label, (low, high) in outlines.items():
            bolt = float(self.list[label]["bolt_hole_mm"])
            own = [
                b[0] - a[0] - bolt for a, b in long_holes if (a > low).all() and (b < high).all()
            ]
            if own:
                self.slides[label] = min(own)

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
        stem = name.replace(" ", "_")
        for row in read(self.folder / f"assembly_{stem}.csv"):
            found.setdefault(int(row["lamella"]), []).append(row)
        return {k: sorted(rows, key=lambda r: int(r["place"])) for k, rows in found.items()}

    def side(self, row, n):
        """Of a row of the plan, its side n in mm: as the part is sawn, or, where it slides, as far
        as the plan has it slid."""
        own = self.sides[row["part"]][row[f"side_{n}"]]
        if row["part"] not in self.slides:
            return own
        wanted = float(row[f"side_{n}_mm"])
        assert own - self.slides[row["part"]] - 0.01 <= wanted <= own + 0.01, row
        return wanted

    def laid_out(self, rows):
        """Joint -> its place (2,) in the lamella's own plane; the lamella begins at 0 along x."""
        at, direction, joints = np.zeros(2), 0.0, {}
        for k, row in enumerate(rows):
            if row["kind"] == "angular":
                sign = {"as is": 1, "flipped": -1}[row["variant"]]
                direction += sign * self.turns[row["part"]]
                continue
            ahead = np.array([np.cos(direction), np.sin(direction)])
            sides = [self.side(row, n) for n in (1, 2) if row.get(f"side_{n}")]
            if k or len(sides) == 2:  # the piece before the joint
                at = at + sides.pop(0) * ahead
            joints[int(row["joint"])] = at
            if sides:
                at = at + sides[0] * ahead
        return joints


def realised(pieces):
    q = np.array(pieces.design.parameters)
    for piece in pieces.pieces:
        q[list(piece.parameters)] = piece.values
    return q


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


def lay_out_all(parts, files, atol):
    """Lay out every lamella of every design in its own plane, and compare its joints with the
    scene's rest shape.

    parts : the kit's; files : `Files`, all that is laid out from; atol : mm

    Returns how many joints were compared.
    """
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
                np.testing.assert_allclose(at, 1000 * wanted[joint], atol=atol)
                compared += 1
    return compared

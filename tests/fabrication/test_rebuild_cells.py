"""A person with the exported files only builds an umbrella mesh: its joints to 0.1 mm.

What is read: arms measured between their pins in the DXF sheets, the cut list beside them, and the
assembly plan, which says which arm is where. What they are compared with: the joints of the
equilibrium whose elements are the kit's parts.
"""

import csv

import ezdxf
import numpy as np
import pytest

from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.fabrication.assembly import write_assembly_plan
from kop_exudyn.fabrication.assembly_order import fasteners
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.cutlist import write_cut_list
from kop_exudyn.fabrication.cutsheets import cut_sheets
from kop_exudyn.fabrication.dxf import write_dxf
from kop_exudyn.fabrication.folder import export_workshop
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.files.tables import write_csv
from kop_exudyn.io.designs import load_design
from kop_exudyn.kit.cluster import cluster

MM = 0.1


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def pin_diameter(folder):
    """mm; of the pins that arms turn about, not of those that lock them."""
    rows = read(folder / "fasteners.csv")
    return next(float(r["diameter_mm"]) for r in rows if r["item"].startswith("hinge pin"))


def arms(folder, pin):
    """Label of an arm, as "C1 top a" -> distances of its pins along it, mm, of all boards that
    have both."""
    found = {}
    for path in sorted(folder.glob("cut_sheet_*.dxf")):
        space = ezdxf.readfile(path).modelspace()
        circles = np.array(
            [
                [*c.dxf.center.vec2]
                for c in space.query("CIRCLE")
                if abs(2 * c.dxf.radius - pin) < 1e-6
            ]
        ).reshape(-1, 2)
        texts = [
            (t.dxf.text, np.array(t.dxf.align_point.vec2))
            for t in space.query('TEXT[layer=="ENGRAVE"]')
            if t.dxf.text.endswith("1") and " " in t.dxf.text
        ]
        for line in space.query('LWPOLYLINE[layer=="CUT"]'):
            outline = np.array(line.get_points("xy"))
            low, high = outline.min(axis=0), outline.max(axis=0)
            label = [t for t, at in texts if (at > low).all() and (at < high).all()]
            pins = circles[np.all((circles > low) & (circles < high), axis=1)]
            if label and len(pins) == 2:
                found.setdefault(label[0][:-1], []).append(np.abs(pins[1] - pins[0]).max())
    return found


@pytest.fixture(scope="module")
def case(repository, tmp_path_factory):
    design = load_design(repository / "models" / "umbrellas" / "dome.json")
    found = cluster(design.groups, design.parameters, {"cell": 4}, seed=1)
    parts = parts_list(found.kit, found.assignment, [design])
    folder = tmp_path_factory.mktemp("umbrella")
    export_workshop(parts, folder, design.units.length, formats=["dxf"])
    return design, parts, folder


def measured(design, folder):
    """(nq,) the design's lengths in mm as the files give them, element by element."""
    pin = pin_diameter(folder)
    lengths = arms(folder, pin)
    cut = {row["part"]: row for row in read(folder / "cut_list.csv")}
    for label, values in lengths.items():
        part, side, _ = label.split()
        assert np.ptp(values) < 1e-4  # all boards of a label are alike
        assert values[0] == pytest.approx(float(cut[part][f"{side}_mm"]), abs=1e-3)
    q = []
    for row in sorted(
        read(folder / f"assembly_{design.name}.csv"), key=lambda r: int(r["element"])
    ):
        for side in (row["side_1"], row["side_2"]):
            q.append(lengths[f"{row['part']} {side} {row['arms']}"][0])
    return np.array(q)


def test_an_umbrella_mesh_stands_where_it_was_simulated(case):
    design, parts, folder = case
    (pieces,) = parts.designs
    exact, order = np.array(design.parameters), []
    for piece in pieces.pieces:
        exact[list(piece.parameters)] = piece.values
        order += piece.parameters
    built = exact.copy()
    built[order] = measured(design, folder) / 1000 / design.units.metres
    assert np.abs(built - design.parameters).max() > 1e-3  # parts, not the design's own lengths
    role = design.fitted_role
    system = design.systems[role.name]
    start = design.deploy()[role.name]
    wanted = solve(system, exact, start, start.opening)
    found = solve(system, built, start, start.opening)
    places = [eq.state.positions[design.joints] for eq in (wanted, found)]
    away = 1000 * design.units.metres * np.linalg.norm(places[1] - places[0], axis=1)
    assert away.max() < MM


@pytest.mark.parametrize(
    "name, cells", [("hill", 2), ("monkey", 6), ("oval", 2), ("saddle", 6), ("wave", 6)]
)
def test_every_mesh_is_assembled_with_its_joints_in_place(name, cells, repository, tmp_path):
    """Before it is opened, which takes no solver: where arms of the measured lengths have the
    joints, of kits of few and of many cells."""
    design = load_design(repository / "models" / "umbrellas" / f"{name}.json")
    found = cluster(design.groups, design.parameters, {"cell": cells}, seed=1)
    parts = parts_list(found.kit, found.assignment, [design])
    blanks = Blanks(parts, design.units.length)
    write_cut_list(tmp_path / "cut_list.csv", blanks)
    write_csv(tmp_path / "fasteners.csv", fasteners(blanks))
    write_assembly_plan(tmp_path / f"assembly_{name}.csv", parts, name, design.units.length)
    for number, sheet in enumerate(cut_sheets(blanks), 1):
        write_dxf(tmp_path / f"cut_sheet_{number}.dxf", sheet)
    exact, order = np.array(design.parameters), []
    for piece in parts.designs[0].pieces:
        exact[list(piece.parameters)] = piece.values
        order += piece.parameters
    built = exact.copy()
    built[order] = measured(design, tmp_path) / 1000 / design.units.metres
    assert np.abs(built - design.parameters).max() > 1e-3
    n = design.mesh.lengths.size
    joints = [design.mesh.compact_positions(q[:n]) for q in (exact, built)]
    away = 1000 * design.units.metres * np.linalg.norm(joints[1] - joints[0], axis=1)
    assert away.max() < MM


def test_arms_are_as_many_as_the_plan_needs(case):
    design, _, folder = case
    pin = pin_diameter(folder)
    boards = sum(len(values) for values in arms(folder, pin).values())
    assert boards == len(design.hardware.arms)

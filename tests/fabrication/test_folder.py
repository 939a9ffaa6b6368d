"""The workshop's folder: what is in it, and what it says when parts can't be cut."""

import csv

import numpy as np
import pypdf
import pytest
from support.read_me import assert_explained

import kop_exudyn as kop
from kop_exudyn.errors import InputError
from kop_exudyn.fabrication.assembly import joint_places
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.cutsheets import cut_sheets
from kop_exudyn.fabrication.folder import export_workshop
from kop_exudyn.fabrication.options import CutOptions
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.fabrication.stock import stock_plan
from kop_exudyn.io.stocks import load_stock
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.structures.serving import served_by


def read(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def folder(parts, tmp_path_factory):
    folder = tmp_path_factory.mktemp("workshop")
    files = export_workshop(parts, folder, "m", title="Two shells")
    assert {path.name for path in files} == {path.name for path in folder.iterdir()}
    return folder


def test_everything_is_there(folder):
    names = {path.name for path in folder.iterdir()}
    for name in ("first", "second"):
        assert {f"{stem}_{name}.csv" for stem in ("bill", "assembly", "steps", "joints")} <= names
        assert f"assembly_{name}.svg" in names
    assert {"cut_list.csv", "material.csv", "fasteners.csv", "bars.csv", "workshop.pdf"} <= names
    assert {"cut_sheet_1.dxf", "cut_sheet_1.svg", "templates_1.svg"} <= names


def test_bars_hold_what_the_cut_list_asks_for(parts, folder):
    rows, cut = read(folder / "bars.csv"), {r["part"]: r for r in read(folder / "cut_list.csv")}
    for part, row in cut.items():
        if row["kind"] == "linear":
            pieces = [r for r in rows if r["part"] == part]
            assert len(pieces) == int(row["pieces"])
            for piece in pieces:
                length = float(piece["to_mm"]) - float(piece["from_mm"])
                assert length == pytest.approx(float(row["cut_length_mm"]), abs=2e-3)
    for number in {row["bar"] for row in rows}:
        on_it = sorted((r for r in rows if r["bar"] == number), key=lambda r: float(r["from_mm"]))
        gaps = [float(b["from_mm"]) - float(a["to_mm"]) for a, b in zip(on_it, on_it[1:])]
        np.testing.assert_allclose(gaps, 3.0, atol=2e-3)
        assert float(on_it[-1]["to_mm"]) <= float(on_it[0]["bar_mm"])
    total = sum({row["bar"]: float(row["bar_mm"]) for row in rows}.values())
    assert total == stock_plan(Blanks(parts, "m")).length


def test_material_adds_up(folder):
    cut = read(folder / "cut_list.csv")
    strips = next(row for row in read(folder / "material.csv") if row["item"] == "strips")
    lengths = [float(r["cut_length_mm"]) * int(r["pieces"]) for r in cut if r["kind"] == "linear"]
    assert float(strips["length_m"]) == pytest.approx(sum(lengths) / 1000, abs=1e-3)
    assert strips["section_mm"] == "30 x 4"


def test_bars_and_sheets_to_buy_are_those_that_are_planned(parts, folder):
    """And where strips are on both, it is said that one of the two is meant."""
    rows = {row["item"]: row for row in read(folder / "material.csv")}
    bars = stock_plan(Blanks(parts, "m")).bars
    for length in {bar.length for bar in bars}:
        row = rows[f"to buy: bars of {length:g} mm, or sheets"]
        assert int(row["pieces"]) == sum(bar.length == length for bar in bars)
    sheets = len(list(folder.glob("cut_sheet_*.svg")))
    cut = cut_sheets(Blanks(parts, "m"))
    size = "to buy: sheets of 1000 x 600 mm"
    assert int(rows[f"{size}, for all parts"]["pieces"]) == sheets
    # who takes bars needs the last sheets only, on which there are no strips
    alone = [not {s.label for s in Blanks(parts, "m").strips} & set(sheet.labels) for sheet in cut]
    assert alone == sorted(alone) and 0 < sum(alone) < len(alone) == sheets
    assert int(rows[f"{size}, with bars: for the other parts"]["pieces"]) == sum(alone)
    pages = pypdf.PdfReader(folder / "workshop.pdf").pages
    printed = " ".join(page.extract_text().replace("\n", " ") for page in pages)
    told = " ".join((folder / "READ_ME.txt").read_text(encoding="utf-8").split())
    assert "choose one" in printed and "choose one" in told


def test_nothing_is_to_choose_where_strips_fit_the_bars_alone(parts, tmp_path):
    options = CutOptions(sheet=(300.0, 300.0))
    export_workshop(parts, tmp_path, "m", options=options, formats=["svg"])
    items = [row["item"] for row in read(tmp_path / "material.csv")]
    assert "to buy: bars of 2400 mm" in items
    assert "to buy: sheets of 300 x 300 mm, as drawn" in items
    assert "choose one" not in (tmp_path / "READ_ME.txt").read_text(encoding="utf-8")


def test_its_pieces_are_a_stock_for_other_designs(parts, folder):
    stock = load_stock(folder / "stock.csv")
    needed = parts.needed()
    assert stock.to_dict() == {kind: counts.tolist() for kind, counts in needed.items()}
    for kind, values in parts.kit.parts.items():
        np.testing.assert_array_equal(stock.kit[kind], values)


def test_every_file_and_column_is_explained_beside_them(folder):
    """By a text of its own: what nothing is known of stands there without any."""
    assert_explained(folder)


def test_slits_and_cells_are_explained_too(repository, tmp_path):
    for number, (file, sizes) in enumerate(
        {
            "small/01_sinh": {"slit": 3, "angular": 2},
            "umbrellas/dome": {"cell": 3},
            "grids/02_saddle": {"linear": 3, "angular": 2},
        }.items()
    ):
        design = kop.load_design(repository / "models" / f"{file}.json")
        (design,) = served_by([design], sizes)
        found = cluster(design.groups, design.parameters, sizes)
        folder = tmp_path / str(number)
        listed = parts_list(found.kit, found.assignment, [design])
        export_workshop(listed, folder, design.units.length, formats=["svg"], force=True)
        assert_explained(folder)


def test_joints_have_their_places_in_millimetres(parts, folder):
    rows = read(folder / "joints_first.csv")
    found = np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows])
    np.testing.assert_allclose(found, 1000 * joint_places(parts, "first"), atol=1e-3)


@pytest.mark.parametrize("paper, size", [("a3", (420, 297)), ("a4", (297, 210))])
def test_the_book_is_of_that_paper_and_says_page_scale_and_title(parts, tmp_path, paper, size):
    export_workshop(parts, tmp_path, "m", title="Two shells", paper=paper, formats=[])
    pages = pypdf.PdfReader(tmp_path / "workshop.pdf").pages
    for number, page in enumerate(pages, 1):
        box = page.mediabox
        np.testing.assert_allclose(
            [float(box.width), float(box.height)], np.array(size) * 72 / 25.4, atol=0.1
        )
        text = page.extract_text()
        assert f"Page {number} of {len(pages)}" in text and "Two shells" in text
        assert ("Scale 1:" in text) != ("Not to scale" in text)
    everything = " ".join(page.extract_text() for page in pages)
    for label in (
        "A1",
        "L3",
        "Corner plates",
        "Bars to saw",
        "Assembly of second: steps",
        "Joints of second, as it stands",
    ):
        assert label in everything
    for strip in Blanks(parts, "m").strips:
        assert f"{strip.cut_length:.1f}" in everything
        assert f"{strip.hole_from_end:.1f}" in everything


def test_the_same_kit_gives_the_same_book(parts, folder, tmp_path):
    export_workshop(parts, tmp_path, "m", title="Two shells", formats=[])
    assert (tmp_path / "workshop.pdf").read_bytes() == (folder / "workshop.pdf").read_bytes()


def test_parts_that_can_not_be_cut_are_refused_unless_forced(parts, tmp_path):
    broad = CutOptions(joint_hole=11.0)
    with pytest.raises(InputError, match="joint hole of 11 mm"):
        export_workshop(parts, tmp_path / "refused", "m", options=broad)
    assert not (tmp_path / "refused").exists()
    files = export_workshop(parts, tmp_path / "forced", "m", options=broad, formats=[], force=True)
    assert (tmp_path / "forced" / "cut_list.csv") in files
    text = (tmp_path / "forced" / "READ_ME.txt").read_text(encoding="utf-8")
    assert "NOT FIT TO BE BUILT: part" in text and "joint hole of 11 mm" in " ".join(text.split())


def test_nothing_is_said_of_a_kit_that_is_fit(folder):
    assert "NOT FIT" not in (folder / "READ_ME.txt").read_text(encoding="utf-8")
    assert "NOT FIT" not in (folder / "cut_sheet_1.dxf").read_text()


def test_files_are_not_overwritten_unasked(parts, folder):
    with pytest.raises(InputError, match="exists already"):
        export_workshop(parts, folder, "m")
    with pytest.raises(InputError, match="formats"):
        export_workshop(parts, folder, "m", formats=["pdf"], overwrite=True)
    with pytest.raises(InputError, match="paper"):
        export_workshop(parts, folder, "m", paper="letter", overwrite=True)


@pytest.mark.parametrize("corners", [True, False])
def test_it_is_said_how_corners_are_without_plates(corners, parts, tmp_path):
    export_workshop(parts, tmp_path, "m", options=CutOptions(corners=corners), formats=[])
    text = " ".join((tmp_path / "READ_ME.txt").read_text(encoding="utf-8").split())
    book = pypdf.PdfReader(tmp_path / "workshop.pdf").pages[0].extract_text()
    assert ("Corners are without plates" in text) == ("Corners are without plates" in book)
    assert ("Corners are without plates" in text) != corners

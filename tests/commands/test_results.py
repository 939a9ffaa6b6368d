"""``kop view`` and ``kop export`` of a finished run, from its folder and the designs' files."""

from __future__ import annotations

import contextlib
import io
import json
import re
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from pypdf import PdfReader
from support.settings import ONE_STEP
from support.shells import shell_data

from kop_exudyn.cli import main
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.io.saved_runs import load_run
from kop_exudyn.report.kit_run import optimize_and_report
from kop_exudyn.report.viewer_scenes import kit_scene
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.wording import beside_units


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Folders of a finished run and of its designs, among which there is one that it doesn't
    use."""
    folder = tmp_path_factory.mktemp("kit")
    (folder / "designs").mkdir()
    for name, bow in (("flat", 0.1), ("bent", 0.16), ("unused", 0.2)):
        (folder / "designs" / f"{name}.json").write_text(
            json.dumps(shell_data(name, bow)), encoding="utf-8"
        )
    optimize_and_report(
        load_designs(folder / "designs", ["flat", "bent"]),
        {"linear": 2, "angular": 2},
        out=folder / "run",
        settings=JobSettings(jobs=1, stages=ONE_STEP),
    )
    return folder / "run", folder / "designs"


def test_view_shows_all_stages_and_the_way_to_the_opening(run, tmp_path, capsys):
    page = tmp_path / "kit.html"
    assert main(["view", *map(str, run), "--out", str(page), "--frames", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"page": str(page)}
    found = re.search(r'id="scene">(.*?)</script>', page.read_text(encoding="utf-8"), re.S)
    data = json.loads(found.group(1))
    assert [design["name"] for design in data["designs"]] == ["flat", "bent"]
    assert data["colourings"] == ["part", "deviation", "utilisation"]
    for design in data["designs"]:
        stages = {state["stage"] for state in design["states"]} | set(design["failed"])
        assert stages == {"input", "direct", "unrelaxed", "relaxed", "assigned"}
        assert sum(not state["final"] for state in design["states"]) == 2
        notes = [
            state["note"]
            for state in design["states"]
            if state["role"] == "deployed" and state["final"]
        ]
        wanted = r"off target: joints at most .*\s%, .* · stress: max \d+\s% of its limit"
        assert all(re.fullmatch(wanted, note) for note in notes)


def test_the_page_of_a_read_run_is_that_of_the_run(run):
    """But for the way to the opening, which a finished search has at hand."""
    again = kit_scene(load_run(run[0], load_designs(run[1])))
    html = (run[0] / "viewer.html").read_text(encoding="utf-8")
    written = json.loads(re.search(r'id="scene">(.*?)</script>', html, re.S).group(1))
    assert [
        (s["stage"], s["role"], s["note"])
        for d in written["designs"]
        for s in d["states"]
        if s["final"]
    ] == [(s.stage, s.role, beside_units(s.note)) for d in again.designs for s in d.states]


def test_unusable_requests_of_view(run, tmp_path, capsys):
    page = tmp_path / "kit.html"
    for arguments, message in (
        ((str(run[0]),), "give also the folder of the designs"),
        ((str(run[1] / "flat.json"), str(run[1])), "expected the folder of a finished run"),
        ((str(tmp_path), str(run[1])), "result.json"),
    ):
        assert main(["view", *arguments, "--out", str(page)]) == 2
        error = capsys.readouterr().err
        assert message in error and error.count("\n") == 1
    assert not page.exists()


def _export(run, folder):
    sheet = ("--sheet", "1250,700")  # the longest part is a metre
    return ["export", *map(str, run), "--unit", "m", *sheet, "--out", str(folder)]


@pytest.fixture(scope="module")
def exported(run, tmp_path_factory):
    """The folder of everything that is exported of the run, and what the command printed."""
    folder = tmp_path_factory.mktemp("export") / "files"
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        assert main([*_export(run, folder), "--json"]) == 0
    return folder, json.loads(printed.getvalue())["files"]


def test_export_writes_a_labelled_drawing_of_every_design(run, exported):
    folder, written = exported
    workshop = folder / "workshop"
    assert set(written) == {str(path) for path in folder.rglob("*.*")}
    result = load_run(run[0], load_designs(run[1]))
    book = [page.extract_text() for page in PdfReader(workshop / "workshop.pdf").pages]
    for design in result.designs:
        for suffix in ("csv", "svg"):
            assert (workshop / f"assembly_{design.name}.{suffix}").stat().st_size > 1000
        root = ElementTree.parse(workshop / f"assembly_{design.name}.svg").getroot()
        groups = [
            g
            for g in root.iter("{http://www.w3.org/2000/svg}g")
            if g.get("id", "").startswith("text_")
        ]
        assert len(groups) >= design.n_elements + len(design.joints)
        assert any(design.name in page for page in book)
    assert not list(workshop.glob("*unused*")) and not any("unused" in page for page in book)


def test_export_overwrites_nothing(run, exported):
    folder, _ = exported
    before = {path: path.read_bytes() for path in folder.rglob("*.*")}
    assert main(_export(run, folder)) == 2
    assert {path: path.read_bytes() for path in folder.rglob("*.*")} == before


def test_sheets_holes_and_single_folders(run, tmp_path, capsys):
    command = ["export", *map(str, run), "--unit", "m", "--out", str(tmp_path)]
    assert main([*command, "--sheet", "200,100", "--stock", "500"]) == 2
    assert "larger than a sheet's 170 x 46 mm" in capsys.readouterr().err and not list(
        tmp_path.iterdir()
    )
    assert main([*command, "--sheet", "0,100"]) == 2
    assert main([*command, "--only", "workshop", "--sheet", "3000,700", "--joint-hole", "6.5"]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["workshop"]
    sheet = (tmp_path / "workshop" / "cut_sheet_1.svg").read_text()
    assert 'width="3000mm"' in sheet and 'r="3.2500"' in sheet
    assert main([*command, "--only", "desk"]) == 0
    assert (tmp_path / "desk" / "steps.csv").is_file()


def test_exported_vtu_has_strains_stresses_and_utilisation(run, exported):
    mesh = meshio.read(exported[0] / "desk" / "flat_assigned_deployed.vtu")
    cells = {name.partition(" [")[0]: blocks[0] for name, blocks in mesh.cell_data.items()}
    assert {"stretch", "twist", "curvature_y", "My", "equivalent_stress", "utilisation"} <= set(
        cells
    )
    np.testing.assert_allclose(cells["utilisation"], cells["equivalent_stress"] / 4e7)
    figures = json.loads((run[0] / "result.json").read_text())["designs"][0]["assigned"][
        "strength"
    ]["deployed"]
    assert cells["utilisation"].max() == pytest.approx(figures["utilisation"], rel=1e-6)

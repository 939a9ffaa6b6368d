"""``kop export``: errors before anything is written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pypdf
import pytest
from support.settings import ONE_STEP

from kop_exudyn.cli import main
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.io.results import save_result, save_states
from kop_exudyn.report.kit_drawings import final_states
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings


def test_a_folder_without_a_result_is_named(tmp_path, repository, capsys):
    status = main(
        [
            "export",
            str(tmp_path),
            str(repository / "models" / "grids"),
            "--unit",
            "m",
            "--out",
            str(tmp_path / "out"),
        ]
    )
    assert status == 2
    assert "result.json" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_design_alone_is_written_for_other_programs(tmp_path, repository, capsys):
    design = str(repository / "models" / "small" / "01_sinh.json")
    assert main(["export", design, "--out", str(tmp_path / "out"), "--json"]) == 0
    files = {Path(name).name for name in json.loads(capsys.readouterr().out)["files"]}
    assert files == {path.name for path in (tmp_path / "out").iterdir()}
    assert {"small_sinh_deployed.glb", "small_sinh_rest.vtu", "small_sinh_rods.csv"} <= files


@pytest.mark.parametrize(
    "options, named",
    [
        (["--only", "workshop"], "--only"),
        (["--sheet", "500,500"], "--sheet: is for a kit's workshop folder"),
        (["--stock", "2400,-1"], "positive numbers"),
        (["--kerf", "-1"], "not below 0"),
        (["--paper", "letter"], "letter"),
    ],
)
def test_options_that_make_no_sense(options, named, tmp_path, repository, capsys):
    design = str(repository / "models" / "small" / "01_sinh.json")
    try:
        status = main(["export", design, "--out", str(tmp_path / "out"), *options])
    except SystemExit as stopped:
        status = stopped.code
    assert status == 2 and named in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_what_stops_a_kit_from_being_built_is_named_and_can_be_overruled(
    tmp_path, repository, capsys
):
    """Two tiny designs with an elastic limit that their bending passes."""
    designs = tmp_path / "designs"
    designs.mkdir()
    for name in ("01_sinh", "03_exp"):
        data = json.loads((repository / "models" / "small" / f"{name}.json").read_text())
        data["material"]["elastic_limit"] = 1e5
        (designs / f"{name}.json").write_text(json.dumps(data))
    run = tmp_path / "run"
    result = optimize_kit(
        load_designs(designs),
        {"linear": 6, "angular": 3},
        # what stress is allowed doesn't matter to the search
        settings=JobSettings(
            jobs=1, baselines=False, stages=replace(ONE_STEP, requirements=Requirements.none())
        ),
    )
    run.mkdir()
    save_result(run / "result.json", result.to_dict())
    save_states(run / "states.npz", final_states(result))
    command = ["export", str(run), str(designs), "--out", str(tmp_path / "out"), "--unit", "m"]
    assert main(command) == 2
    error = capsys.readouterr().err
    assert "of its elastic limit" in error and "--force" in error and "small" in error
    assert not (tmp_path / "out").exists()
    assert main([*command, "--force", "--only", "workshop", "--paper", "a4"]) == 0
    # whoever builds it has the folder alone, and hears of it there
    folder = tmp_path / "out" / "workshop"
    told = " ".join((folder / "READ_ME.txt").read_text(encoding="utf-8").split())
    assert "NOT FIT TO BE BUILT: small" in told and "of its elastic limit" in told
    pages = [page.extract_text() for page in pypdf.PdfReader(folder / "workshop.pdf").pages]
    assert "of its elastic limit" in " ".join(pages[0].split())
    assert all("NOT FIT TO BE BUILT, see page 1" in text for text in pages)
    assert "NOT FIT TO BE BUILT, see READ_ME.txt" in (folder / "cut_sheet_1.dxf").read_text()

"""The frame of the studies: arguments, resuming, and all that a report leaves in its folder."""

from __future__ import annotations

import csv
import json

import pytest
from matplotlib.figure import Figure

from kop_exudyn.errors import InputError
from lib.study import Study, described
from lib.sweep import Task

DOC = """Growth of squares: how they grow.

    python studies/squares.py [--quick]

Squares of whole numbers are computed
one by one.

A second paragraph.
"""
calls: list[float] = []


def square(x: float) -> dict:
    calls.append(x)
    return {"square": x * x}


def run(folder, *arguments: str, last: float = 3.0) -> Study:
    study = Study.from_command_line(
        DOC, folder / "studies" / "squares.py", ["--jobs", "1", *arguments]
    )
    found = study.sweep([Task(f"square {x:g}", square, {"x": x}) for x in (1.0, 2.0, last)])
    figure = Figure()
    figure.subplots().plot([value["square"] for value in found.values()])
    report = study.report("They grow.").section("All", "Some text.")
    report.figure("growth", figure, "Squares.", alt="a curve")
    report.table("squares", [{"task": name, **value} for name, value in found.items()])
    report.save({"squares": found})
    return study


@pytest.fixture(autouse=True)
def no_calls():
    calls.clear()


def test_the_docstring_says_what_was_tried():
    assert described(DOC) == (
        "Growth of squares: how they grow",
        "Squares of whole numbers are computed one by one.\n\nA second paragraph.",
    )


def test_a_report_leaves_page_figures_tables_and_data(tmp_path):
    study = run(tmp_path, "--quick")
    out = tmp_path / "reports" / "squares"
    assert study.out == out and study.quick
    page = (out / "index.html").read_text()
    assert (
        '<p class="lead">They grow.</p>\n<p>Squares of whole numbers are computed one by one.</p>'
        in page
    )
    assert (
        "A second paragraph." in page
        and "data:image/png;base64" in page
        and "Quick settings" in page
    )
    assert (
        b"<svg" in (out / "growth.svg").read_bytes()
        and (out / "growth.pdf").read_bytes()[:4] == b"%PDF"
    )
    rows = list(csv.DictReader((out / "squares.csv").read_text().splitlines()))
    assert [float(row["square"]) for row in rows] == [1, 4, 9]
    data = json.loads((out / "data.json").read_text())
    assert data["finding"] == "They grow."
    assert data["squares"]["square 2"] == {"square": 4} and data["environment"]["cores"] >= 1
    assert data["settings"]["square 3"]["settings"] == {"x": 3} and data["times"]["wall_s"] > 0


def test_a_resumed_study_computes_what_is_missing_and_counts_all_its_time(tmp_path):
    first = run(tmp_path, "--out", str(tmp_path / "out"))
    second = run(tmp_path, "--out", str(tmp_path / "out"), "--resume", last=4.0)
    assert calls == [1, 2, 3, 4] and second.reused == 2 and first.reused == 0
    assert second._earlier_s > 0 and second.wall_s > second._earlier_s
    assert "2 of them computed earlier" in (tmp_path / "out" / "index.html").read_text()


def test_a_study_that_is_not_resumed_starts_anew(tmp_path):
    run(tmp_path)
    run(tmp_path)
    assert calls == [1, 2, 3, 1, 2, 3]


def test_other_sweeps_lend_their_results(tmp_path):
    run(tmp_path)
    other = Study.from_command_line(DOC, tmp_path / "studies" / "other.py", ["--jobs", "1"])
    found = other.sweep(
        [Task("square 2", square, {"x": 2.0})], also=[tmp_path / "reports" / "squares" / "sweep"]
    )
    assert found == {"square 2": {"square": 4.0}} and calls == [1, 2, 3]


def test_a_page_is_drawn_anew_from_its_data_alone(tmp_path):
    """With the times, versions and machine of the run, and a word that it was."""
    run(tmp_path)
    out = tmp_path / "reports" / "squares"
    data = json.loads((out / "data.json").read_text())
    data["environment"]["commit"], data["times"]["wall_s"] = "0123456789", 4321.0
    data["times"]["reused"] = 2
    (out / "data.json").write_text(json.dumps(data))
    kept = sorted(path.name for path in (out / "sweep").iterdir())
    file = tmp_path / "studies" / "squares.py"
    study = Study.from_command_line(DOC, file, ["--redraw"], can_redraw=True)
    assert study.stored == data
    study.report("They grow fast.").save({"squares": study.stored["squares"]})
    page = (out / "index.html").read_text().replace("\u00a0", " ")  # no lines break at units
    again = json.loads((out / "data.json").read_text())
    assert '<p class="lead">They grow fast.</p>' in page and "They grow.<" not in page
    assert "4321 s of wall time" in page and "0123456789" in page
    assert "2 of them computed earlier" in page and "drawn anew from these numbers on" in page
    assert again["finding"] == "They grow fast." and again["squares"] == data["squares"]
    for name in ("settings", "times", "environment", "quick"):
        assert again[name] == data[name]
    assert sorted(path.name for path in (out / "sweep").iterdir()) == kept
    with pytest.raises(SystemExit):  # of a study whose page needs more than its data
        Study.from_command_line(DOC, file, ["--redraw"])


def test_unusable_folders_and_arguments_are_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="expected a folder"):
        run(tmp_path, "--out", str(tmp_path / "file"))
    with pytest.raises(SystemExit):
        run(tmp_path, "--jobs", "0")

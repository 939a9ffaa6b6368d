"""What `kop optimize` says of the kit it found: two lines, the same on the page and in the result,
for kits that can be built and for the two that can't."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from html import unescape

import pytest
from support.grids import coarse_grid
from support.read_me import assert_explained

from kop_exudyn.analysis.verdict import Buildable, Stop
from kop_exudyn.cli import main
from kop_exudyn.io.studies import load_study
from kop_exudyn.report.verdicts import kit_verdicts, verdict_lines, verdict_rows
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.strength import design_strength


@pytest.fixture(scope="module")
def data(repository):
    """A grid of four lamellas each way."""
    return coarse_grid(repository)


STUDY = """format = "kop_exudyn/study"
version = 1
designs = ["vault.json"]
baselines = false
parts = {linear = 8, angular = 6}
settings = {schedule = [1e5], relaxed_steps = 2, round_steps = 2, path_steps = 2, restarts = 3, \
leaps = 0, reassignments = 1, redeployments = 0, levelling = 0}
requirements = {samples = 2}
tolerance = {samples = 3}
"""


@pytest.fixture
def study(data, tmp_path):
    """Writes the design with changes, and the study of it; returns the study's file."""

    def write(**changes):
        (tmp_path / "vault.json").write_text(json.dumps({**data, **changes}), encoding="utf-8")
        (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
        return tmp_path / "study.toml"

    return write


@pytest.fixture
def judged(study):
    """Finds a kit for the design with changes; the verdict, and its lines."""

    def run(**changes):
        read = load_study(study(**changes))
        designs = read.designs()
        result = optimize_kit(designs, read.parts, settings=read.job_settings(designs, 1))
        (verdict,) = kit_verdicts(result, read.verdict)
        return verdict, verdict_lines([verdict], result.units)

    return run


def test_a_kit_that_can_be_built(judged):
    verdict, lines = judged()
    assert verdict.possible and lines[0] == "The design can be built from this kit."
    assert "0 of 3 samples with errors of 0.21 mm and 0.1 degrees snap" in lines[1]
    assert verdict.fabrication == () and verdict.moved_percent < 0.1
    rare = replace(verdict.forgiveness, samples=100, snapped=1)
    (_, told) = verdict_lines([replace(verdict, forgiveness=rare)], None)
    assert "1 of 100 samples" in told and "(no design in more than one of a hundred)" in told


def test_a_section_twice_too_thick(judged, data):
    """The design's own elements use the limit twice over: stress is named, and a section that keeps
    the limit, with which the kit can be built."""
    design = design_from_dict(data)
    used = design_strength(design, design.deploy())["deployed"].largest
    material = {**data["material"], "elastic_limit": data["material"]["elastic_limit"] * used / 2}
    verdict, lines = judged(material=material)
    assert lines[0] == "free_form can't be built from this kit."
    assert [stop.cause for stop in verdict.stops] == ["stress"]
    assert "the design as given to 200 %" in lines[1]
    named = float(re.search(r"a section ([\d.]+) mm instead of 4 mm thick", lines[1]).group(1))
    assert 0.5 < named < 4.0  # the search lowers the stress as far as it can


def test_a_load_that_no_kit_carries(study, capsys):
    """What the command prints is what the result says and how the page begins."""
    push = {"joint": 5, "force": [0, 0, -20.0]}
    case = {"name": "a sack of sand", "points": [push], "deflection": {"span_over": 300}}
    light = {"name": "a sack", "points": [{"joint": 5, "force": [0, 0, -0.02]}]}
    file = study(load_cases=[case, light])
    out = file.parent / "out"
    assert main(["optimize", str(file), "--out", str(out), "--jobs", "1", "-q"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "free_form can't be built from this kit."
    assert re.search(
        r"under a sack of sand it deflects by [\d.]+ mm \([\d.]+ mm is allowed\)", lines[1]
    )
    assert re.search(r"a section [\d.]+ mm instead of 4 mm thick would", lines[1])
    assert re.match(r"Built, it keeps every joint within [\d.]+ % \([\d.]+ mm\) of", lines[2])
    assert lines[3].startswith("As given, free_form: under a sack of sand it deflects by")
    assert lines[4].endswith("index.html")
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    told = result["designs"][0]["buildable"]["loads"]["a sack of sand"]
    assert told["deflection"] > told["deflection_limit"] > 0
    assert result["verdict"] == lines[:2]
    page = (out / "index.html").read_text(encoding="utf-8")
    text = unescape(re.sub(r"<[^>]+>", " ", page.split("</h1>")[1]))
    words = re.sub(r"\s+", " ", text).strip()
    assert words.startswith(" ".join(lines[:2])) and "Can they be built?" in words
    # the design's card has the load that stops it, in the colour of what is wrong
    assert re.search(r"<dd class=bad>a sack of sand: deflects [\d.]+\xa0mm", page)
    assert re.search(r"<dd>a sack: deflects [\d.]+\xa0mm", page)  # which is carried
    assert "stress under it" in words
    # for the desk: a table of the loads, whose columns are told
    desk = file.parent / "export"
    assert main(["export", str(out), str(file), "--out", str(desk), "--force", "-q"]) == 0
    table = next(desk.rglob("loads.csv"))
    with open(table, encoding="utf-8") as lines:
        rows = {row["load_case"]: row for row in csv.DictReader(lines)}
    assert set(rows) == {"a sack of sand", "a sack"}
    assert float(rows["a sack of sand"]["deflection"]) == told["deflection"]
    assert float(rows["a sack"]["force_z"]) == pytest.approx(-0.02)
    assert_explained(table.parent)


class TestWords:
    def test_some_can_and_some_cannot(self):
        stops = [Stop("stress", f"reason {k}", "help" if k else None) for k in range(3)]
        verdicts = [
            Buildable("a"),
            Buildable("b", stops=tuple(stops)),
            Buildable("c"),
            Buildable("d", stops=(stops[1],)),
        ]
        first, second = verdict_lines(verdicts)
        assert first == "a and c can be built from this kit, b and d can't."
        assert second == "b: reason 0. Also reason 1; help. And 1 more. d: reason 1; help."
        twice = [*verdicts, Buildable("e", stops=(stops[1],))]  # said once of both
        assert verdict_lines(twice)[1].endswith("And 1 more. d, e: reason 1; help.")

    def test_all_can(self):
        assert verdict_lines([Buildable("a"), Buildable("b")])[0].startswith("Both designs can")
        three = [Buildable(name, 0.0, {"rest": 0.5}) for name in "abc"]
        first, second = verdict_lines(three)
        assert first.startswith("All 3 designs can")
        assert second.startswith("Opened from the assembly") and "at most 50 %" in second
        assert "isn't judged" not in second

    def test_stress_that_can_not_be_judged_is_said(self):
        """Without a limit no number is shown, and nothing would tell that none was looked at."""
        known, unknown = Buildable("a", 0.0, {"rest": 0.5}), Buildable("b", 0.0, {"rest": None})
        assert "their stress isn't judged" in verdict_lines([unknown, unknown])[1]
        assert "the others' stress isn't judged" in verdict_lines([known, unknown])[1]
        alone = verdict_lines([unknown])[1]
        assert "its stress isn't judged" in alone and "it ends in the shape" in alone

    def test_rows_fit_their_headings(self):
        headings, rows = verdict_rows([Buildable("a"), Buildable("b", fabrication=("x",))])
        assert all(len(row) == len(headings) for row in rows)
        assert rows[0][1] == "yes" and rows[1][-1] == "1 problem" and "worst load" not in headings

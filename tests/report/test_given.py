"""What stops an input design is said before any kit is sought for it, and stays in the result."""

import json
import logging
import re

import pytest
from support.grids import coarse_grid

from kop_exudyn.io.datasets import load_designs
from kop_exudyn.io.results import load_result
from kop_exudyn.report.kit_run import optimize_and_report
from kop_exudyn.report.sizes_run import smallest_and_report, tradeoff_and_report
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.settings import JobSettings, StageSettings
from kop_exudyn.search.stages import Stages

PARTS = {"linear": 2, "angular": 1}


@pytest.fixture(scope="module")
def files(repository, tmp_path_factory):
    """A sound grid, and the same with a section twice as thick as its limit lets it be."""
    data = coarse_grid(repository)
    folder = tmp_path_factory.mktemp("designs")
    for name, limit in (("sound", 4e7), ("weak", 4e6)):  # at 20 and 202 % of it
        content = {**data, "name": name, "material": {**data["material"], "elastic_limit": limit}}
        (folder / f"{name}.json").write_text(json.dumps(content), encoding="utf-8")
    return folder


class Reached(Exception):
    """The search has begun."""


def settings(**more):
    stages = StageSettings(
        schedule=(1e5,), relaxed_steps=2, assigned_steps=2, reassignments=0, leaps=0,
        effort="quick", requirements=Requirements(samples=2, **more),
    )  # fmt: skip
    return JobSettings(jobs=1, stages=stages, baselines=False)


def test_it_is_said_before_the_search(files, tmp_path, monkeypatch, caplog):
    """With the thickness that would keep the limit."""

    def begin(self):
        raise Reached

    monkeypatch.setattr(Stages, "direct", begin)
    with caplog.at_level(logging.WARNING, "kop_exudyn"), pytest.raises(Reached):
        optimize_and_report(load_designs(files), PARTS, out=tmp_path, settings=settings())
    (told,) = [r.getMessage() for r in caplog.records if r.getMessage().startswith("As given")]
    assert told.startswith("As given, weak: stressed to ")
    assert re.search(r"a section [\d.]+ mm instead of 4 mm thick would keep it", told)
    caplog.clear()
    with caplog.at_level(logging.WARNING, "kop_exudyn"), pytest.raises(Reached):
        optimize_and_report(
            load_designs(files), PARTS, out=tmp_path / "no", settings=settings(stress=False)
        )
    assert "As given" not in caplog.text


def test_result_and_page_tell_it(files, tmp_path):
    result = optimize_and_report(
        load_designs(files), PARTS, out=tmp_path / "out", settings=settings()
    )
    assert [one["verdict"] for one in result.given] == ["can be built", "can't be built"]
    assert [stop["cause"] for stop in result.given[1]["stops"]] == ["stress"]
    data = load_result(tmp_path / "out" / "result.json")
    assert data["warnings"] == result.warnings and len(result.warnings) == 1
    assert data["designs"][1]["input"]["buildable"] == result.given[1]
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert "As given, weak: stressed to" in page
    assert page.index("As given, weak") < page.index("<table")


@pytest.mark.parametrize("run", ["smallest", "tradeoff"])
def test_searches_over_sizes_say_it_too(files, tmp_path, monkeypatch, caplog, run):
    def begin(self):
        raise Reached

    monkeypatch.setattr(Stages, "direct", begin)
    asked = {"out": tmp_path / "out", "settings": settings()}
    with caplog.at_level(logging.WARNING, "kop_exudyn"), pytest.raises(Reached):
        if run == "smallest":
            smallest_and_report(load_designs(files), 1.0, PARTS, **asked)
        else:
            tradeoff_and_report(load_designs(files), [PARTS], **asked)
    assert sum(message.startswith("As given, weak") for message in caplog.messages) == 1

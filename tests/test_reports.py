"""Committed reports say what their data say: findings, tables and the page that leads to them."""

from __future__ import annotations

import csv
import json
import re
from html import unescape
from pathlib import Path

import pytest

from lib.index_page import first_sentence

REPORTS = Path(__file__).resolve().parents[1] / "reports"


def _data(folder: Path) -> dict:
    path = folder / "data.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def _text(page: str) -> str:
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]+>", " ", page)))


MADE = sorted(
    path.name
    for path in REPORTS.iterdir()
    if path.is_dir() and _data(path).get("environment", {}).get("commit")
)


@pytest.mark.parametrize("name", MADE)
def test_page_and_tables_are_those_of_the_data(name):
    data = _data(REPORTS / name)
    assert not data["quick"]
    if "finding" in data:
        html = (REPORTS / name / "index.html").read_text(encoding="utf-8")
        first = re.search(r"<h1>.*?</h1>\s*<p[^>]*>(.*?)</p>", html, re.DOTALL)
        assert first and _text(first[1]).strip() == re.sub(r"\s+", " ", data["finding"])
    for table in (REPORTS / name).glob("*.csv"):
        rows = data.get(table.stem)
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            continue
        with open(table, newline="", encoding="utf-8") as file:
            written = list(csv.DictReader(file))
        assert len(written) == len(rows), table
        for shown, row in zip(written, rows):
            for key in set(shown) & set(row):
                _same(shown[key], row[key], f"{table}: {key}")


def _same(shown: str, value: object, where: str) -> None:
    if isinstance(value, float):
        assert float(shown) == pytest.approx(value, rel=1e-3), where
    elif isinstance(value, str):  # a spreadsheet would take a sign at the beginning for a formula
        assert shown == ("'" if value.startswith(("=", "+", "-", "@")) else "") + value, where


def test_the_same_check_finds_a_wrong_number():
    with pytest.raises(AssertionError, match="a table"):
        _same("1.25", 1.26, "a table")


def test_the_page_of_all_reports_has_their_findings():
    page = _text((REPORTS / "index.html").read_text(encoding="utf-8"))
    for name in MADE:
        if finding := _data(REPORTS / name).get("finding"):
            assert first_sentence(re.sub(r"\s+", " ", finding)) in page, name


def test_the_kit_that_the_readme_shows_is_the_one_of_its_data():
    result = json.loads((REPORTS / "two_stage" / "result.json").read_text(encoding="utf-8"))
    page = _text((REPORTS / "two_stage" / "index.html").read_text(encoding="utf-8"))
    for line in result["verdict"]:
        assert line.rstrip(".") in page  # the page goes on with how far off the designs are
    for design in result["designs"]:
        assert f"{design['assigned']['fit']['max_percent']:.2g} %" in page, design["name"]

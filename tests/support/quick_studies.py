"""Studies in their quick mode, run as their commands do."""

from __future__ import annotations

import json
import runpy
import sys
from html import unescape
from pathlib import Path
from typing import Any

import pytest

STUDIES = Path(__file__).resolve().parents[2] / "studies"


def run(name: str, reports: Path, *arguments: str) -> Path:
    """Run a study; the folder of its report.

    reports : folder of all reports: studies find there what earlier ones computed
    """
    with pytest.MonkeyPatch.context() as patch:
        command = [name, "--quick", "--jobs", "1", "--out", str(reports / name), *arguments]
        patch.setattr(sys, "argv", command)
        runpy.run_path(str(STUDIES / f"{name}.py"), run_name="__main__")
    return reports / name


def data_of(reports: Path, name: str) -> dict[str, Any]:
    """The data of a study that has run."""
    return json.loads((reports / name / "data.json").read_text(encoding="utf-8"))


def words_of(page: Path) -> str:
    """A page with the characters and the spaces that are meant: numbers keep to their units."""
    return unescape(page.read_text(encoding="utf-8")).replace("\xa0", " ")


def found(name: str, reports: Path) -> dict[str, Any]:
    """Run a study, look whether its page says what its data say, and give these."""
    page = words_of(run(name, reports) / "index.html")
    data = data_of(reports, name)
    assert data["quick"] and data["finding"] in page
    assert page.count("<img") >= 1
    return data

"""The documentation: builds without a warning, and what its Python page shows is what happens."""

import doctest
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from kop_exudyn.io.studies import load_study

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-W",
        "--keep-going",
        "-q",
        "-d",
        out / "doctrees",
        ROOT / "docs",
        out,
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


def test_every_page_is_built_without_warnings(site):
    for page in (ROOT / "docs").rglob("*.md"):
        assert (site / page.relative_to(ROOT / "docs")).with_suffix(".html").is_file()


@pytest.mark.parametrize("name", ["c_shell", "grid", "umbrella"])
def test_class_pages_show_the_schemas_fields(site, name):
    html = (site / "classes" / f"{name}.html").read_text(encoding="utf-8")
    schema = json.loads(
        (ROOT / "kop_exudyn" / "structures" / name / f"{name}.schema.json").read_text(
            encoding="utf-8"
        )
    )
    for field in schema["properties"]:
        assert f">{field}<" in html


@pytest.mark.parametrize("name, least", [("api", 30), ("howto", 12)])
def test_python_lines_do_what_the_pages_say(name, least, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    # fences aren't output
    page = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8").replace("```", "")
    test = doctest.DocTestParser().get_doctest(
        page, {"folder": tmp_path}, name, f"docs/{name}.md", 0
    )
    result = doctest.DocTestRunner().run(test)
    assert result.attempted >= least and result.failed == 0


def test_the_study_file_of_the_how_to_page(tmp_path):
    page = (ROOT / "docs" / "howto.md").read_text(encoding="utf-8")
    content, *_ = re.findall(r"^```toml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    shutil.copytree(ROOT / "models" / "small", tmp_path, dirs_exist_ok=True)
    (tmp_path / "study.toml").write_text(content, encoding="utf-8")
    study = load_study(tmp_path / "study.toml")
    assert [design.name for design in study.designs()] == [
        "small sinh",
        "small exp",
    ] and study.counts == (1.0, 2.0)

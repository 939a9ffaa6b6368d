"""The documentation: builds without a warning, and what its Python page shows is what happens."""
import doctest
import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-d", out / "doctrees", ROOT / "docs", out]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


def test_every_page_is_built_without_warnings(site):
    for page in (ROOT / "docs").rglob("*.md"):
        assert (site / page.relative_to(ROOT / "docs")).with_suffix(".html").is_file()


@pytest.mark.parametrize("name", ["c_shell", "grid", "umbrella"])
def test_class_pages_show_the_schemas_fields(site, name):
    html = (site / "classes" / f"{name}.html").read_text(encoding="utf-8")
    schema = json.loads((ROOT / "kop_exudyn" / "structures" / f"{name}.schema.json").read_text(encoding="utf-8"))
    for field in schema["properties"]:
        assert f">{field}<" in html


def test_the_python_page(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8").replace("```", "")  # fences aren't output
    test = doctest.DocTestParser().get_doctest(page, {"folder": tmp_path}, "api.md", "docs/api.md", 0)
    result = doctest.DocTestRunner().run(test)
    assert result.attempted > 20 and result.failed == 0

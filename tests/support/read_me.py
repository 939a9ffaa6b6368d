"""What a folder's READ_ME.txt has to say."""

from __future__ import annotations

import re
from pathlib import Path

from kop_exudyn.files.read_me import columns_of


def assert_explained(folder: Path) -> None:
    """Every file and every column of a table stands there, with text of its own below."""
    lines = (folder / "READ_ME.txt").read_text(encoding="utf-8").splitlines()
    told: set[str] = set()
    group = ""
    for number, line in enumerate(lines):
        if line.startswith("    "):
            told |= set(re.split(r",\s+", group))
            continue
        before = lines[number - 1] if number else ""
        goes_on = before.endswith(",") and not before.startswith("    ")
        group = f"{group} {line}" if goes_on else line
    for path in folder.iterdir():
        if path.name != "READ_ME.txt":
            missing = {path.name, *columns_of(path)} - told
            assert not missing, (path.name, missing)

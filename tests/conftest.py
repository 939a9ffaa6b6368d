"""Fixtures for all tests."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the repository, for tests of its models, README and scripts."""
    return REPOSITORY


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Released data files that lie beside the repository and aren't part of it; the test is skipped
    without them."""
    folder = REPOSITORY.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("needs the released data files beside the repository")
    return folder


@pytest.fixture
def c_shell_data() -> dict:
    """The content of a valid C-shell design file: a uniform grid of 3 x 3 crossing straight
    curves."""
    lines = [[[-0.2, y], [2.2, y]] for y in (0.0, 1.0, 2.0)] + [
        [[x, -0.2], [x, 2.2]] for x in (0.0, 1.0, 2.0)
    ]
    return {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "c_shell",
        "name": "grid",
        "material": {"young": 2100.0, "poisson": 0.35},
        "section": {"type": "rectangle", "width": 0.02, "height": 0.01},
        "curves": [{"type": "polyline", "points": points} for points in lines],
        "crossings": "find",
        "free_ends": False,
        "rod_offset": 0.0,
        "opening": {"angle": 0.6, "side": "up"},
        "elements_per_piece": 2,
    }


@pytest.fixture
def write_json_file(tmp_path):
    """A function (name, data) that writes a JSON file for a test and gives its path."""

    def write(name: str, data) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(data), encoding="utf-8")
        return path

    return write

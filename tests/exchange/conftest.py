"""Drawn nets: an OBJ file, and a DXF document."""

from __future__ import annotations

import ezdxf
import pytest
from support.drawn import GRID


@pytest.fixture
def obj(tmp_path):
    path = tmp_path / "net.obj"
    path.write_text(GRID)
    return path


@pytest.fixture
def drawing():
    """A DXF document and its model space."""
    document = ezdxf.new("R2010")
    return document, document.modelspace()

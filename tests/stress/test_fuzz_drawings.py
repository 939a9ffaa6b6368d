"""Damaged drawings, studies and COMPAS meshes: read, or refused in one line."""
from __future__ import annotations

import io
import json
import logging

import ezdxf
import numpy as np
import pytest

from kop_exudyn.analysis.stress.mutations import mutate
from kop_exudyn.errors import InputError
from kop_exudyn.io.drawn_networks import read_network
from kop_exudyn.io.studies import load_study
from kop_exudyn.structures.mesh_files import read_mesh

OBJ = b"""v 0 0 0
v 2 0 0
v 0 1 0
v 2 1 0
v 0.5 -1 0
v 0.6 0.5 0
v 0.5 2 0
v 1 -1 0
v 1 2 0
l 1 2
l 3 4
l 5 6 7
l 8 9
"""
STUDY = b"""format = "kop_exudyn/study"
version = 1
designs = ["one.json", {file = "two.json", weight = 2}]
parts = {linear = 3}
[weights]
energy = 0.05
[settings]
seed = 2
schedule = [1e3, 1e5]
bounds.linear = {lower = 0.1, upper = [1, 2]}
"""
COMPAS = json.dumps({"dtype": "compas.datastructures/Mesh", "data": {
    "default_vertex_attributes": {"x": 0.0, "y": 0.0, "z": 0.0},
    "vertex": {str(k): {"x": k % 2, "y": k // 2, "z": 0.1 * k} for k in range(6)},
    "face": {"0": [0, 1, 3, 2], "1": [2, 3, 5], "2": [2, 5, 4]}}}).encode()


def drawing() -> bytes:
    """The part of a DXF file that matters, with every kind of curve."""
    document = ezdxf.new("R12")
    space = document.modelspace()
    for y in (0, 1):
        space.add_line((-0.2, y), (2.2, y))
    space.add_polyline2d([(0, -0.2), (0.1, 0.5), (0, 1.2)])
    space.add_arc((-8, 0.5), 10, -10, 10)
    text = io.StringIO()
    document.write(text)
    whole = text.getvalue()
    entities = whole.index("ENTITIES")
    return ("  0\nSECTION\n  2\n" + whole[entities:]).encode()


READERS = {"net.obj": (OBJ, read_network), "net.dxf": (drawing(), read_network), "study.toml": (STUDY, load_study),
           "mesh.json": (COMPAS, read_mesh)}


@pytest.mark.parametrize("name", READERS)
def test_damaged_files(name, tmp_path):
    content, read = READERS[name]
    for design in ("one.json", "two.json"):
        (tmp_path / design).touch()
    path = tmp_path / name
    path.write_bytes(content)
    read(path)  # valid as it is
    refused = 0
    logging.disable(logging.CRITICAL)  # of what is left out of drawings
    try:
        for seed in range(500):
            path.write_bytes(mutate(content, np.random.default_rng([seed, 7])))
            try:
                read(path)
            except InputError as error:
                refused += 1
                assert "\n" not in str(error) and len(str(error)) < 2000
    finally:
        logging.disable(logging.NOTSET)
    assert 50 < refused < 500

"""Every file of the corpus gives what stands beside its maker: counts, lengths, areas, or a
refusal."""

import sys
from pathlib import Path

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.exchange.drawn_networks import ReadingOptions
from kop_exudyn.exchange.imports import read_scaled
from kop_exudyn.geometry.mesh_files import read_mesh
from kop_exudyn.geometry.mesh_surface import is_disc
from kop_exudyn.geometry.triangles import TriangleSurface
from kop_exudyn.units import Units

FOLDER = Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER))

import kinds as drawings  # noqa: E402
import meshes  # noqa: E402

FILES = FOLDER / "files"


def read_net(name: str, options: dict):
    """The network of a drawing, as `kop import` reads it, its units and its findings."""
    options = dict(options)
    scale, unit, space = (options.pop(key, None) for key in ("scale", "unit", "space"))
    units = None if unit is None else Units(unit)
    reading = ReadingOptions(**options)
    drawn, units = read_scaled(FILES / name, reading, scale, units, space=bool(space))
    return drawn, drawn.network, units


@pytest.mark.parametrize("name", drawings.CASES)
def test_drawings(name):
    expected = drawings.CASES[name][1]
    if name.endswith(".3dm"):
        pytest.importorskip("rhino3dm")
    if isinstance(expected, drawings.Refused):
        with pytest.raises(InputError) as caught:
            read_net(name, expected.options)
        assert expected.message in str(caught.value) and "\n" not in str(caught.value)
        return
    drawn, net, units = read_net(name, expected.options)
    assert (len(net.strands), net.n_joints) == (expected.curves, expected.joints)
    length = sum(float(strand.lengths.sum()) for strand in net.strands)
    assert length == pytest.approx(expected.length, rel=expected.tolerance)
    assert (None if units is None else units.length) == expected.unit
    kinds = [finding.kind for finding in drawn.findings]
    found = {kind: kinds.count(kind) for kind in set(kinds) | set(expected.findings)}
    assert found == expected.findings, [f.text for f in drawn.findings]


@pytest.mark.parametrize("name", meshes.CASES)
def test_meshes(name):
    expected = meshes.CASES[name][1]
    if isinstance(expected, drawings.Refused):
        with pytest.raises(InputError) as caught:
            read_mesh(FILES / name)
        assert expected.message in str(caught.value) and name in str(caught.value)
        return
    notes: list[str] = []
    vertices, faces = read_mesh(FILES / name, notes=notes)
    assert (len(vertices), len(faces), len(notes)) == (
        expected.vertices,
        expected.faces,
        expected.notes,
    ), notes
    if expected.area is not None:
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
        assert area == pytest.approx(expected.area, rel=1e-5)
    assert is_disc(TriangleSurface(vertices, faces)) == expected.disc


def test_files_and_expectations_belong_together():
    names = {path.name for path in FILES.iterdir()}
    assert names == set(drawings.CASES) | set(meshes.CASES)
    assert len(names) >= 80


@pytest.mark.parametrize("name", ["lines.obj", "scissor_tips_15.obj", *list(meshes.CASES)[:12]])
def test_the_script_makes_these_files(name):
    """Not those of ezdxf, whose bytes change with its version."""
    make = (drawings.CASES | meshes.CASES)[name][0]
    assert (FILES / name).read_bytes() == make()

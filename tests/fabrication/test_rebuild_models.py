"""All small models of every class, laid out again from the workshop's files alone, to 0.1 mm: with
kits of few and of many parts, and with parts that slide.

Nothing is solved here: lamellas are laid out flat, piece by piece, and umbrella meshes as they are
assembled, before they are opened. Their equilibria follow from these lengths and turns.
"""

import numpy as np
import pytest
from support.workshop import Files, lay_out_all, realised

from kop_exudyn.fabrication.assembly import write_assembly_plan
from kop_exudyn.fabrication.blanks import Blanks
from kop_exudyn.fabrication.cutlist import write_cut_list
from kop_exudyn.fabrication.cutsheets import cut_sheets
from kop_exudyn.fabrication.dxf import write_dxf
from kop_exudyn.fabrication.options import CutOptions
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.structures.serving import served_by
from kop_exudyn.structures.stacking import stacked_groups, stacked_parameters

MM = 0.1
# m: sides that have room for their bolts, slits of a few millimetres
BOUNDS = {"slit": (np.array([0.05, 0.05, 0.0]), np.array([np.inf, np.inf, 0.004]))}


def small_shells(repository):
    return load_designs(repository / "models" / "small")


def grids(repository):
    return load_designs(repository / "models" / "grids")


def every_other_grid(repository):
    return grids(repository)[::2]


def kit_of(designs, sizes, seed=0):
    """Designs and their pieces of a kit of so many parts."""
    designs = served_by(designs, sizes)
    groups, q = stacked_groups(designs), stacked_parameters(designs)
    found = cluster(groups, q, sizes, seed=seed, bounds=BOUNDS)
    return designs, parts_list(found.kit, found.assignment, designs)


CASES = {
    "shells, few parts": (small_shells, {"linear": 3, "angular": 2}),
    "shells, many parts": (small_shells, {"linear": 9, "angular": 6}),
    "shells, slit parts": (small_shells, {"slit": 4, "angular": 3}),
    "grids, few parts": (grids, {"linear": 5, "angular": 3}),
    "grids, many parts": (every_other_grid, {"linear": 14, "angular": 8}),
    "grids, slit parts": (every_other_grid, {"slit": 6, "angular": 4}),
}


@pytest.fixture(scope="module", params=CASES, ids=lambda name: name.replace(", ", "-"))
def case(request, repository, tmp_path_factory):
    """Designs in metres, their pieces, the folder of files."""
    made, sizes = CASES[request.param]
    designs, parts = kit_of(made(repository), sizes)
    folder = tmp_path_factory.mktemp("workshop")
    blanks = Blanks(parts, "m", CutOptions(sheet=(4000.0, 2000.0)))
    # the files of `export_workshop` that are read, without the drawings, which take their time
    write_cut_list(folder / "cut_list.csv", blanks)
    for number, sheet in enumerate(cut_sheets(blanks), 1):
        write_dxf(folder / f"cut_sheet_{number}.dxf", sheet)
    for design in designs:
        stem = design.name.replace(" ", "_")
        write_assembly_plan(folder / f"assembly_{stem}.csv", parts, design.name, "m")
    return designs, parts, Files(folder), "slit" in sizes


def test_every_lamella_of_every_model_is_laid_out(case):
    _, parts, files, slit = case
    assert bool(files.slides) == slit
    compared = lay_out_all(parts, files, MM)
    assert compared >= sum(len(p.design.joints) for p in parts.designs)


def test_the_kits_differ(repository):
    """Few and many parts are other kits: what is laid out is not the input designs."""
    designs, few = kit_of(small_shells(repository), {"linear": 3, "angular": 2})
    _, many = kit_of(small_shells(repository), {"linear": 9, "angular": 6})
    for own in (few, many):
        q = np.concatenate([realised(p) - p.design.parameters for p in own.designs])
        assert np.abs(q).max() > 1e-3
    assert not np.allclose(realised(few.designs[0]), realised(many.designs[0]), atol=1e-4)

"""Folders of files for the workshop and for the desk."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path

import numpy as np

from ..drawing.colours import kit_colours, to_linear
from ..errors import InputError
from ..fabrication.assembly import write_assembly_plan
from ..fabrication.blanks import Blanks
from ..fabrication.cutlist import write_bill, write_cut_list
from ..fabrication.cutsheets import cut_sheets, template_sheets
from ..fabrication.dxf import write_dxf
from ..fabrication.options import CutOptions, Tolerances
from ..fabrication.pieces import PartsList, parts_list_of
from ..fabrication.placement import PlacedPieces
from ..fabrication.svg import write_svg
from ..files.files import file_stem, make_folder
from ..files.tables import write_csv
from ..search.objective import Evaluation
from ..search.result import KitResult
from ..structures.strength import materials_of, rod_strength
from .gltf import Solid, write_glb
from .meshes import RodMesh, sweep
from .polygons import write_obj, write_ply
from .result_tables import result_tables
from .vtk import element_fields, write_vtu

DESK_FORMATS = ("obj", "ply", "glb", "vtu", "csv")
SHEET_FORMATS = {"svg": write_svg, "dxf": write_dxf}

_GREY = np.array([0.62, 0.62, 0.62])  # rods that no part makes


def export_workshop(
    parts: PartsList,
    folder: str | Path,
    unit: str,
    *,
    options: CutOptions = CutOptions(),
    tolerances: Tolerances = Tolerances(),
    formats: Iterable[str] = tuple(SHEET_FORMATS),
    overwrite: bool = False,
) -> list[Path]:
    """Write the cut list, the bill of every design, assembly plans, cut sheets and templates;
    returns their paths.

    unit : the designs' unit of length
    formats : of the sheets, "svg" and "dxf"

    Raises InputError when a file exists already and `overwrite` is false, or for what can't be cut
    (see `templates`).
    """
    writers = {name: _known(name, SHEET_FORMATS, "formats") for name in formats}
    blanks = Blanks(parts, unit, options)
    blanks.check()
    sheets = {"cut_sheet": cut_sheets(blanks), "templates": template_sheets(blanks)}
    folder = make_folder(folder)
    done = [write_cut_list(folder / "cut_list.csv", blanks, tolerances, overwrite=overwrite)]
    for design in parts.designs:
        name, stem = design.design.name, file_stem(design.design.name)
        done.append(write_bill(folder / f"bill_{stem}.csv", parts, [name], overwrite=overwrite))
        done.append(
            write_assembly_plan(
                folder / f"assembly_{stem}.csv", parts, name, unit, overwrite=overwrite
            )
        )
    for title, found in sheets.items():
        for number, sheet in enumerate(found, 1):
            done += [
                write(folder / f"{title}_{number}.{suffix}", sheet, overwrite=overwrite)
                for suffix, write in writers.items()
            ]
    return done


def export_desk(
    result: KitResult,
    folder: str | Path,
    *,
    stage: str = "assigned",
    formats: Iterable[str] = DESK_FORMATS,
    overwrite: bool = False,
) -> list[Path]:
    """Write every design's states after a stage, and tables of the whole result; returns their
    paths.

    obj : centre lines; ply, glb : solids coloured by part; vtu : strains, stress resultants and
        utilisation

    Raises InputError when a file exists already and `overwrite` is false, or for a stage or format
    that isn't there.
    """
    formats = [_known(name, dict(zip(DESK_FORMATS, DESK_FORMATS)), "formats") for name in formats]
    outcomes = _known(stage, result.stages, "stage").designs
    folder, parts = make_folder(folder), parts_list_of(result)
    done = []
    for placed, outcome in zip(parts.designs, outcomes):
        if isinstance(outcome, Evaluation):
            for role, equilibrium in outcome.equilibria.items():
                path = folder / f"{file_stem(placed.design.name)}_{stage}_{role}"
                done += _write_state(
                    parts, PlacedPieces.of(placed, role), equilibrium, path, formats, overwrite
                )
    if "csv" in formats:
        done += [
            write_csv(folder / f"{name}.csv", rows, overwrite=overwrite)
            for name, rows in result_tables(result).items()
            if rows
        ]
    return done


def chain_colours(parts: PartsList, placed: PlacedPieces) -> np.ndarray:
    """(n_chains, 3) sRGB of the parts that a scene's rod pieces are made of."""
    colours = kit_colours(parts.kit.sizes)
    return np.array(
        [
            _GREY if piece is None else colours[piece.kind][piece.part]
            for piece in placed.chain_pieces
        ]
    )


def _write_state(
    parts: PartsList,
    placed: PlacedPieces,
    equilibrium,
    path: Path,
    formats: list[str],
    overwrite: bool,
) -> list[Path]:
    scene, done = placed.scene, []
    swept = cache(lambda: sweep(scene, equilibrium.state))  # for several formats, if for any
    colours = chain_colours(parts, placed)
    for suffix in formats:
        target = path.with_name(f"{path.name}.{suffix}")
        if suffix == "obj":
            done.append(write_obj(target, scene.polylines(equilibrium.state), overwrite=overwrite))
        elif suffix == "ply":
            done.append(write_ply(target, swept(), colours[swept().chains], overwrite=overwrite))
        elif suffix == "glb":
            units = placed.design.units
            solids = _solids(parts, placed, swept(), colours)
            metres = 1.0 if units is None else units.metres
            done.append(write_glb(target, solids, metres, overwrite=overwrite))
        elif suffix == "vtu":
            fields = element_fields(
                scene, equilibrium, rod_strength(scene, equilibrium, materials_of(placed.design))
            )
            done.append(write_vtu(target, scene, equilibrium, fields, overwrite=overwrite))
    return done


def _solids(
    parts: PartsList, placed: PlacedPieces, mesh: RodMesh, colours: np.ndarray
) -> list[Solid]:
    """One solid a part, named by its label: a layer each in programs that read GLB."""
    labels = np.array(
        ["other" if piece is None else parts.label(piece) for piece in placed.chain_pieces]
    )
    found = []
    for label in dict.fromkeys(labels.tolist()):
        faces = mesh.faces[(labels == label)[mesh.chains[mesh.faces[:, 0]]]]
        used, numbers = np.unique(faces, return_inverse=True)
        colour = to_linear(colours[mesh.chains[used[0]]])
        found.append(Solid(label, mesh.vertices[used], numbers.reshape(-1, 3), colour))
    return found


def _known(name: str, known, field: str):
    if name not in known:
        raise InputError(f"unknown (there are {', '.join(known)})", field=field, value=name)
    return known[name]

"""The folder for the desk: states of designs for other programs, and tables of a whole result."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..analysis.simulation import SimulationResult
from ..checks import check_choice, check_kind, choices
from ..fabrication.pieces import PartsList, parts_list_of
from ..files.files import file_stem, file_stems, make_folder, write_text
from ..files.tables import write_csv
from ..search.evaluation import Evaluation
from ..search.result import KitResult
from ..structures.base import Target
from ..units import Units
from ..wording import counted
from .compas_json import write_compas
from .desk_read_me import desk_read_me
from .gltf import common_origin, write_glb
from .meshes import sweep
from .polygons import write_mesh_obj, write_obj, write_ply
from .result_tables import part_rows, result_tables, rod_rows
from .rhino import write_rhino
from .states import DesignState, states_of_kit, states_of_simulation
from .vtk import write_vtu

DESK_FORMATS = ("obj", "ply", "glb", "vtu", "csv", "3dm", "compas")
_NEEDS = {"3dm": "rhino3dm", "compas": "compas"}  # what comes with extras


def available_formats() -> tuple[str, ...]:
    """The formats of `DESK_FORMATS` whose libraries are installed."""
    return tuple(f for f in DESK_FORMATS if f not in _NEEDS or find_spec(_NEEDS[f]) is not None)


def export_desk(
    result: KitResult,
    folder: str | Path,
    *,
    stage: str = "assigned",
    formats: Iterable[str] | None = None,
    overwrite: bool = False,
) -> list[Path]:
    """Write every design's states after a stage, and tables of the whole result; returns their
    paths.

    Parameters
    ----------
    result : of a kit optimisation
    folder : made where it isn't there
    stage : "direct", "unrelaxed", "relaxed" or "assigned"
    formats : of `DESK_FORMATS`; default: all whose libraries are installed. obj: centre lines in
        groups named by part and element, and the target; ply: solids coloured by part; glb: solids
        in metres, with the target; vtu: strains, stress resultants, utilisation and deviation; csv:
        tables; 3dm: Rhino, layers by part; compas: graph and mesh for COMPAS 2
    overwrite : whether files that exist are replaced

    Raises InputError when a file exists already and `overwrite` is false, or for a stage or format
    that isn't there.
    """
    check_kind("result", result, KitResult, "see optimize_kit and load_run")
    formats = _checked(formats)
    check_choice("stage", stage, result.stages)
    outcomes = result.stages[stage].designs
    folder, parts = make_folder(folder), parts_list_of(result)
    stems = file_stems([design.name for design in result.designs])
    done = []
    for number, outcome in enumerate(outcomes):
        if isinstance(outcome, Evaluation):
            target = result.references[number].target
            states = list(states_of_kit(parts, number, outcome, target))
            stem = f"{stems[result.designs[number].name]}_{stage}"
            done += _write_states(states, target, folder, stem, formats, parts, overwrite)
    if "csv" in formats:
        tables = result_tables(result) | {"parts": part_rows(parts)}
        done += _write_tables(tables, folder, overwrite)
    title = f"Kit of {counted(len(result.designs), 'design')}, stage {stage}: for other programs"
    return _with_read_me(done, folder, title, result.units, overwrite)


def export_simulation(
    result: SimulationResult,
    folder: str | Path,
    *,
    formats: Iterable[str] | None = None,
    overwrite: bool = False,
) -> list[Path]:
    """Write a simulated design's states, the one under its loads included; returns their paths.

    result : of `simulate`
    folder : made where it isn't there yet
    formats : as of `export_desk`

    Raises InputError when a file exists already and `overwrite` is false, or for unknown formats.
    """
    check_kind("result", result, SimulationResult, "see simulate")
    formats, folder = _checked(formats), make_folder(folder)
    states = list(states_of_simulation(result))
    stem = file_stem(result.design.name)
    done = _write_states(states, result.design.target, folder, stem, formats, None, overwrite)
    if "csv" in formats:
        rows = [row for state in states for row in rod_rows(state)]
        done += _write_tables({f"{stem}_rods": rows}, folder, overwrite)
    title = f"{result.design.name}: for other programs"
    return _with_read_me(done, folder, title, result.design.units, overwrite)


def _with_read_me(
    done: Sequence[Path], folder: Path, title: str, units: Units | None, overwrite: bool
) -> list[Path]:
    text = desk_read_me(title, units, done)
    return [*done, write_text(folder / "READ_ME.txt", text, overwrite=overwrite)]


def _write_states(
    states: Sequence[DesignState],
    target: Target,
    folder: Path,
    stem: str,
    formats: Sequence[str],
    parts: PartsList | None,
    overwrite: bool,
) -> list[Path]:
    """Files of one design's states: one each, or one for all of them where programs have layers."""
    labels = () if parts is None else all_labels(parts)
    units = states[0].design.units
    unit = None if units is None else units.length
    origin = common_origin(states)
    writers: dict[str, Callable[[Path, DesignState], Path]] = {
        "obj": lambda path, state: write_obj(
            path, state.lines, state.names, unit=unit, overwrite=overwrite
        ),
        "ply": lambda path, state: _write_ply(path, state, overwrite),
        "vtu": lambda path, state: write_vtu(path, state, labels, overwrite=overwrite),
        "glb": lambda path, state: write_glb(path, [state], origin=origin, overwrite=overwrite),
        "compas": lambda path, state: write_compas(path, state, overwrite=overwrite),
    }
    endings = {"compas": "compas.json"}
    done = [
        writers[suffix](folder / f"{stem}_{state.name}.{endings.get(suffix, suffix)}", state)
        for state in states
        for suffix in formats
        if suffix in writers
    ]
    if "3dm" in formats:
        done.append(write_rhino(folder / f"{stem}.3dm", states, overwrite=overwrite))
    if "obj" in formats:
        path = folder / f"{stem}_target.obj"
        done.append(
            write_mesh_obj(
                path,
                target.vertices + states[0].design.origin,
                target.faces,
                unit=unit,
                overwrite=overwrite,
            )
        )
    return done


def all_labels(parts: PartsList) -> tuple[str, ...]:
    """Labels of all parts of all kinds: their numbers in VTU files are their places here, from
    1."""
    return tuple(label for labels in parts.labels.values() for label in labels)


def _write_ply(path: Path, state: DesignState, overwrite: bool) -> Path:
    mesh = sweep(state.scene, state.equilibrium.state)
    placed = mesh.moved(state.placed)
    return write_ply(path, placed, state.colours[mesh.chains], overwrite=overwrite)


def _write_tables(
    tables: dict[str, list[dict[str, Any]]], folder: Path, overwrite: bool
) -> list[Path]:
    return [
        write_csv(folder / f"{name}.csv", rows, overwrite=overwrite)
        for name, rows in tables.items()
        if rows
    ]


def _checked(formats: Iterable[str] | None) -> list[str]:
    return choices("formats", available_formats() if formats is None else formats, DESK_FORMATS)

"""``kop export``: a finished kit as files for the workshop and for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from .output import add_json, report
from .values import number_pair, positive_number

if TYPE_CHECKING:
    from ..units import Units

HELP = "write cut lists, cut sheets, assembly plans and 3D files of a finished kit"
DESCRIPTION = """Reads the folder that `kop optimize` wrote, and writes two folders: workshop (cut
list, bills and assembly plans as CSV; labelled assembly drawings as SVG and PDF; cut sheets and
corner templates at true scale as SVG, and DXF with the extra [fab]) and desk (the assigned designs'
states as OBJ centre lines, PLY and GLB solids, VTU with strains, stresses and utilisation, and
tables as CSV)."""
EXAMPLES = """examples:
  kop export out/kit models/conformals --out out/files
  kop export out/kit study.toml --out out/files --sheet 2500,1250 --joint-hole 6
  kop export out/kit designs --out out/files --unit mm --only workshop"""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("result", type=Path, metavar="RESULT", help="folder of a finished run")
    parser.add_argument(
        "folder",
        type=Path,
        metavar="FOLDER|STUDY",
        help="folder of the designs that it was made from, or study file",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder to write to")
    parser.add_argument(
        "--unit",
        choices=("mm", "cm", "m", "in", "ft"),
        help="the designs' unit of length, where their files don't name it",
    )
    parser.add_argument(
        "--only", choices=("workshop", "desk"), help="write one of the folders (default: both)"
    )
    parser.add_argument(
        "--sheet",
        type=number_pair,
        metavar="WIDTH,HEIGHT",
        help="of the material, in mm (default: 1000,600)",
    )
    parser.add_argument(
        "--joint-hole",
        type=positive_number,
        metavar="MM",
        help="diameter of the holes at joints (default: 4)",
    )
    parser.add_argument(
        "--bolt-hole",
        type=positive_number,
        metavar="MM",
        help="diameter of the holes of corner plates (default: 3)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from importlib.util import find_spec

    from ..exchange.export import export_desk, export_workshop
    from ..fabrication.assembly_drawing import save_assembly_drawings
    from ..fabrication.options import CutOptions
    from ..fabrication.pieces import parts_list_of
    from ..io.datasets import load_designs
    from ..io.saved_runs import load_run

    given = {name: getattr(args, name) for name in ("sheet", "joint_hole", "bolt_hole")}
    options = CutOptions(**{name: value for name, value in given.items() if value is not None})
    result = load_run(args.result, load_designs(args.folder))
    unit = _unit(args, result.units)
    done: list[Path] = []
    if args.only != "desk":
        sheets = ["svg"] + (["dxf"] if find_spec("ezdxf") else [])
        done += export_workshop(
            parts_list_of(result),
            args.out / "workshop",
            unit,
            options=options,
            formats=sheets,
            overwrite=args.overwrite,
        )
        done += save_assembly_drawings(result, args.out / "workshop", overwrite=args.overwrite)
    if args.only != "workshop":
        done += export_desk(result, args.out / "desk", overwrite=args.overwrite)
    report(args, {"folder": args.out, "files": done}, f"{len(done)} files in {args.out}\n")
    return 0


def _unit(args: argparse.Namespace, units: Units | None) -> str:
    """The designs' unit of length: their files', or the one that is given."""
    from ..errors import InputError

    if units is None and args.unit is None:
        raise InputError(
            'the designs name no units: give --unit, or add "units": {"length": "m"} to their '
            "files",
            source=args.folder,
            field="--unit",
        )
    if units is not None and args.unit not in (None, units.length):
        raise InputError(
            f"the designs are in {units.length}",
            source=args.folder,
            field="--unit",
            value=args.unit,
        )
    return units.length if units is not None else args.unit

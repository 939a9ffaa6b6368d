"""``kop export``: a finished kit as files for the workshop and for other programs."""

from __future__ import annotations

import argparse
import logging
import os
from pathlib import Path
from typing import TYPE_CHECKING

from ..wording import counted
from .options import add_run_or_design, given
from .output import add_json, report
from .values import not_negative_number, number_list, number_pair, positive_number

if TYPE_CHECKING:
    from ..fabrication.options import CutOptions
    from ..units import Units

log = logging.getLogger(__name__)

# options of the workshop's sizes, as `CutOptions` has them
_SIZES = ("sheet", "stock", "kerf", "gap", "clearance", "joint_hole", "bolt_hole")

HELP = "write cut lists, cut sheets, assembly plans and 3D files of a finished kit, or of a design"
DESCRIPTION = """Of a finished kit (the folder that `kop optimize` wrote, with the folder of its
designs) it writes two folders. workshop: workshop.pdf to print (cut list, parts with dimensions,
bars to saw, sheets, assembly step by step); the same as tables: cut list, material, fasteners,
bars, and of every design its bill, assembly plan, steps and joints; assembly drawings as SVG; cut
sheets and templates at true scale as SVG and DXF. desk: the states of the
designs for other programs, and tables of the whole result.

Of a design file it deploys the design, and writes its states, the one under its loads included, for
other programs.

A kit that can't be built is refused: a design that is stressed beyond its limit or opens into
another state, a part that is too short for its holes. --force writes it anyway."""
EXAMPLES = """examples:
  kop export out/kit models/conformals --out out/files
  kop export out/kit study.toml --out out/files --sheet 2500,1250 --stock 3000,4500 --kerf 3.2
  kop export out/kit designs --out out/files --unit mm --only workshop --paper a4
  kop export models/grids/01_dome.json --out out/dome"""


def arguments(parser: argparse.ArgumentParser) -> None:
    add_run_or_design(parser)
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
        "--force", action="store_true", help="write files of a kit that can't be built, too"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist")
    add_json(parser)
    shop = parser.add_argument_group("workshop", "all in millimetres, whatever the designs are in")
    shop.add_argument(
        "--sheet",
        type=number_pair,
        metavar="W,H",
        help="size of a sheet (default: 1000,600); where straight pieces are longer, they are sawn "
        "from bars",
    )
    shop.add_argument(
        "--stock",
        type=number_list,
        metavar="L,L,...",
        help="lengths of the bars that straight pieces are sawn from (default: 2400,4800)",
    )
    for option, kind, help in (
        ("kerf", not_negative_number, "width of a saw cut, lost between pieces (default: 3)"),
        ("gap", not_negative_number, "between pieces on a sheet (default: 5)"),
        ("clearance", not_negative_number, "by which slots are wider than needed (default: 0.2)"),
        ("joint-hole", positive_number, "diameter of the holes at joints (default: the section's "
         "joint_hole, else 4)"),
        ("bolt-hole", positive_number, "diameter of the holes of corner plates (default: 3)"),
    ):  # fmt: skip
        shop.add_argument(f"--{option}", type=kind, metavar="MM", help=help)
    shop.add_argument(
        "--no-corners",
        action="store_true",
        help="strips as long as their axes, without corner plates: corners are joined otherwise",
    )
    shop.add_argument(
        "--tolerance",
        type=number_pair,
        metavar="MM,DEG",
        help="how exactly lengths and angles should be cut (default: 0.5,0.5, and at most 2.5 "
        "standard deviations of the errors that the designs were tried with)",
    )
    shop.add_argument(
        "--paper", choices=("a4", "a3"), default="a3", help="of workshop.pdf (default: %(default)s)"
    )


def run(args: argparse.Namespace) -> int:
    done, notes = _kit(args) if os.path.isdir(args.what) else (_design(args), [])
    text = "".join(f"{line}\n" for line in [*notes, f"{counted(len(done), 'file')} in {args.out}"])
    report(args, {"folder": args.out, "files": done, "notes": notes}, text)
    return 0


def _kit(args: argparse.Namespace) -> tuple[list[Path], list[str]]:
    """The files of a kit, and what is to be known of them."""
    from ..errors import InputError
    from ..exchange.export import export_desk
    from ..fabrication.blanks import Blanks
    from ..fabrication.folder import export_workshop
    from ..fabrication.limits import usual_options
    from ..fabrication.options import Tolerances
    from ..fabrication.pieces import parts_list_of
    from ..fabrication.readiness import obstacles, refuse
    from ..fabrication.sources import sources
    from ..io.datasets import load_designs
    from ..io.saved_runs import load_run

    if args.folder is None:
        raise InputError(
            "of a result, give also the folder of the designs that it was made from",
            source=args.what,
            field="FOLDER",
        )
    result = load_run(args.what, load_designs(args.folder))
    unit, parts = _unit(args, result.units), parts_list_of(result)
    options = _options(args, usual_options(result.designs))
    blanks = Blanks(parts, unit, options) if args.only != "desk" else None
    tried = Tolerances.tried(result.buildable, unit)
    tolerances = Tolerances(*args.tolerance) if args.tolerance else Tolerances().within(tried)
    if tried and (tolerances.length > tried.length or tolerances.angle > tried.angle):
        log.warning(
            "the designs were tried with smaller errors: %g mm and %g degrees hold nearly all",
            tried.length,
            tried.angle,
        )
    found = obstacles(result, blanks)
    note = "" if blanks is None else sources(blanks).note
    if not args.force:
        refuse(found)
    for sentence in found:
        log.warning("not fit to be built: %s", sentence)
    done: list[Path] = []
    if args.only != "desk":
        done += export_workshop(
            parts,
            args.out / "workshop",
            unit,
            options=options,
            tolerances=tolerances,
            paper=args.paper,
            title=f"Kit of {counted(len(parts.designs), 'design')}: {args.what.resolve().name}",
            warnings=found,
            force=args.force,
            overwrite=args.overwrite,
        )
    if args.only != "workshop":
        done += export_desk(result, args.out / "desk", overwrite=args.overwrite)
    return done, [note] if note else []


def _design(args: argparse.Namespace) -> list[Path]:
    from ..analysis.simulation import simulate
    from ..errors import InputError
    from ..exchange.export import export_simulation
    from ..io.designs import load_design

    for name in given(args, *_SIZES, "tolerance"):
        raise InputError(
            "is for a kit's workshop folder: a design alone has no parts to cut",
            field=f"--{name.replace('_', '-')}",
        )
    if args.folder is not None or args.only == "workshop":
        raise InputError(
            "a design alone has no parts to cut: find a kit first (kop optimize)",
            source=args.what,
            field="FOLDER" if args.folder is not None else "--only",
        )
    return export_simulation(simulate(load_design(args.what)), args.out, overwrite=args.overwrite)


def _options(args: argparse.Namespace, usual: CutOptions) -> CutOptions:
    """The usual sizes, and what is given instead."""
    from dataclasses import replace

    return replace(usual, **given(args, *_SIZES), corners=not args.no_corners)


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

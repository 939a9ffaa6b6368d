"""``kop view``: a finished kit, or one design deployed, as a page to turn around."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from .options import add_run_or_design
from .output import add_json, report
from .values import not_negative

if TYPE_CHECKING:
    from ..report.viewer import ViewerScene

HELP = "write a page that shows a finished kit, or a deployed design, in 3D"
DESCRIPTION = """Writes one self-contained HTML page with an orbitable 3D view; it needs no network.
Of a result (the folder that `kop optimize` wrote, with the folder of its designs): all designs in
all stages, rods with their true sections, coloured by part, deviation or utilisation, and where
each part is used. Of a design file: that design, deployed. Both with the target surface and a
slider for the opening."""
EXAMPLES = """examples:
  kop view out/kit models/conformals --out kit.html
  kop view models/conformals/03_exp.json --out exp.html"""


def arguments(parser: argparse.ArgumentParser) -> None:
    add_run_or_design(parser)
    parser.add_argument(
        "--out", type=Path, required=True, metavar="PAGE", help="page to write (.html)"
    )
    parser.add_argument(
        "--frames",
        type=not_negative,
        default=8,
        metavar="N",
        help="states to show on the way to the opening, at most (default: 8)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace the page if it exists")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from ..files.files import check_output_file
    from ..report.viewer import save_viewer

    check_output_file(args.out, overwrite=args.overwrite)
    page = _kit(args) if os.path.isdir(args.what) else _design(args)
    path = save_viewer(args.out, page, overwrite=args.overwrite)
    report(args, {"page": path}, f"{path}\n")
    return 0


def _kit(args: argparse.Namespace) -> ViewerScene:
    from ..errors import InputError
    from ..io.datasets import load_designs
    from ..io.saved_runs import load_run
    from ..report.viewer_scenes import kit_scene

    if args.folder is None:
        raise InputError(
            "of a result, give also the folder of the designs that it was made from",
            source=args.what,
            field="FOLDER",
        )
    return kit_scene(load_run(args.what, load_designs(args.folder)), frames=args.frames)


def _design(args: argparse.Namespace) -> ViewerScene:
    from ..analysis.simulation import simulate
    from ..errors import InputError
    from ..io.designs import load_design
    from ..report.viewer_scenes import design_scene

    if args.folder is not None:
        raise InputError(
            "expected the folder of a finished run in front of a folder of designs",
            source=args.what,
            field="RESULT",
        )
    result = simulate(load_design(args.what))
    return design_scene(result.design, result.equilibria, frames=args.frames)

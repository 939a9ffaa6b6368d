"""``kop view``: one design, deployed, as a page to turn around."""
from __future__ import annotations

import argparse
import sys
from pathlib import Path

HELP = "write a page that shows a deployed design in 3D"
DESCRIPTION = """Deploys a design and writes one self-contained HTML page with an orbitable 3D view of its states, rods with
their true sections, target surface, and a slider for the opening. It needs no network. `kop optimize` writes such a
page for all designs and stages of its result: viewer.html in its folder."""
EXAMPLES = """examples:
  kop view models/conformals/03_exp.json --out exp.html"""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("design", type=Path, metavar="DESIGN", help="design file (.json or .json.gz)")
    parser.add_argument("--out", type=Path, required=True, metavar="PAGE", help="page to write (.html)")
    parser.add_argument("--frames", type=int, default=8, metavar="N", help="states on the way (default: 8)")
    parser.add_argument("--overwrite", action="store_true", help="replace the page if it exists")


def run(args: argparse.Namespace) -> int:
    from ..analysis.simulation import simulate
    from ..io.designs import load_design
    from ..io.files import check_output_file
    from ..report.viewer import save_viewer
    from ..report.viewer_scenes import design_scene

    check_output_file(args.out, overwrite=args.overwrite)
    result = simulate(load_design(args.design))
    page = design_scene(result.design, result.equilibria, frames=max(args.frames, 0))
    sys.stdout.write(f"{save_viewer(args.out, page, overwrite=args.overwrite)}\n")
    return 0

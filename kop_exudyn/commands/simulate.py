"""``kop simulate``: one design, deployed."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from .output import add_json
from .values import gravity

HELP = "deploy one design and say how well it fits its target"
DESCRIPTION = """Deploys a design, has Exudyn confirm the equilibrium, and reports its energy, its
stability and how far its joints are from the target surface, and the largest stress in its rods.
With loads, from the design file or by --gravity, also the deflection and the stress under them."""
EXAMPLES = """examples:
  kop simulate models/conformals/01_sinh.json
  kop simulate design.json --json > state.json
  kop simulate models/grids/01_dome.json --gravity
  kop simulate design.json --gravity=0,0,-9810"""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "design", type=Path, metavar="DESIGN", help="design file (.json or .json.gz)"
    )
    parser.add_argument(
        "--gravity",
        nargs="?",
        type=gravity,
        const=gravity("9.81"),
        metavar="G",
        help="let the rods' weight act: an acceleration down the z axis (default: 9.81, for "
        "lengths in metres) or a vector X,Y,Z, in the design's units; instead of the design "
        "file's gravity. Materials need a density",
    )
    add_json(
        parser,
        "print JSON for other programs, joint positions included; of a simulation that fails, "
        "the design's name and the reason",
    )


def run(args: argparse.Namespace) -> int:
    from dataclasses import replace

    import numpy as np

    from ..analysis.simulation import simulate
    from ..errors import SimulationFailure
    from ..files.json_files import to_json
    from ..io.designs import load_design

    design = load_design(args.design)
    own = () if args.gravity is None else (replace(design.loads, gravity=np.array(args.gravity)),)
    try:
        result = simulate(design, *own).to_dict()
    except SimulationFailure as failure:
        if args.json:
            sys.stdout.write(to_json({"design": design.name, "failed": str(failure)}))
        raise
    sys.stdout.write(to_json(result) if args.json else _summary(result))
    return 0


def _summary(result: dict) -> str:
    """The result in a few lines."""
    exudyn, fit = result["exudyn"], result["fit"]
    rows = {
        "design": result["design"],
        "model": f"{result['elements']:,} elements, {result['unknowns']:,} unknowns",
        "deviation": f"max {fit['max_percent']:.3g} %, mean {fit['mean_percent']:.3g} % "
        "of the target's box diagonal",
        "displacement": f"max {result['displaced_percent']:.3g} % from the joints' own places",
        "elastic energy": f"{result['elastic_energy']:.6g}",
        "stable": "yes" if result["stable"] else "no",
        "solved in": f"{result['wall_s']:.2f} s, {result['newton_iterations']} Newton iterations",
        "Exudyn": f"{exudyn['version']}: {exudyn['newton_steps']} steps, "
        f"moved by {exudyn['moved']:.1e} of its size",
    }
    if result["opening_angle"] is not None:
        rows["opening angle"] = f"{result['opening_angle']:.4g} rad"
    rows |= {f"stress, {role}": _stress(strength) for role, strength in result["strength"].items()}
    if "loaded" in result:
        rows |= _under_load(result["loaded"])
    width = max(15, *map(len, rows))
    return "".join(f"{name:<{width}} {value}\n" for name, value in rows.items())


def _under_load(loaded: dict) -> dict[str, str]:
    """Rows about the loaded state."""
    deflection = loaded["deflection"]
    force = ", ".join(f"{component:.4g}" for component in loaded["total_force"])
    return {
        "load": f"({force}) in all, held at {len(loaded['supports'])} joints",
        "deflection": f"max {deflection['max']:.3g} "
        f"({deflection['max_percent']:.3g} % of the diagonal), "
        f"mean {deflection['mean']:.3g} ({deflection['mean_percent']:.3g} %)",
        "stress, loaded": _stress(loaded["strength"]),
        "stable, loaded": "yes" if loaded["stable"] else "no",
    }


def _stress(strength: dict) -> str:
    """The largest equivalent stress, and what it is of the elastic limit."""
    if strength["equivalent_stress"] is None:
        return "unknown: the rods have no section"
    share = strength["utilisation"]
    used = (
        ""
        if share is None
        else f", {100 * share:.3g} % of the elastic limit{': it yields' if share > 1 else ''}"
    )
    return f"{strength['equivalent_stress']:.4g}{used}"

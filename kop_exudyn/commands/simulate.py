"""``kop simulate``: one design, deployed."""
from __future__ import annotations

import argparse
import sys
from pathlib import Path

HELP = "deploy one design and say how well it fits its target"
DESCRIPTION = """Deploys a design, has Exudyn confirm the equilibrium, and reports its energy, its stability and
how far its joints are from the target surface."""
EXAMPLES = """examples:
  kop simulate models/conformals/01_sinh.json
  kop simulate design.json --json > state.json"""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("design", type=Path, metavar="DESIGN", help="design file (.json or .json.gz)")
    parser.add_argument("--json", action="store_true", help="print JSON for other programs, joint positions included; "
                        "of a simulation that fails, the design's name and the reason")


def run(args: argparse.Namespace) -> int:
    from ..analysis.simulation import simulate
    from ..errors import SimulationFailure
    from ..io.designs import load_design
    from ..io.json_files import to_json

    design = load_design(args.design)
    try:
        result = simulate(design).to_dict()
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
        "deviation": f"max {fit['max_percent']:.3g} %, mean {fit['mean_percent']:.3g} % of the target's box diagonal",
        "elastic energy": f"{result['elastic_energy']:.6g}",
        "stable": "yes" if result["stable"] else "no",
        "solved in": f"{result['wall_s']:.2f} s, {result['newton_iterations']} Newton iterations",
        "Exudyn": f"{exudyn['version']}: {exudyn['newton_steps']} steps, moved by {exudyn['moved']:.1e} of its size",
    }
    if result["opening_angle"] is not None:
        rows["opening angle"] = f"{result['opening_angle']:.4g} rad"
    return "".join(f"{name:<15} {value}\n" for name, value in rows.items())

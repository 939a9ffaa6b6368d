"""``kop simulate``: one design, deployed."""

from __future__ import annotations

import argparse
import logging
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..wording import counted
from .output import add_json, deviation_text
from .values import gravity

if TYPE_CHECKING:
    import numpy as np

    from ..structures.base import Design
    from ..structures.loads import LoadCase
    from ..units import Units

log = logging.getLogger(__name__)

HELP = "deploy one design and say how well it fits its target"
DESCRIPTION = """Deploys a design, has Exudyn confirm the equilibrium, and reports its energy, its
stability and how far its joints are from the target surface, and the largest stress in its rods.
With loads, from the design file or by --gravity, also the deflection and the stress under them."""
EXAMPLES = """examples:
  kop simulate models/conformals/01_sinh.json
  kop simulate design.json --json > state.json
  kop simulate models/grids/01_dome.json --gravity
  kop simulate design.json --gravity=0,0,-9810
  kop simulate models/grids/01_dome.json --gravity --sensitivities
  kop simulate models/umbrellas/hill.json --engine exudyn"""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "design", type=Path, metavar="DESIGN", help="design file (.json or .json.gz)"
    )
    parser.add_argument(
        "--gravity",
        nargs="?",
        type=gravity,
        const=(),
        metavar="G",
        help="let the rods' weight act: an acceleration down the z axis (default: standard "
        "gravity, where the design names its units) or a vector X,Y,Z, in the design's units; "
        "instead of the design file's gravity. Materials need a density",
    )
    for name, what in (
        ("line", "length on every rod"),
        ("area", "area of the target surface, as cladding,"),
        ("plan", "area in plan, as snow,"),
    ):
        parser.add_argument(
            f"--{name}",
            type=gravity,
            metavar="P",
            help=f"force per {what} down the z axis or a vector X,Y,Z, in the design's units; "
            f"instead of the design file's {name}",
        )
    parser.add_argument(
        "--engine",
        choices=("fast", "exudyn"),
        default="fast",
        help="what solves for the states: this package's solver, whose states Exudyn confirms, or "
        "Exudyn itself, from the same starts, which takes many times as long (default: "
        "%(default)s)",
    )
    parser.add_argument(
        "--sensitivities",
        action="store_true",
        help="say how energy, stress, deviation and, under loads, deflection change for 1 %% more "
        "of every modulus, density and dimension of a section, and of the loads",
    )
    add_json(
        parser,
        "print JSON for other programs, joint positions included; of a simulation that fails, "
        "the design's name and the reason",
    )


def run(args: argparse.Namespace) -> int:
    from ..analysis.simulation import simulate
    from ..errors import SimulationFailure
    from ..files.json_files import to_json
    from ..io.designs import load_design

    design = load_design(args.design)
    changes = {
        name: value
        for name in ("line", "area", "plan")
        if (value := getattr(args, name)) is not None
    }
    if args.gravity is not None:
        changes["gravity"] = _gravity(design, args)
    loads = _replaced(design, changes) if changes else None
    try:
        found = simulate(design, loads, engine=args.engine)
        result = found.to_dict()
        if args.sensitivities:
            from ..analysis.model_sensitivities import ModelSensitivities

            result["sensitivities"] = ModelSensitivities(found, found.loaded is not None).table()
    except SimulationFailure as failure:
        if args.json:
            sys.stdout.write(to_json({"design": design.name, "failed": str(failure)}))
        raise
    sys.stdout.write(to_json(result) if args.json else _summary(result, design.units))
    return 0


def _replaced(design: Design, changes: dict[str, Any]) -> LoadCase:
    """What acts by the command line instead of the file's own loads: load cases of the file are
    left out, and their supports kept where it names them for all."""
    from dataclasses import replace

    from ..errors import InputError
    from ..structures.loads import FILE_LOADS, LoadCase

    own = design.loads
    others = [case.name for case in design.load_cases if case.name != FILE_LOADS]
    if others:
        log.warning(
            "%s: with loads on the command line the load cases of the file are left out: %s",
            design.name,
            ", ".join(others),
        )
    if own.name != FILE_LOADS:  # the first of several cases, which says nothing of this one
        held = {None if c.supports is None else tuple(c.supports) for c in design.load_cases}
        own = LoadCase(supports=own.supports if len(held) == 1 else None)
    found = replace(own, **changes)
    if found.empty:
        raise InputError(
            "nothing acts: leave it out", field=", ".join(f"--{name}" for name in changes)
        )
    return found


def _gravity(design: Design, args: argparse.Namespace) -> np.ndarray:
    """(3,) the acceleration asked for, in the design's units."""
    import numpy as np

    from ..errors import InputError

    if args.gravity:
        return np.array(args.gravity)
    if design.units is None:
        raise InputError(
            "the design names no units: say how much, as --gravity 9.81 for metres or --gravity "
            ' 9810 for millimetres, or add "units": {"length": "m", "force": "N"} to its file',
            source=args.design,
            field="--gravity",
        )
    return np.array([0.0, 0.0, -design.units.gravity])


def _summary(result: dict, units: Units | None) -> str:
    """The result in a few lines."""
    from ..structures.deviation import OFF_TARGET
    from ..units import with_unit

    exudyn, fit = result["exudyn"], result["fit"]
    rows = {
        "design": result["design"],
        "model": f"{counted(result['elements'], 'element')}, "
        f"{counted(result['unknowns'], 'unknown')}",
        "deviation": deviation_text(fit, units)
        + (" (kop fit may lower it)" if fit["max_percent"] > OFF_TARGET else ""),
        "target's size": with_unit(result["target_size"], "length", units, 4),
        "displacement": f"max {result['displaced_percent']:.3g} % from the joints' own places",
        "elastic energy": with_unit(result["elastic_energy"], "energy", units, 6),
        "stable": "yes" if result["stable"] else "no",
        "solved in": f"{result['wall_s']:.2f} s, "
        f"{counted(result['newton_iterations'], 'Newton iteration')}"
        + (" by Exudyn" if result["engine"] == "exudyn" else ""),
        "Exudyn": f"{exudyn['version']}: {counted(exudyn['newton_steps'], 'step')}, "
        f"moved by {exudyn['moved']:.1e} of its size",
    }
    if fit["pieces_max"] != fit["max"]:
        rows["between joints"] = (
            f"max {fit['pieces_max_percent']:.3g} %, mean {fit['pieces_mean_percent']:.3g} %; "
            f"max {with_unit(fit['pieces_max'], 'length', units, 3)}"
        )
    if result["opening_angle"] is not None:
        angle = result["opening_angle"]
        rows["opening angle"] = f"{angle:.4g} rad, {math.degrees(angle):.4g}° in the mean"
        if result["assembly_angle"] is not None:
            rows["opening angle"] += f", from {math.degrees(result['assembly_angle']):.4g}°"
    if "hinge_limits" in result:
        rows["hinge limits"] = _limits(result["hinge_limits"])
    rows |= {
        f"stress, {role}": _stress(strength, units) for role, strength in result["strength"].items()
    }
    if "loaded" in result:
        rows |= _under_load(result["loaded"], result["load_cases"], units)
    for name, check in result.get("load_cases", {}).items():
        rows[f"load case {name}"] = _carried(check, units)
        if name != result.get("loaded", {}).get("case") and check["reactions"]:
            rows[f"load case {name}"] += f"; {_acting(check, units)}"
    for row in result.get("sensitivities", ()):
        shares = [f"{k} {row[k]:+.2f} %" for k in ("energy", "stress", "deflection") if k in row]
        shares.append(f"deviation {row['deviation']:+.4f} % of the size")
        rows[f"1 % more {row['parameter']} ({row['of']})"] = ", ".join(shares)
    width = max(15, *map(len, rows))
    return "".join(f"{name:<{width}} {value}\n" for name, value in rows.items())


def _limits(limits: dict) -> str:
    """How many joints touch their limits."""
    furthest = math.degrees(limits["furthest"])
    beyond = f", the furthest {furthest:.2g}° beyond" if furthest > 0 else ""
    return f"touched by {limits['touched']} of {counted(limits['hinges'], 'joint')}{beyond}"


def _under_load(loaded: dict, checks: dict, units: Units | None) -> dict[str, str]:
    """Rows about the loaded state; where there are several load cases, they name its own."""
    from ..units import with_unit

    deflection = loaded["deflection"]
    largest, mean = (with_unit(deflection[name], "length", units, 3) for name in ("max", "mean"))
    of = f", {loaded['case']}" if len(checks) > 1 else ""
    stable = "yes" if loaded["stable"] else "no"
    if not loaded["reached"]:
        critical = checks[loaded["case"]]["critical_factor"]
        stable = (
            f"no: it buckles at {critical:.3g} of the load; what is said of the loaded state is "
            "behind that jump"
        )
    return {
        f"load{of}": _acting(loaded, units),
        f"deflection{of}": f"max {largest} ({deflection['max_percent']:.3g} % of the size), "
        f"mean {mean} ({deflection['mean_percent']:.3g} %)",
        f"stress, {loaded['case'] if of else 'loaded'}": _stress(loaded["strength"], units),
        f"stable{of or ', loaded'}": stable,
    }


def _acting(loaded: dict, units: Units | None) -> str:
    """What acts, and what the supports bear."""
    from ..units import unit_of, with_unit

    force = ", ".join(f"{component:.4g}" for component in loaded["total_force"])
    text = f"({force}) {unit_of('force', units)} in all, held at "
    text += counted(len(loaded["supports"]), "joint")
    if loaded["largest_reaction"] is not None:
        text += f", reactions up to {with_unit(loaded['largest_reaction'], 'force', units, 4)}"
    return text


def _carried(check: dict, units: Units | None) -> str:
    """Deflection, stress and stability under a load case, beside what is asked for."""
    from ..units import with_unit

    found = []
    if check["deflection"] is not None:
        found.append(f"deflection {with_unit(check['deflection'], 'length', units, 3)}")
        if check["deflection_limit"] is not None:
            allowed = with_unit(check["deflection_limit"], "length", units, 3)
            found[-1] += f" of {allowed} allowed"
    if check["utilisation"] is not None:
        found.append(f"{100 * check['utilisation']:.3g} % of the elastic limit")
    over = "over " if check["critical_factor_is_larger"] else ""
    found.append(
        f"critical factor {over}{check['critical_factor']:.3g}, {check['factor']:g} is asked for"
    )
    return "; ".join(found)


def _stress(strength: dict, units: Units | None) -> str:
    """The largest equivalent stress, and what it is of the elastic limit."""
    from ..structures.strength import beyond_limit
    from ..units import with_unit

    if strength["equivalent_stress"] is None:
        return "unknown: the rods have no section"
    share = strength["utilisation"]
    used = "" if share is None else f", {100 * share:.3g} % of the elastic limit"
    if beyond_limit(share):
        used += ": it yields"
    return with_unit(strength["equivalent_stress"], "stress", units) + used

"""``kop fit``: a design's own lengths and angles, so that it comes nearer to its target."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .output import add_json, deviation_text, report, shows_progress
from .values import positive

if TYPE_CHECKING:
    from ..analysis.simulation import SimulationResult

HELP = "fit one design to its target, before a kit is sought"
DESCRIPTION = """Changes the lengths of a design's elements, the angles of its corners and the
places of its pins until the opened design lies as near to its target as it can, and writes it as a
new design file. Drawn nets and imported umbrella meshes are off their targets before any kit, by a
few percent. Neither curves nor supports are added, and loads don't count.

The new design is opened from its assembly, as a builder would. Where no better parameters are
found, or where with them it would open into another state, the new file has the design as it is,
and that is said. The search for a kit fits designs as well, together with their parts."""
EXAMPLES = """examples:
  kop fit dome.json --out dome_fitted.json
  kop fit models/conformals/01_sinh.json --out sinh_fitted.json --json"""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("design", type=Path, metavar="DESIGN", help="design file to start from")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="NEW", help="design file to write (.json)"
    )
    parser.add_argument(
        "--max-steps",
        type=positive,
        default=30,
        metavar="N",
        help="steps of the optimisation, at most (default: %(default)s)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace the file if it exists")
    add_json(parser, "print JSON for other programs")


def run(args: argparse.Namespace) -> int:
    from ..analysis.refit import refit
    from ..files.files import check_ending, check_output_file
    from ..files.json_files import JSON_ENDINGS, write_json
    from ..io.designs import own_content
    from ..io.rescaling import relocated
    from ..report.kit_run import progress_bar

    check_output_file(args.out, overwrite=args.overwrite)
    check_ending(args.out, JSON_ENDINGS, "--out")
    data = own_content(args.design)
    with progress_bar(shows_progress(args)) as bar:
        bar.set_description_str(data["name"])

        def observe(step: Any) -> None:
            bar.set_postfix_str(f"F = {step.value:.4g}", refresh=False)
            bar.update()

        found = refit(data, str(args.design), max_steps=args.max_steps, observer=observe)
    content = relocated(found.data, args.design.parent, args.out.parent)
    path = write_json(args.out, content, overwrite=args.overwrite)
    told = {"before": found.before.deviation, "after": found.after.deviation}
    after = _words(found.after) if found.changed else _unchanged(found.elsewhere)
    text = f"{path}\nbefore     {_words(found.before)}\nafter      {after}\n"
    told_all = {
        "design": path,
        "name": data["name"],
        "units": data.get("units"),
        "steps": found.steps,
        "changed": found.changed,
        **told,
    }
    report(args, told_all, text)
    return 0


def _words(result: SimulationResult) -> str:
    """How far the joints, and what is between them, are off."""
    from ..units import with_unit

    fit, units = result.deviation, result.design.units
    text = deviation_text(fit, units)
    if fit["pieces_max"] != fit["max"]:
        between = with_unit(fit["pieces_max"], "length", units, 3)
        text += f"; between joints max {fit['pieces_max_percent']:.3g} %, {between}"
    return text


def _unchanged(elsewhere: str) -> str:
    if elsewhere:
        return f"as before: with the parameters that fit better, the design {elsewhere}"
    return "as before: no parameters were found that fit better"

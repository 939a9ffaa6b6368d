"""``kop check``: whether designs suit each other, before a kit is sought for them."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..units import Units, common_units, in_millimetres, plain_number, unit_of
from ..wording import counted, counted_parts
from .options import add_designs, add_selection
from .output import add_json, report
from .values import number_pair, part_counts

if TYPE_CHECKING:
    from ..analysis.input_check import DesignCheck, ElementCost

HELP = "say what is wrong with designs, and which ones make a kit expensive"
DESCRIPTION = """Opens every design of a folder, or of a study file, by itself: whether it does, how
well it fits its own target, how much of its elastic limit it uses. Then compares the elements of
all designs: what each design shares in the projection energy of a kit of so many parts, how much
nearer the others would be to theirs without it, which of its elements are dearest, and what to do:
another size, another division of its curves, fitting it to its target first.

--harmonise looks for the sizes, within a range, at which the designs suit each other best, and
writes the rescaled designs to DIR. Sections stay as they are; the first design keeps its size."""
EXAMPLES = """examples:
  kop check models/conformals --designs 5 --parts linear=12,angular=5
  kop check study.toml --json
  kop check models/grids --parts linear=8,angular=4 --harmonise 0.8,1.25 --out out/harmonised"""

_DEFAULT_PARTS = 8  # of a kind, where nothing is said about it


def arguments(parser: argparse.ArgumentParser) -> None:
    add_designs(parser)
    parser.add_argument(
        "--parts",
        type=part_counts,
        metavar="KIND=N,...",
        help=f"parts of the kit that the designs are compared by (default: what the study says, "
        f"else {_DEFAULT_PARTS} of each kind)",
    )
    add_selection(parser)
    parser.add_argument(
        "--harmonise",
        type=number_pair,
        metavar="LOW,HIGH",
        help="rescale designs within this range, as 0.8,1.25, and write them to DIR",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for rescaled designs")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from ..analysis.input_check import check_designs
    from ..errors import InputError
    from ..io.rescaling import check_rescaled
    from ..io.studies import load_study
    from ..structures.serving import served_by
    from .optimize import singular

    if args.harmonise is not None and args.out is None:
        raise InputError("names the folder that --harmonise writes to: give it", field="--out")
    if args.harmonise is None and args.out is not None:
        raise InputError("is for rescaled designs: give the range as well", field="--harmonise")
    if args.harmonise is not None:
        low, high = args.harmonise
        if not 0 < low <= 1 <= high:
            raise InputError(
                "expected two factors, the first from 0 to 1, the second from 1 on",
                field="--harmonise",
                value=f"{low:g},{high:g}",
            )
    study = load_study(args.folder, args.designs)
    if args.out is not None:
        check_rescaled(study.files, args.out)
    given = {singular(k): n for k, n in {**study.parts, **(args.parts or {})}.items()}
    designs = served_by(study.designs(), given)
    counts: dict[str, int] = {}
    for design in designs:
        for group in design.groups:
            counts[group.kind] = counts.get(group.kind, 0) + len(group.indices)
    parts = {
        kind: given.get(kind, min(_DEFAULT_PARTS, count))
        for kind, count in sorted(counts.items())
        if count
    } | {kind: count for kind, count in given.items() if kind not in counts}
    checks = check_designs(designs, parts)
    data: dict[str, Any] = {"parts": parts, "designs": [check.to_dict() for check in checks]}
    text = _text(checks, parts, common_units({d.name: d.units for d in designs}))
    if args.harmonise is not None:
        found = _harmonised(args, study.files, designs, parts)
        data["harmonised"] = found
        text += _about_sizes(found)
    report(args, data, text)
    return 1 if any(check.failed for check in checks) else 0


def _harmonised(
    args: argparse.Namespace, files: Any, designs: Any, parts: Mapping[str, int]
) -> dict[str, Any]:
    """Look for sizes, write the designs at these; what came of it."""
    from ..analysis.input_check import harmonised
    from ..io.rescaling import save_rescaled

    sizes, before, after = harmonised(designs, parts, args.harmonise)
    written = save_rescaled(files, [sizes[design.name] for design in designs], args.out)
    return {
        "scales": sizes,
        "energy_before": before,
        "energy_after": after,
        "files": [str(path) for path in written],
    }


def _text(checks: list[DesignCheck], parts: Mapping[str, int], units: Units | None) -> str:
    how = "compared by" if len(checks) > 1 else "beside"
    lines = [f"{counted(len(checks), 'design')}, {how} a kit of {counted_parts(parts)}"]
    for check in checks:
        lines.append(f"\n{check.name}")
        if check.failed is None:
            used = [u for u in check.utilisation.values() if u is not None]
            strength = f", stress {100 * max(used):.0f} % of the elastic limit" if used else ""
            length = "" if check.max is None else f" ({in_millimetres(check.max, units)})"
            lines.append(
                f"  opens; deviation max {check.max_percent:.2g} %{length}, mean "
                f"{check.mean_percent:.2g} % of its size{strength}"
            )
        if len(checks) > 1:
            lines.append(
                f"  {check.elements_percent:.0f} % of the elements, {check.energy_percent:.0f} % "
                f"of the projection energy; without it the others' is "
                f"{check.others_gain_percent:.0f} % lower"
            )
        for cost in check.expensive[:1]:
            lines.append(
                f"  dearest: {cost.kind} element {cost.number} of {_sizes(cost, units)}, its part "
                f"of {_sizes(cost, units, part=True)}: {cost.percent:.2g} % of the energy"
            )
        lines += [f"  PROBLEM: {problem}" for problem in check.problems]
        lines += [f"  caution: {caution}" for caution in check.cautions]
        lines += [f"  advice: {advice}" for advice in check.advice]
    return "\n".join(lines) + "\n"


def _about_sizes(found: Mapping[str, Any]) -> str:
    sizes = ", ".join(f"{name} {scale:.4g}" for name, scale in found["scales"].items())
    less = 100 * (1 - found["energy_after"] / found["energy_before"])
    return f"\nsizes: {sizes}; {less:.0f} % less projection energy of lengths\n" + "".join(
        f"{path}\n" for path in found["files"]
    )


def _sizes(cost: ElementCost, units: Units | None, part: bool = False) -> str:
    """The parameters of an element or of its part, with their unit."""
    from ..kit.kinds import part_kind

    values = cost.part if part else cost.parameters
    if part_kind(cost.kind).angular:
        return " and ".join(f"{math.degrees(value):.4g}°" for value in values)
    numbers = " and ".join(plain_number(value) for value in values)
    return f"{numbers} {unit_of('length', units)}"

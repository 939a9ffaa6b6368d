"""``kop tradeoff``: kits of several sizes for the same designs."""

from __future__ import annotations

import argparse

from .options import (
    add_cost,
    add_designs,
    add_effort,
    add_processes,
    add_results,
    add_selection,
    given,
)
from .output import add_json, report, shows_progress
from .values import part_ranges

HELP = "find kits of several sizes, and show what each part more is worth"
DESCRIPTION = """Finds a kit for each of several sizes: from scratch, with the next larger kit as
one more start (with --effort quick from that kit alone), and again by splitting parts of the next
smaller one where that is better. No kit deviates more than a smaller one. DIR gets tradeoff.csv,
tradeoff.json, a figure, index.html, and a folder with the report of every kit. --resume goes on
where a run was stopped."""
EXAMPLES = """examples:
  kop tradeoff models/conformals --designs 5 --parts linear=2:12,angular=5 --out out/sizes
  kop tradeoff models/umbrellas --parts cells=1:12 --out out/umbrella_sizes --resume
  kop tradeoff models/grids --parts linear=2:12:2,angular=2:7 --out out/grid_sizes"""


def arguments(parser: argparse.ArgumentParser) -> None:
    add_designs(parser)
    parser.add_argument(
        "--parts",
        type=part_ranges,
        required=True,
        metavar="KIND=A:B,...",
        help="from how many to how many parts of each kind, as linear=2:12,angular=5; A:B:STEP "
        "leaves some out. Kinds with as many numbers grow together",
    )
    add_selection(parser)
    add_results(parser)
    add_cost(parser, "of a part, a piece, a cut; shown with every kit (default: part=1)")
    add_effort(parser)
    add_processes(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from dataclasses import replace

    from ..analysis.sizes import KitCost
    from ..errors import InputError
    from ..io.studies import load_study
    from ..report.environment import usable_cores
    from ..report.sizes_run import tradeoff_and_report
    from .optimize import singular

    study = load_study(args.folder, args.designs)
    ranges = {singular(kind): counts for kind, counts in args.parts.items()}
    lengths = {len(counts) for counts in ranges.values()} - {1}
    if len(lengths) > 1:
        raise InputError(
            "kinds that change need as many numbers", field="--parts", value=sorted(lengths)
        )
    steps = lengths.pop() if lengths else 1
    sizes = [
        {kind: counts[min(k, len(counts) - 1)] for kind, counts in ranges.items()}
        for k in range(steps)
    ]
    stages = replace(study.settings, **given(args, "effort", "leaps", "seed"))
    study = replace(study, settings=stages, baselines=False)
    designs = study.designs()
    cost = KitCost(**args.cost) if args.cost else KitCost()
    kits = tradeoff_and_report(
        designs,
        sizes,
        out=args.out,
        cost=cost,
        settings=study.job_settings(designs, args.jobs or usable_cores(), args.scheduler),
        inputs=study.files,
        resume=args.resume,
        overwrite=args.overwrite,
        progress=shows_progress(args),
        verdict=study.verdict,
    )
    page = args.out / "index.html"
    warnings = list(kits[0].result.warnings)
    report(
        args,
        {"page": page, "kits": [kit.row(cost) for kit in kits], "warnings": warnings},
        "".join(f"{line}\n" for line in (*warnings, page)),
    )
    return 0

"""``kop optimize``: one kit of parts for the designs of a folder or a study file."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..wording import counted_parts
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
from .values import (
    not_negative,
    not_negative_number,
    part_counts,
    percent,
    positive,
    positive_number,
    term_weights,
)

if TYPE_CHECKING:
    from ..io.studies import Study
    from ..search.requirements import Requirements
    from ..search.result import KitResult

HELP = "find one kit of parts for several designs"
DESCRIPTION = """Finds one kit of parts from which all designs of a folder, or of a study file, can
be built. DIR gets result.json, kit.json, the final states, figures and index.html, which shows
them. Checkpoints are written on the way: --resume goes on where a run was stopped, and gives the
same result. Running the same job again replaces its results.

A study file is TOML: format = "kop_exudyn/study", version = 1, designs (a list of files or
folders), and, if wanted, the tables parts, weights, settings and requirements. Options given here
come before what it says."""
EXAMPLES = """examples:
  kop optimize models/conformals --designs 3 --parts linear=12,angular=5 --out out/kit
  kop optimize models/conformals --designs 02_tanh,07_log --parts linear=8,angular=3 --out out/pair
  kop optimize models/conformals --parts linear=12,angular=5 --out out/kit --resume
  kop optimize study.toml --out out/kit --seed 1
  kop optimize models/conformals --designs 06_moebius --kit out/kit/kit.json --out out/another
  kop optimize models/conformals --designs 5 --max-deviation 1.5 --out out/smallest
  kop optimize models/conformals --designs 3 --stock store.csv --out out/from_stock
  kop optimize models/small --parts slit=4,angular=3 --out out/slits"""


_FIRST_PARTS = 8  # of a kind, where a search for the smallest kit begins


def arguments(parser: argparse.ArgumentParser) -> None:
    add_designs(parser)
    parser.add_argument(
        "--parts",
        type=part_counts,
        metavar="KIND=N,...",
        help="how many parts of each kind, as linear=12,angular=5 (default: what the study says); "
        "slit=6 instead of linear: beams with slits in place of their bolt holes, which realise an "
        "interval of lengths",
    )
    parser.add_argument(
        "--kit",
        type=Path,
        metavar="FILE",
        help="build the designs from this kit (a kit.json), whose parts stay as they are",
    )
    parser.add_argument(
        "--stock",
        type=Path,
        metavar="FILE",
        help="build the designs from pieces that exist: a table (CSV or JSON) of kind, parameters "
        "and how many there are; where they don't suffice, says which are missing",
    )
    parser.add_argument(
        "--together",
        action="store_true",
        help="with --stock: all designs stand at the same time (default: they are built one after "
        "the other from the same pieces)",
    )
    parser.add_argument(
        "--max-deviation",
        type=percent,
        metavar="PERCENT",
        help="find the smallest kit that keeps every design within this deviation from its target, "
        "in %% of its size; the search begins with --parts (default: 8 of each kind)",
    )
    add_cost(
        parser,
        "with --max-deviation: what is to be small, weights of a part, a piece and a cut "
        "(default: part=1)",
    )
    parser.add_argument(
        "--weights",
        type=term_weights,
        metavar="TERM=W,...",
        help="of the objective's terms, as energy=0.05,stress=0.1; share is that of the joints' "
        "own places in fit",
    )
    add_selection(parser)
    add_results(parser)
    add_processes(parser)
    parser.add_argument(
        "--max-steps",
        type=positive,
        metavar="N",
        help="accepted steps at most, in each round of either stage",
    )
    add_effort(parser)
    parser.add_argument(
        "--reuse",
        type=not_negative_number,
        metavar="W",
        help="fewer pieces to make, where the designs are built one after the other: for 1 %% less "
        "of them the objective may rise by W %% (default: 0)",
    )
    parser.add_argument(
        "--slit-cost",
        type=positive_number,
        metavar="W",
        help="of slit parts: the dearer, the shorter their slits; slits of a tenth of the median "
        "length count like joints 0.07 %% times the root of W / 1e-4 away from the target "
        "(default: 1e-3)",
    )
    parser.add_argument(
        "--published",
        action="store_true",
        help="also find a kit of as many parts by the published method (BFGS, nearest parts), to "
        "compare with; takes several times as long",
    )
    parser.add_argument(
        "--redeployments",
        type=not_negative,
        metavar="N",
        help="how often the second stage goes on from where the designs open into, while that is "
        "another state (default: 4)",
    )
    parser.add_argument(
        "--safety",
        type=positive_number,
        metavar="F",
        help="factor by which the elastic limit is divided (default: 1)",
    )
    parser.add_argument(
        "--without",
        action="append",
        default=[],
        choices=("opening", "stress", "tolerance", "loads", "all"),
        help="don't require that designs open by themselves, that stress keeps below the elastic "
        "limit, that errors of the workshop make nothing snap, that loads are carried, or "
        "anything: to see what that costs; may be given several times",
    )
    parser.add_argument(
        "--samples",
        type=not_negative,
        metavar="N",
        help="sets of workshop errors that each design's verdict is tried with; errors are data of "
        "the study (default: 20)",
    )
    add_json(
        parser,
        "print JSON for other programs: the verdict, the paths of page, result and kit, the fits",
    )


def run(args: argparse.Namespace) -> int:
    from dataclasses import replace

    from ..errors import InputError
    from ..io.kits import load_kit
    from ..io.stocks import load_stock
    from ..io.studies import load_study
    from ..kit.parts import Kit
    from ..kit.stock import Stock
    from ..provenance import usable_cores
    from ..report.kit_run import optimize_and_report

    study = load_study(args.folder, args.designs)
    if args.kit is not None and args.parts:
        raise InputError(
            "a kit says how many parts there are: give --kit or --parts",
            field="--parts",
        )
    if args.stock is not None and (args.kit is not None or args.parts):
        raise InputError(
            "a stock says which parts there are: give it without --kit and --parts",
            field="--stock",
        )
    if args.together and args.stock is None:
        raise InputError("says how a stock is used: give it with --stock", field="--together")
    if args.published and (args.kit or args.stock or args.max_deviation is not None):
        raise InputError(
            "finds a kit of as many parts as --parts says: give it without --kit, --stock and "
            "--max-deviation",
            field="--published",
        )
    kit: Kit | Stock | None = None
    if args.kit is not None:
        kit = load_kit(args.kit)
    elif args.stock is not None:
        kit = load_stock(args.stock, together=args.together)
    parts = {singular(k): count for k, count in (args.parts or study.parts).items()}
    if args.max_deviation is not None:
        if kit is not None:
            raise InputError(
                "looks for a kit of its own: give it without --kit and --stock",
                field="--max-deviation",
                value=args.max_deviation,
            )
        return _smallest(args, study, parts)
    if args.cost:
        raise InputError(
            "says which kit is the smallest: give it with --max-deviation", field="--cost"
        )
    if not parts and kit is None:
        raise InputError(
            "says nothing of the parts: --parts, --kit or --stock is required", source=args.folder
        )
    study = _as_asked(args, study)
    designs = study.designs()
    result = optimize_and_report(
        designs,
        None if kit is not None else parts,
        out=args.out,
        inputs=study.files,
        resume=args.resume,
        settings=replace(
            study.job_settings(designs, args.jobs or usable_cores(), args.scheduler),
            published=args.published,
        ),
        overwrite=args.overwrite,
        progress=shows_progress(args),
        kit=kit,
        verdict=study.verdict,
    )
    failed = [
        design.name
        for n, design in enumerate(result.designs)
        if "failed" in result.summary("assigned", n)
    ]
    page = args.out / "index.html"
    report(
        args,
        {
            "page": page,
            "result": args.out / "result.json",
            "kit": args.out / "kit.json",
            "designs": [
                {
                    "name": design.name,
                    **result.summary("assigned", n),
                    **({"buildable": result.buildable[n]} if result.buildable else {}),
                }
                for n, design in enumerate(result.designs)
            ],
            "verdict": list(result.verdict),
            "warnings": list(result.warnings),
        },
        _lines(result, page),
    )
    if failed:
        sys.stderr.write(f"kop: these designs can't be built from the kit: {', '.join(failed)}\n")
    return 1 if failed else 0


def _lines(result: KitResult, page: Path) -> str:
    """The verdict, how far the designs are off, warnings, where the page is."""
    from ..report.kit_cards import deviation_line

    lines = (*result.verdict, deviation_line(result), *result.warnings, page)
    return "".join(f"{line}\n" for line in lines if line)


def _as_asked(args: argparse.Namespace, study: Study) -> Study:
    """The study with what the options change of its settings, weights and verdict."""
    from dataclasses import replace

    from ..search.weights import Weights

    Weights.of(args.weights or {})  # names that aren't terms are found before anything is read
    required = _required(args, study.settings.requirements)
    samples = study.verdict.samples if args.samples is None else args.samples
    return replace(
        study,
        settings=replace(study.settings, requirements=required, **_given(args)),
        weights={**study.weights, **(args.weights or {})},
        verdict=replace(study.verdict, samples=samples),
    )


def _smallest(args: argparse.Namespace, study: Study, parts: dict[str, int]) -> int:
    """The smallest kit within a deviation."""
    from dataclasses import replace

    from ..analysis.sizes import KitCost
    from ..report.environment import usable_cores
    from ..report.sizes_run import smallest_and_report
    from ..structures.serving import served_by

    study = replace(_as_asked(args, study), baselines=False)
    designs = served_by(study.designs(), parts)
    counts: dict[str, int] = {}
    for design in designs:
        for group in design.groups:
            counts[group.kind] = counts.get(group.kind, 0) + len(group.indices)
    first = {
        kind: parts.get(kind, min(_FIRST_PARTS, count)) for kind, count in counts.items() if count
    }
    cost = KitCost(**args.cost) if args.cost else KitCost()
    chosen, kept = smallest_and_report(
        designs,
        args.max_deviation,
        {**first, **parts},
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
    row = chosen.row(cost)
    report(
        args,
        {
            "page": page,
            "kit": args.out / "kit.json",
            "within": kept,
            "verdict": list(chosen.result.verdict),
            "warnings": list(chosen.result.warnings),
            **row,
        },
        _lines(chosen.result, page) + f"{counted_parts(chosen.sizes)}, largest "
        f"deviation {chosen.max_percent:.3g} %\n",
    )
    if not kept:
        sys.stderr.write(f"kop: no kit that was tried keeps within {args.max_deviation:g} %\n")
    return 0 if kept else 1


def _given(args: argparse.Namespace) -> dict[str, Any]:
    """The stages' settings that options give."""
    own = given(args, "effort", "seed", "leaps", "reuse", "slit_cost", "redeployments")
    if args.max_steps is not None:
        own |= dict.fromkeys(("relaxed_steps", "assigned_steps", "round_steps"), args.max_steps)
    return own


def _required(args: argparse.Namespace, known: Requirements) -> Requirements:
    """A study's requirements with what options say of them."""
    from dataclasses import replace

    changes: dict[str, Any] = {}
    for name in ("opening", "stress", "loads"):
        if {name, "all"} & set(args.without):
            changes[name] = False
    if {"tolerance", "all"} & set(args.without):
        changes["samples"] = 0
    if args.safety is not None:
        changes["safety"] = args.safety
    return replace(known, **changes)


def singular(kind: str) -> str:
    """The kind's name; its plural is understood as well."""
    from ..kit.kinds import kind_names, part_kind

    name = kind[:-1] if kind.endswith("s") and kind[:-1] in kind_names() else kind
    part_kind(name)
    return name

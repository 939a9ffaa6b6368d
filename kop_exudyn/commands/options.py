"""Options that several commands have."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from .values import design_selection, kit_cost, not_negative, positive


def given(args: argparse.Namespace, *names: str) -> dict[str, Any]:
    """Those of these options that were given, by name: others stay as a study has them."""
    return {name: value for name in names if (value := getattr(args, name)) is not None}


def add_designs(parser: argparse.ArgumentParser) -> None:
    """Add the folder of designs, or a study."""
    parser.add_argument(
        "folder",
        type=Path,
        metavar="FOLDER|STUDY",
        help="folder of design files, or a study file (.toml)",
    )


def add_selection(parser: argparse.ArgumentParser) -> None:
    """Add --designs."""
    parser.add_argument(
        "--designs",
        type=design_selection,
        metavar="N|NAMES",
        help="the first N designs, or names of files without .json (default: all)",
    )


def add_cost(parser: argparse.ArgumentParser, help: str) -> None:
    """Add --cost."""
    parser.add_argument("--cost", type=kit_cost, metavar="part=W,...", help=help)


def add_effort(parser: argparse.ArgumentParser) -> None:
    """Add --effort and --leaps."""
    parser.add_argument(
        "--leaps",
        type=not_negative,
        metavar="N",
        help="how often many elements get other parts at once, to leave a local minimum: more find "
        "better kits and take longer (default: 3)",
    )
    parser.add_argument(
        "--effort",
        choices=("quick", "normal", "thorough"),
        help="from how many starts the parts are optimised (default: normal, the best two of a "
        "dozen; quick: that of the relaxed stage alone; thorough: the best eight of many, then "
        "exchanges)",
    )


def add_results(parser: argparse.ArgumentParser) -> None:
    """Add --out, and how a search treats what is there already."""
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder for the results"
    )
    parser.add_argument("--resume", action="store_true", help="go on from the checkpoints in DIR")
    parser.add_argument(
        "--overwrite", action="store_true", help="write to DIR even if it holds something else"
    )


def add_processes(parser: argparse.ArgumentParser) -> None:
    """Add --jobs, --scheduler and --seed."""
    parser.add_argument(
        "--jobs",
        type=positive,
        metavar="N",
        help="processes that solve designs (default: one a core); the result doesn't depend on it",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="of a running Dask scheduler, as tcp://127.0.0.1:8786, whose workers solve the "
        "designs instead; the same result (needs the extra kop_exudyn[cluster])",
    )
    parser.add_argument(
        "--seed", type=not_negative, metavar="N", help="of the clustering (default: 0)"
    )


def add_run_or_design(parser: argparse.ArgumentParser) -> None:
    """Add a finished run with the folder of its designs, or a design."""
    parser.add_argument(
        "what",
        type=Path,
        metavar="RESULT|DESIGN",
        help="folder of a finished run, or a design file (.json or .json.gz)",
    )
    parser.add_argument(
        "folder",
        type=Path,
        nargs="?",
        metavar="FOLDER|STUDY",
        help="of a result: the folder of the designs that it was made from, or the study file",
    )

"""What commands write to standard output: a few lines for people, or JSON for other programs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..units import Units


def add_json(parser: argparse.ArgumentParser, help: str = "print JSON for other programs") -> None:
    """Add the option --json, which every command has."""
    parser.add_argument("--json", action="store_true", help=help)


def shows_progress(args: argparse.Namespace) -> bool:
    """Whether a bar is drawn on standard error: on terminals, which files and pipes are not."""
    return not args.quiet and sys.stderr.isatty()


def report(args: argparse.Namespace, data: Mapping[str, Any], text: str) -> None:
    """Write a command's outcome: with --json the data, otherwise the text."""
    from ..files.json_files import to_json

    sys.stdout.write(to_json(data) if args.json else text)


def deviation_text(fit: Mapping[str, float], units: Units | None) -> str:
    """How far a design's joints are off its target.

    fit : the field "fit" of results
    """
    from ..units import with_unit

    return (
        f"max {fit['max_percent']:.3g} %, mean {fit['mean_percent']:.3g} % of the target's size; "
        f"max {with_unit(fit['max'], 'length', units, 3)}"
    )

"""What commands write to standard output: a few lines for people, or JSON for other programs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from typing import Any


def add_json(parser: argparse.ArgumentParser, help: str = "print JSON for other programs") -> None:
    """Add the option --json, which every command has."""
    parser.add_argument("--json", action="store_true", help=help)


def report(args: argparse.Namespace, data: Mapping[str, Any], text: str) -> None:
    """Write a command's outcome: with --json the data, otherwise the text."""
    from ..files.json_files import to_json

    sys.stdout.write(to_json(data) if args.json else text)

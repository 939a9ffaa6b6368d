"""``kop examples``: copies of the designs that come with the package."""

from __future__ import annotations

import argparse
from pathlib import Path

from .output import add_json, report

HELP = "copy the example designs into a folder"
DESCRIPTION = """Copies the designs that come with the package into DIR: C-shells (conformals), grids, umbrella meshes
(umbrellas), small C-shells for trying things out (small). Files that are there already stay as they are, unless
--overwrite is given."""  # noqa: E501
EXAMPLES = """examples:
  kop examples models
  kop simulate models/small/01_sinh.json"""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("out", type=Path, metavar="DIR", help="folder to copy to")
    parser.add_argument("--overwrite", action="store_true", help="replace files that are there")
    add_json(parser, "print JSON for other programs: the paths of the files")


def run(args: argparse.Namespace) -> int:
    from ..io.examples import copy_examples

    files = copy_examples(args.out, overwrite=args.overwrite)
    folders = sorted({str(file.parent) for file in files})
    report(args, {"files": files}, "".join(f"{folder}\n" for folder in folders))
    return 0

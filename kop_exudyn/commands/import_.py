"""``kop import``: a released umbrella mesh as a design file of our own."""
from __future__ import annotations

import argparse
import sys
from pathlib import Path

HELP = "turn a released umbrella mesh into a design file"
DESCRIPTION = """Reads an umbrella mesh in the format of its public release (JSON, gzipped or not) and writes it as a design of
this project, in millimetres. Such files can also be used directly wherever a design is expected."""
EXAMPLES = """examples:
  kop import hemisphere_5t.json.gz --out hemisphere.json
  kop import hemisphere_5t.json.gz --out hemisphere.json --plates rigid"""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="released umbrella mesh (.json or .json.gz)")
    parser.add_argument("--out", type=Path, required=True, metavar="DESIGN", help="design file to write (.json)")
    parser.add_argument("--plates", choices=("rods", "rigid"), default="rods", help="model of the plates: rods that bend, "
                        "as released, or rigid bodies, with fewer unknowns (default: %(default)s)")
    parser.add_argument("--overwrite", action="store_true", help="replace the file if it exists")


def run(args: argparse.Namespace) -> int:
    from ..errors import InputError
    from ..io.files import check_output_file
    from ..io.json_files import read_json, write_json
    from ..structures.umbrella_import import import_release
    from ..structures.umbrella_release import is_release

    check_output_file(args.out, overwrite=args.overwrite)
    data = read_json(args.file)
    if not is_release(data):
        raise InputError("isn't a released umbrella mesh", source=args.file)
    name = args.file.name.removesuffix(".gz").removesuffix(".json")
    write_json(args.out, import_release(data, name, str(args.file), args.plates), overwrite=args.overwrite)
    sys.stdout.write(f"{args.out}\n")
    return 0

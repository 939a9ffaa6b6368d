"""``kop import``: a drawing of curves, a surface or a released umbrella mesh, as a design file of
our own."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

from .output import add_json, report
from .values import angle, held_joints, number_pair, patch, positive_number

HELP = "turn a drawing, a surface or a released umbrella mesh into a design file"
DESCRIPTION = """Writes a design file from

  a drawing (.obj: its polylines; .dxf, with the extra [fab]: lines, polylines, arcs, circles, ellipses, splines):
  a C-shell, its curves hinged wherever they cross; or, with --as grid, a grid of lamellas over its curves on a surface,
  drawn in plan. The drawing lies in a plane parallel to two axes. Pieces that meet end to end without a sharp corner
  become one curve.

  a surface (with --patch; a mesh: .obj, .ply, .stl, or .json of COMPAS): an umbrella mesh in the shape of its middle,
  in millimetres, the arms as long as the cells have to grow.

  an umbrella mesh in the format of its public release (.json or .json.gz): the same mesh, in millimetres. Such files
  can also be used directly wherever a design is expected."""  # noqa: E501  # a command on one line can be copied
EXAMPLES = """examples:
  kop import net.dxf --out net.json --opening 0.6 --section 0.03,0.004 --material 2.1e9,0.35
  kop import net.obj --as c_shell --out net.json --opening 35deg --section 30,4 --material 2100,0.35 --scale 1000
  kop import plan.dxf --as grid --surface vault.obj --out vault.json --section 0.004,0.05 --material 1.1e10,0.3
  kop import dome.ply --as umbrella --patch hexagon,3 --out dome.json --scale 1000
  kop import hemisphere_5t.json.gz --out hemisphere.json --plates rigid"""  # noqa: E501  # a command on one line can be copied

_CLASSES = ("c_shell", "grid", "umbrella")


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "file",
        type=Path,
        metavar="FILE",
        help="drawing (.obj, .dxf), surface (.obj, .ply, .stl, "
        ".json) or released umbrella mesh (.json, .json.gz)",
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DESIGN", help="design file to write (.json)"
    )
    parser.add_argument(
        "--as",
        dest="kind",
        choices=_CLASSES,
        help="class of the design (default: c_shell of .obj and .dxf, umbrella of others)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace the file if it exists")
    shell = parser.add_argument_group(
        "drawings",
        "section and material are needed, of C-shells also the opening, of grids also the surface",
    )
    shell.add_argument(
        "--opening",
        type=angle,
        metavar="ANGLE",
        help="change of the mean angle between curves from "
        "assembly to deployment, in radians or as 35deg",
    )
    shell.add_argument(
        "--surface",
        type=Path,
        metavar="MESH",
        help="mesh (.obj, .ply, .stl, COMPAS .json) that the "
        "grid lies on, above the drawing in the z direction",
    )
    shell.add_argument(
        "--target",
        type=Path,
        metavar="MESH",
        help="of a C-shell: mesh to keep to, which lies about as the "
        "deployed design does (default: the surface through its deployed curves)",
    )
    shell.add_argument(
        "--held",
        type=held_joints,
        metavar="JOINTS",
        help="of a grid: joints that keep their places on the "
        'surface, "corners", "boundary" or numbers (default: none; domes need some)',
    )
    shell.add_argument(
        "--section",
        type=number_pair,
        metavar="WIDTH,HEIGHT",
        help="of the rods: across the normal of the plane or surface, and along it",
    )
    shell.add_argument(
        "--material",
        type=number_pair,
        metavar="YOUNG,POISSON",
        help="Young's modulus and Poisson's ratio",
    )
    shell.add_argument(
        "--density", type=positive_number, metavar="RHO", help="of the material, for its weight"
    )
    shell.add_argument(
        "--elastic-limit",
        type=positive_number,
        metavar="SIGMA",
        help="of the material, for its strength",
    )
    shell.add_argument(
        "--curves",
        choices=("spline", "polyline"),
        default="spline",
        help="curves go smoothly through "
        "the points of polylines, or keep their corners (default: %(default)s)",
    )
    shell.add_argument(
        "--free-ends", action="store_true", help="keep the rods' ends beyond their last joint"
    )
    shell.add_argument(
        "--layer",
        action="append",
        default=[],
        metavar="NAME",
        help="of DXF files, the layer to read; may be given several times (default: all)",
    )
    shell.add_argument(
        "--scale",
        type=positive_number,
        default=1.0,
        metavar="S",
        help="multiply the coordinates of "
        "drawings and of umbrella meshes' surfaces by this, as 0.001 for millimetres to metres "
        "(default: 1)",
    )
    umbrella = parser.add_argument_group("umbrella meshes")
    umbrella.add_argument(
        "--patch",
        type=patch,
        metavar="SHAPE,N",
        help="of a surface: the cells to lay on it, as "
        "hexagon,3 or triangle,6 or parallelogram,4,5 (cells along the edges)",
    )
    umbrella.add_argument(
        "--plate-edge",
        type=positive_number,
        default=30.0,
        metavar="MM",
        help="of a surface: edge of the plates (default: 30)",
    )
    umbrella.add_argument(
        "--plates",
        choices=("rods", "rigid"),
        default="rods",
        help="model of the plates: rods that "
        "bend, as released, or rigid bodies, with fewer unknowns (default: %(default)s)",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    from ..errors import InputError
    from ..exchange.curve_files import CURVE_READERS
    from ..files.files import check_output_file
    from ..files.json_files import write_json

    check_output_file(args.out, overwrite=args.overwrite)
    drawn = args.file.suffix.lower() in CURVE_READERS
    wanted = args.kind or ("c_shell" if drawn and args.patch is None else "umbrella")
    if wanted != "umbrella" and not drawn:
        raise InputError(
            f"can't be made of this file: expected {' or '.join(CURVE_READERS)}",
            source=args.file,
            field="--as",
            value=wanted,
        )
    data = {"c_shell": _c_shell, "grid": _grid, "umbrella": _umbrella}[wanted](args)
    write_json(args.out, data, overwrite=args.overwrite)
    report(
        args, {"design": args.out, "class": data["class"], "name": data["name"]}, f"{args.out}\n"
    )
    return 0


def _c_shell(args: argparse.Namespace) -> dict[str, Any]:
    from ..exchange.drawn_networks import c_shell_data, read_network

    _require(args, "a C-shell", "opening", "section", "material")
    curves = read_network(
        args.file, args.layer, kind=args.curves, scale=args.scale, free_ends=args.free_ends
    )
    data = c_shell_data(
        args.file.stem,
        curves,
        _section(args),
        _material(args),
        args.opening,
        free_ends=args.free_ends,
    )
    if args.target is not None:
        data["target"] = {"file": _from_the_design(args, args.target)}
    return _checked(args, data)


def _grid(args: argparse.Namespace) -> dict[str, Any]:
    from ..errors import InputError
    from ..exchange.drawn_networks import grid_data, read_network

    _require(args, "a grid", "surface", "section", "material")
    if args.scale != 1.0 or args.free_ends:
        raise InputError(
            "not for grids",
            source=args.file,
            field="--free-ends" if args.free_ends else "--scale",
            value=None if args.free_ends else args.scale,
        )
    curves = read_network(args.file, args.layer, kind=args.curves)
    return _checked(
        args,
        grid_data(
            args.file.stem,
            curves,
            _section(args),
            _material(args),
            _from_the_design(args, args.surface),
            args.held,
        ),
    )


def _from_the_design(args: argparse.Namespace, file: Path) -> str:
    """A file's path, relative to the design's."""
    return Path(os.path.relpath(file, args.out.parent)).as_posix()


def _checked(args: argparse.Namespace, data: dict[str, Any]) -> dict[str, Any]:
    """The content of a design's file. Raises InputError, naming the drawing, where no design can be
    made of it."""
    from ..errors import InputError
    from ..structures.base import design_from_dict

    try:
        design_from_dict(data, str(args.out))
    except InputError as error:
        raise InputError(
            error.message, source=args.file, field=error.field, value=error.value
        ) from None
    return data


def _require(args: argparse.Namespace, what: str, *names: str) -> None:
    from ..errors import InputError

    for name in names:
        if getattr(args, name) is None:
            raise InputError(f"{what} needs --{name}", source=args.file)


def _section(args: argparse.Namespace) -> dict[str, Any]:
    width, height = args.section
    return {"type": "rectangle", "width": width, "height": height}


def _material(args: argparse.Namespace) -> dict[str, float]:
    young, poisson = args.material
    given = {
        "young": young,
        "poisson": poisson,
        "density": args.density,
        "elastic_limit": args.elastic_limit,
    }
    return {name: value for name, value in given.items() if value is not None}


def _umbrella(args: argparse.Namespace) -> dict[str, Any]:
    from ..errors import InputError
    from ..files.json_files import read_json
    from ..structures.umbrella.importer import import_release
    from ..structures.umbrella.release import is_release

    if args.patch is not None:
        return _umbrella_on_mesh(args)
    if args.file.suffix.lower() not in (".json", ".gz"):
        raise InputError("an umbrella mesh on a surface needs --patch", source=args.file)
    data = read_json(args.file)
    if not is_release(data):
        raise InputError(
            "isn't a released umbrella mesh; of a surface, give --patch", source=args.file
        )
    name = args.file.name.removesuffix(".gz").removesuffix(".json")
    return import_release(data, name, str(args.file), args.plates)


def _umbrella_on_mesh(args: argparse.Namespace) -> dict[str, Any]:
    from ..errors import InputError
    from ..structures.umbrella.on_mesh import umbrella_on_mesh

    try:
        return umbrella_on_mesh(
            args.file.stem,
            args.file,
            args.patch,
            scale=args.scale,
            plate_edge=args.plate_edge,
            density=args.density,
            plate_model=args.plates,
        )
    except InputError as error:
        raise error.at(args.file) from None

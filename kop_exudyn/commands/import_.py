"""``kop import``: a drawing of curves, a surface or a released umbrella mesh, as a design file of
our own."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from .import_designs import MATERIALS, undrawn
from .import_nets import drawn_net
from .import_options import check_options
from .output import add_json
from .values import angle, held_joints, number_list, number_pair, patch, positive_number

HELP = "turn a drawing, a surface or a released umbrella mesh into a design file"
DESCRIPTION = """Writes a design file from

  a drawing (.obj: its polylines and splines; .dxf: lines, polylines, arcs, circles, ellipses, splines, blocks; .3dm:
  curves, blocks; .json: curves of COMPAS, or lists of points): a C-shell, its curves hinged wherever they cross; or,
  with --as grid, a grid of lamellas over its curves on a surface, drawn in plan, or on the net's own surface where it
  is drawn in space. Drawings of C-shells lie in a plane. Pieces that go on in each other become one curve; ends that
  meet and are of the two different families are hinged.

  a surface (with --patch; a mesh: .obj, .ply, .stl, .off, or .json of COMPAS): an umbrella mesh in the shape of its
  middle, in millimetres, the arms as long as the cells have to grow.

  a design file (.json), with --unit: the same design in other units.

  an umbrella mesh in the format of its public release (.json or .json.gz): the same mesh, in millimetres, or in --unit.
  Such files can also be used directly wherever a design is expected, in millimetres.

What was understood is printed, and drawn with --preview; without --out that is all that is done."""  # noqa: E501  # a command on one line can be copied
EXAMPLES = """examples:
  kop import net.dxf --preview net.html
  kop import net.dxf --out net.json --opening 0.6 --section 0.03,0.004 --material 2.1e9,0.35 --unit m
  kop import sheet.dxf --largest-part --preview net.html
  kop import quads.obj --edges --as grid --preview net.html
  kop import net.obj --out net.json --opening 35deg --section 30,4 --material 2100,0.35 --scale 1000 --unit mm
  kop import plan.dxf --as grid --surface vault.obj --out vault.json --section 0.004,0.05 --material 1.1e10,0.3
  kop import dome.ply --as umbrella --patch hexagon,3 --out dome.json --scale 1000
  kop import shell_mm.json --unit m --out shell_m.json
  kop import hemisphere_5t.json.gz --out hemisphere.json --plates rigid"""  # noqa: E501  # a command on one line can be copied


class _Classes(Iterable[str]):
    """Names of all structure classes, looked up where they are needed only: that takes a while."""

    def __iter__(self) -> Iterator[str]:
        from ..structures.base import class_names

        return iter(class_names())


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "file",
        type=Path,
        metavar="FILE",
        help="drawing (.obj, .dxf, .3dm, .json), surface (.obj, .ply, .stl, "
        ".off, .json) or released umbrella mesh (.json, .json.gz)",
    )
    parser.add_argument("--out", type=Path, metavar="DESIGN", help="design file to write (.json)")
    parser.add_argument(
        "--preview",
        type=Path,
        metavar="PAGE",
        help="page (.html) that shows what was understood: curves, joints, joins, doubts",
    )
    parser.add_argument(
        "--as",
        dest="kind",
        choices=_Classes(),
        metavar="CLASS",
        help="class of the design: %(choices)s (default: c_shell of drawings, umbrella of others)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist")
    shell = parser.add_argument_group(
        "drawings",
        "designs need section and material, C-shells also the opening, grids over flat nets the "
        "surface",
    )
    shell.add_argument(
        "--opening",
        type=angle,
        metavar="ANGLE",
        help="change of the mean angle between the two families of curves from assembly to "
        "deployment, in radians or as 35deg; positive: the narrow angles open",
    )
    shell.add_argument(
        "--side",
        choices=("up", "down"),
        help="of a C-shell: to which side of the drawing's plane it rises (default: up)",
    )
    shell.add_argument(
        "--surface",
        type=Path,
        metavar="MESH",
        help="mesh (.obj, .ply, .stl, COMPAS .json) that the "
        "grid lies on, above the drawing in the z direction",
    )
    shell.add_argument(
        "--chart",
        choices=("plane", "conformal"),
        default="plane",
        help="of a grid: its curves are drawn in plan, or in space on a surface that may overhang "
        "(default: %(default)s)",
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
        "--density",
        type=positive_number,
        metavar="RHO",
        help="of the material, for its weight; of umbrella meshes too",
    )
    shell.add_argument(
        "--elastic-limit",
        type=number_list,
        metavar="SIGMA",
        help="of the material, for its strength; of umbrella meshes too, as ARMS,PLATES "
        "where these have different ones",
    )
    shell.add_argument(
        "--curves",
        choices=("spline", "polyline"),
        default="spline",
        help="curves go smoothly through "
        "the points of polylines, or keep their corners (default: %(default)s)",
    )
    shell.add_argument(
        "--free-ends",
        action="store_true",
        help="of a C-shell: keep the rods' ends beyond their last joint",
    )
    shell.add_argument(
        "--layer",
        action="append",
        default=[],
        metavar="NAME",
        help="of DXF and 3dm files, the layer to read, hidden or not; of JSON files a key; may be "
        "given several times (default: all that can be seen)",
    )
    shell.add_argument(
        "--join",
        choices=("auto", "always", "never"),
        default="auto",
        help="whether curves that meet end to end are one: where that keeps the families apart, "
        "where they turn by less than 45 degrees, or never (default: %(default)s)",
    )
    shell.add_argument(
        "--largest-part",
        action="store_true",
        help="leave out what isn't connected with most of the curves: frames, legends, other nets",
    )
    shell.add_argument(
        "--edges",
        action="store_true",
        help="of a mesh or a graph (.obj, .ply, .json of COMPAS, networkx or lists): its edges are "
        "the curves",
    )
    shell.add_argument(
        "--tolerance",
        type=positive_number,
        metavar="SHARE",
        help="of the drawing's size: points, ends and curves nearer to each other are the same "
        "(default: 2e-4)",
    )
    shell.add_argument(
        "--unit",
        choices=("mm", "cm", "m", "in", "ft"),
        help="the design's unit of length (default: the drawing's, as far as it is known)",
    )
    shell.add_argument(
        "--force-unit",
        choices=("N", "kN", "MN", "lbf", "kip"),
        default="N",
        help="the design's unit of force (default: %(default)s)",
    )
    shell.add_argument(
        "--scale",
        type=positive_number,
        metavar="S",
        help="multiply the coordinates of drawings, of their surfaces and targets, and of umbrella "
        "meshes' surfaces by this, as 0.001 for millimetres to metres (default: from the drawing's "
        "unit to --unit where both are known, otherwise 1)",
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
    from ..exchange.curve_files import CURVE_READERS, is_drawing, is_surface
    from ..exchange.other_formats import instead_of
    from ..files.files import check_ending, check_output_file
    from ..files.json_files import JSON_ENDINGS
    from ..geometry.mesh_files import MESH_SUFFIXES
    from ..structures.nets import net_class, net_classes

    if os.path.isdir(args.file):
        raise InputError("is a folder, expected a file", source=args.file)
    known = sorted({*CURVE_READERS, *MESH_SUFFIXES, ".json.gz"})
    if not args.file.name.lower().endswith(tuple(known)):
        how = instead_of(args.file.name)
        raise InputError(f"can't be imported{how} (known: {', '.join(known)})", source=args.file)
    for path, field, endings in (
        (args.out, "--out", JSON_ENDINGS),
        (args.preview, "--preview", (".html", ".htm")),
    ):
        if path is None:
            continue
        check_output_file(path, overwrite=args.overwrite)
        check_ending(path, endings, field)
    drawing = is_drawing(args.file)
    surface = args.kind is None and drawing and is_surface(args.file)
    drawn = args.edges or (drawing and not surface)
    wanted = args.kind or ("c_shell" if drawn and args.patch is None else None)
    if wanted in (None, "umbrella"):
        if len(args.elastic_limit or ()) > len(MATERIALS):
            raise InputError(
                "expected one limit, or those of arms and plates", field="--elastic-limit"
            )
        return undrawn(args)
    if args.elastic_limit is not None and len(args.elastic_limit) > 1:
        raise InputError("a drawing's rods have one elastic limit", field="--elastic-limit")
    if not drawn:
        raise InputError(
            f"can't be made of this file: expected {' or '.join(CURVE_READERS)}",
            source=args.file,
            field="--as",
            value=wanted,
        )
    net = net_class(wanted)
    if net is None:
        raise InputError(
            f"designs of this class aren't made of drawings (known: {', '.join(net_classes())})",
            source=args.file,
            field="--as",
            value=wanted,
        )
    check_options(args, wanted)
    return drawn_net(args, wanted, net)

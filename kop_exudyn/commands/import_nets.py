"""``kop import`` of drawn nets: curves that are hinged or crossed where they meet."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .import_output import by_option, tell

if TYPE_CHECKING:
    from ..exchange.drawing import Finding
    from ..exchange.drawn_networks import DrawnNetwork, ReadingOptions
    from ..exchange.imports import Imported
    from ..structures.nets import NetClass
    from ..units import Units

# What an option that a design needs is, with an example.
_NEEDED = {
    "opening": ": the angle that it opens by, as 35deg",
    "section": " WIDTH,HEIGHT of its rods, in the design's unit",
    "material": " YOUNG,POISSON of its rods, in the design's units",
}


def drawn_net(args: argparse.Namespace, wanted: str, net: NetClass) -> int:
    """A design of a drawn net, or what was understood of it; its preview also where no design comes
    of it. Returns the exit status.

    args : of the command; wanted, net : the class of the design

    Raises InputError for what can't be read, and where an option that the class needs is missing.
    """
    from ..errors import InputError
    from ..exchange.free_ends import free_end_doubts
    from ..exchange.imports import read_scaled
    from ..exchange.space_nets import with_heights_checked
    from ..units import Units

    if args.out is not None:
        _require(args, net, *net.needed, "section", "material")
    units = None if args.unit is None else Units(args.unit, args.force_unit)
    drawn, units = read_scaled(args.file, _reading(args, net), args.scale, units, space=True)
    if units is not None:
        units = Units(units.length, args.force_unit)
    try:
        made = None if args.out is None else _made(args, wanted, drawn, units)
        drawn.network  # which says what is wrong with it
        if made is None and not drawn.frame.flat and args.surface is None:
            drawn = with_heights_checked(drawn)
    except InputError as error:
        error = by_option(error.at(args.file))
        if args.preview is not None:
            _save_preview(args, drawn, drawn.findings, units, refused=str(error))
        raise error from None
    findings = drawn.findings if made is None else made.findings
    if made is not None:
        drawn = made.drawn
        _write(args, made)
    findings = [*findings, *free_end_doubts(drawn, units)]
    if args.preview is not None:
        _save_preview(args, drawn, findings, units)
    _tell(args, wanted, net, drawn, findings, units)
    return 0


def _made(
    args: argparse.Namespace, wanted: str, drawn: DrawnNetwork, units: Units | None
) -> Imported:
    from ..exchange.design_data import Rods
    from ..exchange.imports import import_net

    rods = Rods(_section(args), _material(args), units)
    name = args.file.stem
    own = args.out.with_name(f"{args.out.stem}_surface.obj")
    return import_net(drawn, wanted, name, rods, args.out, {**vars(args), "mesh_file": own})


def _reading(args: argparse.Namespace, net: NetClass) -> ReadingOptions:
    from ..exchange.cleaning import TOLERANCE
    from ..exchange.drawn_networks import ReadingOptions

    return ReadingOptions(
        layers=args.layer,
        kind=args.curves,
        free_ends=args.free_ends,
        join=args.join,
        tolerance=TOLERANCE if args.tolerance is None else args.tolerance,
        largest_part=args.largest_part,
        edges=args.edges,
        ends_kept_by="--free-ends" if "free_ends" in net.options else "",
    )


def _write(args: argparse.Namespace, made: Imported) -> None:
    from ..exchange.polygons import write_mesh_obj
    from ..files.files import check_output_file
    from ..files.json_files import write_json

    for path in made.meshes:
        check_output_file(path, overwrite=args.overwrite)
    unit = made.data.get("units", {}).get("length")
    for path, (vertices, faces) in made.meshes.items():
        write_mesh_obj(path, vertices, faces, unit=unit, overwrite=args.overwrite)
    write_json(args.out, made.data, overwrite=args.overwrite)


def _save_preview(
    args: argparse.Namespace,
    drawn: DrawnNetwork,
    findings: Sequence[Finding],
    units: Units | None,
    refused: str | None = None,
) -> None:
    from ..exchange.import_summary import import_figures, import_rows
    from ..report.import_preview import net_preview

    figures = import_figures(drawn, units)
    kept = drawn.options.ends_kept_by
    rows = import_rows(figures, list(findings), units, args.opening, ends_kept_by=kept)
    page = net_preview(args.file.name, drawn, rows, findings, units, refused)
    page.save(args.preview, overwrite=args.overwrite)


def _tell(
    args: argparse.Namespace,
    wanted: str,
    net: NetClass,
    drawn: DrawnNetwork,
    findings: Sequence[Finding],
    units: Units | None,
) -> None:
    """The summary of an import."""
    from ..exchange.import_summary import import_figures, import_rows

    figures = import_figures(drawn, units)
    told = [{"kind": f.kind, "text": f.text, "places": f.places.tolist()} for f in findings]
    data = {
        "design": args.out,
        "preview": args.preview,
        "class": wanted,
        "name": args.file.stem,
        "summary": figures,
        "findings": told,
    }
    opening = args.opening if "opening" in net.options else None
    kept = drawn.options.ends_kept_by
    tell(args, data, import_rows(figures, list(findings), units, opening, ends_kept_by=kept))


def _require(args: argparse.Namespace, net: NetClass, *names: str) -> None:
    from ..errors import InputError

    for name in names:
        if getattr(args, name) is None:
            raise InputError(
                f"{net.one} needs --{name.replace('_', '-')}{_NEEDED.get(name, '')}",
                source=args.file,
            )


def _section(args: argparse.Namespace) -> dict[str, Any]:
    width, height = args.section
    return {"type": "rectangle", "width": width, "height": height}


def _material(args: argparse.Namespace) -> dict[str, float]:
    young, poisson = args.material
    given = {
        "young": young,
        "poisson": poisson,
        "density": args.density,
        "elastic_limit": args.elastic_limit[0] if args.elastic_limit else None,
    }
    return {name: value for name, value in given.items() if value is not None}

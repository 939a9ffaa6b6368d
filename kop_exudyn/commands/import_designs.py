"""Imports of what isn't drawn: umbrella meshes on surfaces, designs of other programs, and our own
ones in other units."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from .import_options import check_options
from .import_output import by_option, tell

if TYPE_CHECKING:
    from ..structures.base import Design

MATERIALS = ("arms", "plates")  # of an umbrella mesh


def undrawn(args: argparse.Namespace) -> int:
    """An umbrella mesh on a surface, or a design of another program's file."""
    from ..errors import InputError
    from ..files.json_files import write_json
    from ..structures.base import design_from_dict

    data = _content(args)
    _add_materials(args, data)
    try:
        design = design_from_dict(data, str(args.out or args.file))
    except InputError as error:
        raise by_option(
            InputError(error.message, source=args.file, field=error.field, value=error.value)
        ) from None
    if args.preview is not None and design.class_name != "umbrella":
        raise InputError("shows drawings and umbrella meshes only", field="--preview")
    if args.out is not None:
        write_json(args.out, data, overwrite=args.overwrite)
    figures, rows = _figures(args, design, data)
    if args.preview is not None:
        from ..report.import_preview import umbrella_preview

        page = umbrella_preview(args.file.name, data, rows)
        page.save(args.preview, overwrite=args.overwrite)
    told = {"design": args.out, "preview": args.preview, "class": data["class"]}
    tell(args, told | {"name": data["name"], "summary": figures}, rows)
    return 0


def _add_materials(args: argparse.Namespace, data: dict[str, Any]) -> None:
    """Density and elastic limits as options give them, in an umbrella mesh's content."""
    limits = args.elastic_limit or ()
    materials = data.get("materials", {})
    for number, name in enumerate(name for name in MATERIALS if name in materials):
        if args.density is not None:
            materials[name]["density"] = args.density
        if limits:
            materials[name]["elastic_limit"] = limits[min(number, len(limits) - 1)]


def _fit_it(args: argparse.Namespace) -> str:
    """What to do with a mesh whose arms follow from areas alone."""
    if args.out is None:
        return "arms follow from areas: once it is written (--out), kop fit brings it nearer"
    new = args.out.with_name(f"{args.out.stem}_fitted.json")
    return f"arms follow from areas: kop fit {args.out} --out {new} brings it nearer to its surface"


def _figures(
    args: argparse.Namespace, design: Design, data: dict[str, Any]
) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """What is told of a design that wasn't drawn: as plain data, and in words."""
    units = data.get("units")
    figures: dict[str, Any] = {"joints": len(design.joints), "units": units}
    if design.class_name != "umbrella":
        figures["elements"] = design.n_elements
        rows = [("elements", str(design.n_elements)), ("joints", str(len(design.joints)))]
    else:
        lengths = design.parameters
        figures["cells"] = len(data["lengths"])
        figures |= {"shortest_arm": float(lengths.min()), "longest_arm": float(lengths.max())}
        arms = f"{lengths.min():.4g} to {lengths.max():.4g} {data['units']['length']}"
        rows = [
            ("cells", str(figures["cells"])),
            ("joints", f"{figures['joints']} X joints"),
            ("arms", arms),
        ]
    if units is not None:
        rows.append(("units", f"{units['length']}, {units['force']}"))
    if "target" not in data and design.class_name == "umbrella":
        rows.append(("look at", "no target surface: the deployed design itself is taken as one"))
    elif design.class_name == "umbrella" and args.patch is not None:
        rows.append(("next", _fit_it(args)))
    return figures, rows


def _content(args: argparse.Namespace) -> dict[str, Any]:
    """The content of the design file, of a surface or of a file of another program."""
    from ..errors import InputError
    from ..exchange.mesh_edges import holds_edges
    from ..files.documents import is_own
    from ..files.json_files import is_json_file, json_stem, read_json
    from ..io.conversion import in_units
    from ..structures.base import foreign_format, format_names
    from ..units import Units

    read = args.patch is None and is_json_file(args.file)
    data: Any = read_json(args.file) if read else None
    if data is not None and is_own(data):  # of any class, in any unit
        return _converted(args, data)
    if args.patch is not None:
        check_options(args, "patch")
        if args.unit not in (None, "mm"):
            raise InputError(
                "umbrella meshes are laid out in mm: --scale 1000 makes mm of metres; the design "
                f"can be written in {args.unit} afterwards (kop import DESIGN --unit {args.unit})",
                field="--unit",
                value=args.unit,
            )
        return _umbrella_on_mesh(args)
    if not read:
        raise InputError("an umbrella mesh on a surface needs --patch", source=args.file)
    foreign = foreign_format(data)
    if foreign is None or foreign.rewrite is None:
        edges = "; of a mesh or graph, --edges reads the edges as laths"
        raise InputError(
            f"isn't a {' or a '.join(format_names())}, nor has curves (lists of points stand "
            "outermost, objects of COMPAS anywhere); of a surface, give --patch"
            f"{edges if holds_edges(data) else ''}",
            source=args.file,
        )
    check_options(args, "release")
    own = foreign.rewrite(data, json_stem(args.file), str(args.file))
    if own["class"] == "umbrella" and args.plates == "rigid":
        own["plate_model"] = args.plates
    if args.unit is None and args.force_unit == args.command.get_default("force_unit"):
        return own
    length = own.get("units", {}).get("length") if args.unit is None else args.unit
    return in_units(own, Units(length, args.force_unit))


def _converted(args: argparse.Namespace, data: dict[str, Any]) -> dict[str, Any]:
    """The content of a design file of our own, in the units asked for."""
    from ..errors import InputError
    from ..io.conversion import in_units
    from ..io.designs import load_design
    from ..io.rescaling import relocated
    from ..units import Units

    if args.unit is None or data["format"] != "kop_exudyn/design":
        raise InputError(
            "is a file of kop_exudyn already: use it as it is (designs: or give --unit, to write "
            "it in another unit)",
            source=args.file,
            field="format",
        )
    if args.scale is not None:
        raise InputError("isn't for designs: --unit says how they are scaled", field="--scale")
    check_options(args, "design")
    load_design(args.file)  # refuses what is no design
    if args.kind not in (None, data["class"]):
        raise InputError(f"is a design of class {data['class']}", source=args.file, field="--as")
    try:
        converted = in_units(data, Units(args.unit, args.force_unit))
    except InputError as error:
        raise error.at(args.file) from None
    return relocated(converted, args.file.parent, (args.out or args.file).parent)


def _umbrella_on_mesh(args: argparse.Namespace) -> dict[str, Any]:
    from ..errors import InputError
    from ..structures.umbrella.on_mesh import umbrella_on_mesh

    try:
        return umbrella_on_mesh(
            args.file.stem,
            args.file,
            args.patch,
            scale=1.0 if args.scale is None else args.scale,
            plate_edge=args.plate_edge,
            density=args.density,
            plate_model=args.plates,
        )
    except InputError as error:
        raise by_option(error.at(args.file)) from None

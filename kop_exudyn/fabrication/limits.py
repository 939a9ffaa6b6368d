"""What the workshop asks of parts before any are sought: sides long enough for their holes, corners
not sharper than strips can be joined at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..kit.kinds import Bounds, has_joint, part_kind
from ..rods.sections import hole_of
from ..search.result import KitResult
from ..structures.base import Design
from ..structures.strength import by_section
from ..units import common_units
from .blanks import Blanks, least_side
from .options import CutOptions, millimetres, tenths
from .pieces import parts_list_of

_SHARPER = 1.5  # times the sharpest corner of the inputs: a kit's corners may have to make up
_SHARPEST = 2.5  # rad
_MANY = 0.1  # of the elements: what is said of so many before a search


def usual_options(designs: Sequence[Design]) -> CutOptions:
    """The usual sizes of holes, with the joints' of the designs' own sections where they name
    one."""
    units = common_units({design.name: design.units for design in designs})
    holes = {
        hole
        for design in designs
        for section, _ in by_section(design.scene(design.fitted_role.name))
        if (hole := hole_of(section)) is not None
    }
    if units is None or not holes:
        return CutOptions()
    return CutOptions(joint_hole=round(millimetres(units.length) * max(holes), 6))


def part_bounds(designs: Sequence[Design], options: CutOptions | None = None) -> Bounds:
    """Bounds on the parts of a kit for these designs, in their unit: within them strips have room
    for their holes and plates.

    options : the workshop's; default: the usual ones
    Nothing is bounded where designs name no units, have no rectangular rods or different ones, or
    have mostly sides too short for any such part.
    """
    units = common_units({design.name: design.units for design in designs})
    boards = {
        tuple(np.round(np.ptp(section.outline, axis=0), 12))
        for design in designs
        for section, _ in by_section(design.scene(design.fitted_role.name))
    }
    if units is None or len(boards) != 1:
        return {}
    options = usual_options(designs) if options is None else options
    scale = millimetres(units.length)
    y, z = next(iter(boards))
    values: dict[str, list[np.ndarray]] = {}
    for design in designs:
        for group in design.groups:
            values.setdefault(group.kind, []).append(design.parameters[group.indices].ravel())
    every = {kind: np.abs(np.concatenate(found)) for kind, found in values.items()}
    angles = [v for kind, v in every.items() if part_kind(kind).angular and len(v)]
    if not angles:
        return {}
    sharpest = min(_SHARPER * float(np.concatenate(angles).max()), _SHARPEST)
    breadth, thickness = scale * max(y, z), scale * min(y, z)
    joint = thickness + options.clearance if z > y else options.joint_hole
    shortest = least_side(breadth, sharpest, joint, options) / scale
    found: dict[str, tuple] = {}
    for name, lengths in every.items():
        kind = part_kind(name)
        if kind.angular:
            found[name] = (-np.inf, max(sharpest, float(lengths.max())))
        elif has_joint(kind) and shortest < np.median(lengths):
            lower = np.full(kind.n_parameters, -np.inf)
            lower[:2] = shortest
            found[name] = (lower, np.inf)
    return found


def short_sides(designs: Sequence[Design], bounds: Bounds) -> list[str]:
    """What to know of designs many of whose elements are shorter than any part can be, in words.

    bounds : of their parts, see `part_bounds`
    """
    units = common_units({design.name: design.units for design in designs})
    found = []
    for name, (lower, _) in bounds.items():
        if part_kind(name).angular or not np.isfinite(np.atleast_1d(lower)[:2]).all():
            continue
        least = float(np.max(lower))
        sides = [
            design.parameters[group.indices].min(axis=1)
            for design in designs
            for group in design.groups
            if group.kind == name and group.indices.shape[1] > 1
        ]
        short = float(np.mean(np.concatenate(sides) < least)) if sides else 0.0
        if units is not None and short > _MANY:
            length = tenths(least * millimetres(units.length))
            found.append(
                f"{100 * short:.0f} % of the {name} elements have a side shorter than {length} mm, "
                "which a part needs for its holes: parts are longer, whatever their number, at the "
                "cost of shape and stress. Narrower rods, smaller holes, or designs with longer "
                "sides would help"
            )
    return found


def cutting_problems(
    result: KitResult, options: CutOptions | None = None
) -> list[tuple[str, ...] | None]:
    """By design, what stands in the way of cutting the parts that it is built from, in sentences;
    None where designs name no units, so that nothing is known.

    options : the workshop's; default: the usual ones
    """
    if result.units is None:
        return [None] * len(result.designs)
    options = usual_options(result.designs) if options is None else options
    parts = parts_list_of(result)
    try:
        blanks = Blanks(parts, result.units.length, options)
        problems = blanks.problems_by_part
    except InputError as error:
        return [(str(error),)] * len(result.designs)
    found: list[tuple[str, ...] | None] = []
    for design in parts.designs:
        own = {parts.label(piece) for piece in design.pieces}
        found.append(tuple(text for label, text in problems if label is None or label in own))
    return found

"""Design files in other units: the same structure, every number of it converted."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ..errors import InputError
from ..structures.base import rescaled
from ..units import Units, units_from_dict

# field -> powers of length and of force that its numbers have
_SECTION = {
    "width": (1, 0),
    "height": (1, 0),
    "joint_hole": (1, 0),
    "radius": (1, 0),
    "outline": (1, 0),
    "area": (2, 0),
    "shear_y": (2, 0),
    "shear_z": (2, 0),
    "torsion_modulus": (3, 0),
    "inertia_y": (4, 0),
    "inertia_z": (4, 0),
    "torsion": (4, 0),
}
# a density is mass / length^3 = force s^2 / length^4
_MATERIAL = {"young": (-2, 1), "elastic_limit": (-2, 1), "density": (-4, 1)}
# of umbrella meshes, whose lengths are all their own: they share no surface or curves at a scale
_UMBRELLA: dict[str, Mapping[str, Any]] = {
    "base": {"vertices": (1, 0)},
    "plates": dict.fromkeys(("arm_position", "thickness", "width", "spacing"), (1, 0)),
    "materials": {"arms": _MATERIAL, "plates": _MATERIAL},
    "target": {"vertices": (1, 0), "crossings": (1, 0), "plates": (1, 0)},
    "pins": {"positions": (1, 0)},
}
_LOADS = {"gravity": (1, 0), "line": (-1, 1), "area": (-2, 1), "plan": (-2, 1)}


def in_units(data: Mapping[str, Any], units: Units) -> dict[str, Any]:
    """A design file's content in other units.

    data : of a file that has been read as a design
    units : that its numbers will have

    Raises InputError where the design names no units, or is of a class whose numbers aren't known
    here and that can't be at another size.
    """
    old = units_from_dict(data.get("units"))
    if old is None:
        raise InputError(
            'names no units, so they can\'t be converted: add "units": {"length": "m", "force": '
            '"N"}, say',
            field="units",
        )
    length, force = old.metres / units.metres, old.newtons / units.newtons

    def times(powers: tuple[int, int]) -> Callable[[Any], Any]:
        factor = length ** powers[0] * force ** powers[1]

        def converted(value: Any) -> Any:
            if value is None:  # a place that isn't known
                return None
            return [converted(x) for x in value] if isinstance(value, list) else factor * value

        return converted

    def fields(content: Mapping[str, Any], powers: Mapping[str, Any]) -> dict[str, Any]:
        """Numbers by their powers; a mapping of powers is of the fields within."""
        found = dict(content)
        for name in powers.keys() & content.keys():
            inner = isinstance(powers[name], Mapping)
            own = content[name]
            found[name] = fields(own, powers[name]) if inner else times(powers[name])(own)
        return found

    def loads(content: Mapping[str, Any]) -> dict[str, Any]:
        found = fields(content, _LOADS)
        if "points" in found:
            found["points"] = [fields(point, {"force": (0, 1)}) for point in found["points"]]
        if "deflection" in found:
            found["deflection"] = fields(found["deflection"], {"absolute": (1, 0)})
        return found

    if any(data.get("origin", ())) and data["class"] == "grid" and length != 1:
        raise InputError(
            "a grid that was drawn far away can't be converted: import its drawing with --unit",
            field="origin",
            value=data["origin"],
        )
    if data["class"] == "umbrella":
        found = fields(data, {**_UMBRELLA, "lengths": (1, 0), "least_length": (1, 0)})
    else:
        found = rescaled(data, length) if length != 1 else dict(data)
    found |= {"units": units.to_dict()}
    for name, powers in (("section", _SECTION), ("material", _MATERIAL)):
        if name in found:
            found[name] = fields(found[name], powers)
    found = fields(found, {"rod_offset": (1, 0), "origin": (1, 0)})
    if "loads" in found:
        found["loads"] = loads(found["loads"])
    for name in ("load_cases", "combinations"):
        if name in found:
            found[name] = [loads(case) for case in found[name]]
    return found

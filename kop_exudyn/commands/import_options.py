"""Which options go with which import: others would be passed over without a word."""

from __future__ import annotations

import argparse

# What is imported, as messages call it.
_IMPORTS = {
    "drawing": "drawings",
    "patch": "surfaces with --patch",
    "release": "released umbrella meshes",
    "design": "design files, which are written in other units",
}
_DRAWINGS = ("drawing",)
_UMBRELLAS = ("patch", "release")
# The imports that each option is for; those that aren't here are for all, or for drawings of the
# classes that say so.
_FOR = {
    "patch": ("patch",),
    "plate_edge": ("patch",),
    "plates": _UMBRELLAS,
    "density": _DRAWINGS + _UMBRELLAS,
    "elastic_limit": _DRAWINGS + _UMBRELLAS,
    "unit": (*_DRAWINGS, *_UMBRELLAS, "design"),
    "force_unit": (*_DRAWINGS, "release", "design"),
    "scale": (*_DRAWINGS, "patch"),
} | dict.fromkeys(
    (
        "section",
        "material",
        "curves",
        "layer",
        "join",
        "largest_part",
        "edges",
        "tolerance",
    ),
    _DRAWINGS,
)


def check_options(args: argparse.Namespace, what: str) -> None:
    """Refuse options that are for other imports.

    what : of `_IMPORTS`, or the class that a drawing becomes
    Raises InputError naming the first of them, and what it is for.
    """
    from ..errors import InputError
    from ..structures.nets import net_classes

    nets = net_classes()
    names = _IMPORTS | {name: f"drawings of {net.many}" for name, net in nets.items()}
    of_classes: dict[str, tuple[str, ...]] = {}
    for name, net in nets.items():
        for option in net.options:
            of_classes[option] = (*of_classes.get(option, ()), name)
    own = {what, "drawing"} if what in nets else {what}
    for option, imports in {**of_classes, **_FOR}.items():
        if own.isdisjoint(imports) and getattr(args, option) != args.command.get_default(option):
            *most, last = (names[i] for i in imports)
            which = f"{', '.join(most)} and {last}" if most else last
            raise InputError(
                f"isn't for this import: it is for {which}",
                field=f"--{option.replace('_', '-')}",
            )

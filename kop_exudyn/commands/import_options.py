"""Which options go with which import: others would be passed over without a word."""

from __future__ import annotations

import argparse

# What is imported, as messages call it.
_IMPORTS = {
    "c_shell": "drawings of C-shells",
    "grid": "drawings of grids",
    "patch": "surfaces with --patch",
    "release": "released umbrella meshes",
    "design": "design files, which are written in other units",
}
_DRAWINGS = ("c_shell", "grid")
_UMBRELLAS = ("patch", "release")
# The imports that each option is for; those that aren't here are for all.
_FOR = {
    "opening": ("c_shell",),
    "target": ("c_shell",),
    "surface": ("grid",),
    "chart": ("grid",),
    "held": ("grid",),
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
        "free_ends",
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

    what : of `_IMPORTS`, what is imported
    Raises InputError naming the first of them, and what it is for.
    """
    from ..errors import InputError

    for option, imports in _FOR.items():
        if what not in imports and getattr(args, option) != args.command.get_default(option):
            *most, last = (_IMPORTS[i] for i in imports)
            which = f"{', '.join(most)} and {last}" if most else last
            raise InputError(
                f"isn't for this import: it is for {which}",
                field=f"--{option.replace('_', '-')}",
            )

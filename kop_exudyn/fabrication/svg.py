"""Cut sheets as SVG, one unit a millimetre; a layer is a group."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import escape

from ..files.files import write_text
from .cutsheets import Sheet
from .shapes import CUT, ENGRAVE, NOTES, Hole, Polyline, Shape

_COLOURS = {CUT: "#ff0000", ENGRAVE: "#0000ff", NOTES: "#808080"}  # as laser cutters expect them


def svg_text(sheet: Sheet) -> str:
    """The sheet as SVG, its size in mm."""
    width, height = sheet.size
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm" '
        f'viewBox="0 0 {width:g} {height:g}">',
    ]
    for layer, colour in _COLOURS.items():
        lines.append(f'<g id="{layer}" fill="none" stroke="{colour}" stroke-width="0.2">')
        lines += [
            shape_element(shape, height, colour) for shape in sheet.shapes if shape.layer == layer
        ]
        lines.append("</g>")
    return "\n".join([*lines, "</svg>", ""])


def write_svg(path: str | Path, sheet: Sheet, *, overwrite: bool = False) -> Path:
    """Write a sheet. Raises InputError when the file exists or can't be written."""
    return write_text(path, svg_text(sheet), overwrite=overwrite)


def shape_element(shape: Shape, height: float, colour: str) -> str:
    """A shape as an SVG element; SVG counts y downwards.

    height : of the drawing; colour : of texts
    """
    if isinstance(shape, Polyline):
        points = " ".join(f"{x:.4f},{height - y:.4f}" for x, y in shape.points)
        return f'<{"polygon" if shape.closed else "polyline"} points="{points}"/>'
    if isinstance(shape, Hole):
        x, y = shape.centre
        return f'<circle cx="{x:.4f}" cy="{height - y:.4f}" r="{shape.diameter / 2:.4f}"/>'
    anchor = "middle" if shape.align == "middle" else "start"
    # the letters of common fonts are 0.72 of the font size high, and stand on their base line
    return (
        f'<text x="{shape.at[0]:.4f}" y="{height - shape.at[1] + shape.height / 2:.4f}" '
        f'font-size="{shape.height / 0.72:.4f}" font-family="sans-serif" text-anchor="{anchor}" '
        f'fill="{colour}" '
        f'stroke="none">{escape(shape.text)}</text>'
    )

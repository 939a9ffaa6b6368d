"""Cut sheets as DXF (AutoCAD 2010), in millimetres."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..files.files import write_text
from .cutsheets import Sheet
from .shapes import CUT, ENGRAVE, NOTES, Hole, Polyline

_COLOURS = {CUT: 1, ENGRAVE: 5, NOTES: 8}  # AutoCAD's colour numbers: red, blue, grey


def dxf_text(sheet: Sheet) -> str:
    """The sheet as DXF."""
    ezdxf = load_ezdxf()
    with _without_dates(ezdxf.options):
        document = ezdxf.new("R2010", units=ezdxf.units.MM)
        _fill(ezdxf, document, sheet)
        buffer = io.StringIO()
        document.write(buffer)
    return buffer.getvalue()


def write_dxf(path: str | Path, sheet: Sheet, *, overwrite: bool = False) -> Path:
    """Write a sheet. Raises InputError when the file exists or can't be written."""
    return write_text(path, dxf_text(sheet), overwrite=overwrite)


def _fill(ezdxf: Any, document: Any, sheet: Sheet) -> None:
    for layer, colour in _COLOURS.items():
        document.layers.add(layer, color=colour)
    space = document.modelspace()
    for shape in sheet.shapes:
        attributes = {"layer": shape.layer}
        if isinstance(shape, Polyline):
            space.add_lwpolyline(shape.points.tolist(), close=shape.closed, dxfattribs=attributes)
        elif isinstance(shape, Hole):
            space.add_circle(shape.centre.tolist(), shape.diameter / 2, dxfattribs=attributes)
        else:
            align = "MIDDLE_CENTER" if shape.align == "middle" else "MIDDLE_LEFT"
            text = space.add_text(shape.text, height=shape.height, dxfattribs=attributes)
            text.set_placement(shape.at.tolist(), align=ezdxf.enums.TextEntityAlignment[align])


@contextmanager
def _without_dates(options: Any) -> Iterator[None]:
    """The same sheet gives the same bytes: no dates, no random ids. The user's own setting comes
    back."""
    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before


def load_ezdxf() -> Any:
    """The library, with all of it that is used here; it takes a while to load. What it finds wrong
    with files is told once, by whoever reads them, not on standard error besides."""
    import ezdxf
    import ezdxf.enums
    import ezdxf.units

    if not (log := logging.getLogger("ezdxf")).handlers:
        log.addHandler(logging.NullHandler())
    return ezdxf

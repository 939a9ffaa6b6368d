"""Cut sheets as DXF (AutoCAD 2010), in millimetres. Needs ezdxf, which comes with the extra "fab"."""
from __future__ import annotations

import io
from pathlib import Path

from ..errors import InputError
from .cutsheets import Sheet
from .files import write_text
from .shapes import CUT, ENGRAVE, NOTES, Hole, Polyline

_COLOURS = {CUT: 1, ENGRAVE: 5, NOTES: 8}  # AutoCAD's colour numbers: red, blue, grey


def dxf_text(sheet: Sheet) -> str:
    """The sheet as DXF. Raises InputError without ezdxf."""
    ezdxf = _ezdxf()
    document = ezdxf.new("R2010", units=ezdxf.units.MM)
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
    buffer = io.StringIO()
    document.write(buffer)
    return buffer.getvalue()


def write_dxf(path: str | Path, sheet: Sheet, *, overwrite: bool = False) -> Path:
    """Write a sheet. Raises InputError when the file exists or can't be written, and without ezdxf."""
    return write_text(path, dxf_text(sheet), overwrite=overwrite)


def _ezdxf():
    try:
        import ezdxf
        import ezdxf.enums
        import ezdxf.units
    except ImportError:
        raise InputError("DXF files need ezdxf: pip install 'kop_exudyn[fab]'", field="format", value="dxf") from None
    # the same sheet gives the same bytes: no dates, no random ids
    ezdxf.options.write_fixed_meta_data_for_testing = True
    return ezdxf

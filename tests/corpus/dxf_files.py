"""DXF files of all versions and units, and what only has that name."""

from __future__ import annotations

import io

import ezdxf
from drawings import (
    Net,
    Refused,
    case,
    dxf,
    in_metres,
    lines,
    size_doubts,
)
from ezdxf import units

for _version in ("R12", "R2000", "R2004", "R2007", "R2010", "R2013", "R2018"):
    case(f"lines_{_version.lower()}.dxf", Net())(
        lambda version=_version: dxf(lambda document, space: lines(space), version)
    )


for _name, _code, _metres in (
    ("mm", units.MM, 1e-3),
    ("cm", units.CM, 1e-2),
    ("m", units.M, 1.0),
    ("in", units.IN, 0.0254),
    ("ft", units.FT, 0.3048),
):
    case(f"unit_{_name}.dxf", Net(unit=_name, findings=size_doubts(_metres)))(
        lambda code=_code: dxf(lambda document, space: lines(space), unit=code)
    )
    case(f"unit_{_name}_to_m.dxf", in_metres(_metres))(
        lambda code=_code: dxf(lambda document, space: lines(space), unit=code)
    )


@case("unit_dm_to_mm.dxf", Net(unit="mm", length=1200.0, options={"unit": "mm"}))
def _decimetres() -> bytes:
    return dxf(lambda document, space: lines(space), unit=units.DM)


@case(
    "unit_mm_by_scale.dxf",
    Net(unit="m", length=0.012, options={"scale": 0.001}, findings=size_doubts(1e-3)),
)
def _by_scale() -> bytes:
    return dxf(lambda document, space: lines(space), unit=units.MM)


@case("binary.dxf", Net())
def _binary() -> bytes:
    ezdxf.options.write_fixed_meta_data_for_testing = True
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 0
    lines(document.modelspace())
    stream = io.BytesIO()
    document.write(stream, fmt="bin")
    return stream.getvalue()


@case("not_dxf.dxf", Refused("can't be read as DXF"))
def _not_dxf() -> str:
    return "PK\x03\x04 something else under this name\n"

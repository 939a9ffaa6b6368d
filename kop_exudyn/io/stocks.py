"""Stock files: which parts exist in how many pieces, as CSV or as JSON in the format
"kop_exudyn/stock"."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, did_you_mean
from ..files.documents import LARGEST_WHOLE, check_envelope, check_range, check_schema
from ..files.files import as_path, read_bytes
from ..files.json_files import read_json
from ..kit.kinds import kind_names, part_kind
from ..kit.parts import Kit
from ..kit.stock import Stock
from ..units import Units, units_from_dict
from .kits import check_lengths

STOCK_VERSION = 1
_OWN_COLUMNS = ("kind", "count")
# Columns that there may be besides, and what they are the units of.
_UNITS = {"unit": "length", "force_unit": "force"}


def load_stock(path: str | Path, *, together: bool = False) -> Stock:
    """The stock of a file.

    A CSV file has the columns kind and count, and one for each parameter of its kinds (l1, l2 and
    angle, for instance); cells of other kinds' parameters are empty. Rows of like parts add up.

    together : whether the designs stand at the same time, see `Stock`

    Raises InputError naming the file, the row or field and the value when anything is wrong.
    """
    path = as_path(path)
    if path.suffix.lower() == ".csv":
        rows, units = _csv_rows(path)
    else:
        data = read_json(path)
        check_envelope(data, "stock", STOCK_VERSION, source=path)
        check_range(data, source=path)
        check_schema(data, "stock", source=path)
        rows = [(f"pieces[{n}]", entry) for n, entry in enumerate(data["pieces"])]
        units = units_from_dict(data.get("units"))
    counts: dict[str, dict[tuple[float, ...], int]] = {}
    for field, row in rows:
        kind, values, count = _piece(row, field, path)
        own = counts.setdefault(kind, {})
        own[values] = own.get(values, 0) + count
    if not counts:
        raise InputError("no pieces", source=path)
    parts = {kind: np.array(list(own)) for kind, own in counts.items()}
    try:
        kit = Kit(parts, units)
        check_lengths(kit)
        pieces = {kind: np.array(list(own.values())) for kind, own in counts.items()}
        return Stock(kit, pieces, together)
    except InputError as error:
        raise error.at(str(path)) from None


def stock_rows(
    kit: Kit, counts: Mapping[str, Sequence[int] | np.ndarray], units: Units
) -> list[dict[str, Any]]:
    """A stock's table as `load_stock` reads it: one row a part.

    kit : its parts; counts : kind -> (m,) how many pieces there are of each
    units : of the kit's numbers
    """
    names = dict.fromkeys(name for kind in kit.parts for name in part_kind(kind).parameter_names)
    rows: list[dict[str, Any]] = []
    for kind, parts in kit.parts.items():
        for values, count in zip(parts, counts[kind]):
            own = dict(zip(part_kind(kind).parameter_names, values.tolist()))
            row: dict[str, Any] = {"kind": kind, "count": int(count), "unit": units.length}
            if units.force != "N":
                row["force_unit"] = units.force
            rows.append(row | {name: own.get(name) for name in names})
    return rows


def _piece(row: Mapping[str, Any], field: str, path: Path) -> tuple[str, tuple[float, ...], int]:
    """Kind, canonical parameters and count of one row."""
    kind = row["kind"]
    if kind not in kind_names():
        known = ", ".join(kind_names())
        raise InputError(
            f"unknown kind of parts (known: {known})",
            source=path,
            field=f"{field}.kind",
            value=kind,
        )
    values = row["parameters"]
    names = part_kind(kind).parameter_names
    if isinstance(values, Mapping):
        missing = [name for name in names if name not in values]
        unknown = [name for name in values if name not in names]
        if missing or unknown:
            raise InputError(
                f"{did_you_mean(unknown[0], names) if unknown else ''}{kind} parts have the "
                f"parameters {', '.join(names)}",
                source=path,
                field=f"{field}.{unknown[0]}" if unknown else field,
                value=None if unknown else ", ".join(values) or None,
            )
        values = [values[name] for name in names]
    if len(values) != len(names):
        raise InputError(
            f"{kind} parts have {len(names)} parameters ({', '.join(names)})",
            source=path,
            field=f"{field}.parameters",
            value=values,
        )
    canonical = part_kind(kind).canonical(np.array([values], dtype=float))[0]
    return kind, tuple(canonical.tolist()), row["count"]


def _csv_rows(path: Path) -> tuple[list[tuple[str, dict[str, Any]]], Units | None]:
    """Rows as JSON has them, each with what to call it in an error; and their units."""
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"not UTF-8 text (byte {error.start})", source=path) from None
    delimiter = ";" if ";" in text.partition("\n")[0] else ","
    table = csv.DictReader(io.StringIO(text), delimiter=delimiter, skipinitialspace=True)
    try:
        header = [name.strip() for name in table.fieldnames or ()]
        for name in _OWN_COLUMNS:
            if name not in header:
                raise InputError("a column is missing", source=path, field=name)
        table.fieldnames = header
        lines = [(table.line_num, row) for row in table]
    except csv.Error as error:
        raise InputError(f"not CSV: {error}", source=path) from None
    return [_csv_row(line, row, path) for line, row in lines], _csv_units(lines, path)


def _csv_units(lines: Sequence[tuple[int, Mapping[str, Any]]], path: Path) -> Units | None:
    """The units that a table's columns name; None where they name none."""
    found: dict[str, str] = {}
    for column, field in _UNITS.items():
        for line, row in lines:
            name = (row.get(column) or "").strip()
            if name and found.setdefault(field, name) != name:
                raise InputError(
                    f"expected one unit in all rows ({found[field]} before)",
                    source=path,
                    field=f"line {line}, {column}",
                    value=name,
                )
    if "length" not in found:
        return None
    try:
        return Units(**found)
    except InputError as error:
        raise error.at(str(path)) from None


def _csv_row(line: int, row: Mapping[str, Any], path: Path) -> tuple[str, dict[str, Any]]:
    field = f"line {line}"
    if None in row or None in row.values():
        raise InputError("has another number of cells than the header", source=path, field=field)
    cells = {name: text.strip() for name, text in row.items()}
    parameters = {
        name: _number(text, path, f"{field}, {name}")
        for name, text in cells.items()
        if name not in (*_OWN_COLUMNS, *_UNITS) and text
    }
    count = _number(cells["count"], path, f"{field}, count")
    if not 0 <= count <= LARGEST_WHOLE or count != int(count):
        raise InputError(
            "expected a whole number from 0 to 2^53",
            source=path,
            field=f"{field}, count",
            value=cells["count"],
        )
    check_range(parameters, f"{path}: {field}")
    return field, {"kind": cells["kind"], "parameters": parameters, "count": int(count)}


def _number(text: str, path: Path, field: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError("expected a finite number", source=path, field=field, value=text)
    return value

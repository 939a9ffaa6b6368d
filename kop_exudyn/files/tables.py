"""Tables of plain values: one row of named columns each, written as CSV that pandas and
spreadsheets read."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .files import write_text

Row = Mapping[str, Any]


def csv_text(rows: Iterable[Row]) -> str:
    """Rows as CSV (RFC 4180, but for plain line feeds); columns in the order in which they first
    appear.

    Missing values and NaN are empty cells. Numbers are written so that reading them gives the same
    number.
    """
    rows = list(rows)
    columns = list(dict.fromkeys(name for row in rows for name in row))
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(row.get(name)) for name in columns] for row in rows)
    return buffer.getvalue()


def write_csv(path: str | Path, rows: Iterable[Row], *, overwrite: bool = False) -> Path:
    """Write rows as CSV. Raises InputError when the file exists or can't be written."""
    return write_text(path, csv_text(rows), overwrite=overwrite)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (float, np.floating)):
        return "" if np.isnan(value) else repr(float(value))
    text = str(value)
    # a spreadsheet would take such a text for a formula
    return (
        "'" + text
        if text[:1] in ("=", "+", "-", "@") and not isinstance(value, (int, np.integer))
        else text
    )

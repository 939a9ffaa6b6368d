"""Stock files: what they say, and what is wrong with others."""

import json

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.files.tables import write_csv
from kop_exudyn.io.stocks import load_stock, stock_rows
from kop_exudyn.kit.parts import Kit
from kop_exudyn.units import Units


def write(tmp_path, text, name="store.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def test_rows_of_like_parts_add_up(tmp_path):
    path = write(
        tmp_path, "kind, count, l1, l2, angle\nlinear,3,2,1,\nangular,4,,,0.5\nlinear,2,1,2,\n"
    )
    stock = load_stock(path)
    np.testing.assert_array_equal(stock.kit["linear"], [[1, 2]])
    assert stock.to_dict() == {"angular": [4], "linear": [5]} and not stock.together


def test_semicolons_and_a_byte_order_mark(tmp_path):
    stock = load_stock(write(tmp_path, "\ufeffcount;kind;angle\n7;angular;-0.25\n"), together=True)
    assert stock.to_dict() == {"angular": [7]} and stock.kit["angular"][0, 0] == 0.25
    assert stock.together


def test_json_by_order_and_by_name(tmp_path):
    pieces = [
        {"kind": "linear", "parameters": [2.0, 1.0], "count": 3},
        {"kind": "linear", "parameters": {"l2": 2.0, "l1": 1.0}, "count": 1},
        {"kind": "linear", "parameters": [1.0, 1.0], "count": 0},
    ]
    data = {"format": "kop_exudyn/stock", "version": 1, "units": {"length": "mm"}, "pieces": pieces}
    stock = load_stock(write(tmp_path, json.dumps(data), "store.json"))
    assert stock.to_dict() == {"linear": [4, 0]} and stock.kit.units == Units("mm")


@pytest.mark.parametrize("units", [Units("mm"), Units("m", "kN")])
def test_a_kits_pieces_are_read_as_they_were_written(units, tmp_path):
    parts = {"angular": np.array([[0.1], [1 / 3]]), "linear": np.array([[1 / 7, 2.0]])}
    rows = stock_rows(Kit(parts, units), {"angular": [3, 0], "linear": [5]}, units)
    stock = load_stock(write_csv(tmp_path / "store.csv", rows))
    assert stock.kit.units == units
    assert stock.to_dict() == {"angular": [3, 0], "linear": [5]}
    for kind, values in parts.items():
        np.testing.assert_array_equal(stock.kit[kind], values)


@pytest.mark.parametrize(
    "text, message",
    [
        ("kind,l1,l2\nlinear,1,2\n", "count: a column is missing"),
        ("kind,count\n", "no pieces"),
        (
            "kind,count,unit,l1,l2\nlinear,1,mm,1,2\nlinear,1,m,1,2\n",
            r"line 3, unit = 'm': expected one unit in all rows \(mm before\)",
        ),
        ("kind,count,unit,l1,l2\nlinear,1,mn,1,2\n", "unknown unit"),
        ("", "kind: a column is missing"),
        ("kind,count,l1,l2\nround,1,1,2\n", r"line 2.kind = 'round': unknown kind"),
        ("kind,count,l1\nlinear,1,1\n", r"line 2 = 'l1': linear parts have the parameters l1, l2"),
        (
            "kind,count,l1,l2,angle\nlinear,1,1,2,3\n",
            "line 2.angle: linear parts have",
        ),
        ("kind,count,l1,l2\nlinear,1.5,1,2\n", "line 2, count = '1.5': expected a whole number"),
        ("kind,count,l1,l2\nlinear,-1,1,2\n", "line 2, count = '-1'"),
        ("kind,count,l1,l2\nlinear,1,one,2\n", "line 2, l1 = 'one': expected a finite number"),
        ("kind,count,l1,l2\nlinear,1,inf,2\n", "line 2, l1 = 'inf'"),
        ("kind,count,l1,l2\nlinear,1,-1,2\n", r"kit.linear\[0\]"),
        ("kind,count,l1,l2\nlinear,1,1\n", "line 2: has another number of cells"),
        ("kind,count,l1,l2\nlinear,1,1,2,3\n", "line 2: has another number of cells"),
        ("kind,count,l1,l2\nlinear,1e30,1,2\n", "line 2, count = .1e30"),
    ],
)
def test_unusable_tables(text, message, tmp_path):
    with pytest.raises(InputError, match=message) as caught:
        load_stock(write(tmp_path, text))
    assert "store.csv" in str(caught.value)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"pieces": []}, "pieces"),
        ({"format": "kop_exudyn/kit"}, "format"),
        ({"pieces": [{"kind": "angular", "parameters": [0.1, 0.2], "count": 1}]}, "1 parameters"),
        ({"pieces": [{"kind": "angular", "parameters": [0.1], "count": 0.5}]}, "whole|integer"),
        ({"pieces": [{"kind": "angular", "parameters": [9.0], "count": 1}]}, "kit.angular"),
    ],
)
def test_unusable_json(change, message, tmp_path):
    data = {"format": "kop_exudyn/stock", "version": 1}
    data["pieces"] = [{"kind": "angular", "parameters": [0.1], "count": 1}]
    with pytest.raises(InputError, match=message):
        load_stock(write(tmp_path, json.dumps(data | change), "store.json"))


def test_other_files(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_stock(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"kind,count\xff")
    with pytest.raises(InputError, match="not UTF-8"):
        load_stock(tmp_path / "bytes.csv")

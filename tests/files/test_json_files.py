"""JSON as other programs write and read it."""

import gzip
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kop_exudyn.errors import InputError
from kop_exudyn.files.json_files import parse_json, plain, read_json, to_json, write_json

numbers = st.integers(-(10**9), 10**9) | st.floats(allow_nan=False, allow_infinity=False)
documents = st.recursive(
    st.none() | st.booleans() | numbers | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
)


@given(documents)
def test_what_is_written_is_read_back_exactly(value):
    assert parse_json(to_json(value)) == value


@pytest.mark.parametrize(
    "text, message",
    [
        ('{"a": NaN}', "NaN is not a number"),
        ("[1, -Infinity]", "-Infinity is not a number"),
        ("[1e999]", "1e999 is out of range"),
        ('{"a": 1, "b": 2, "a": 3}', "a: is given twice"),
        ("[" * 101 + "]" * 101, "nested more than 100 levels"),
        ("[" * 100_000, "nested more than 100 levels"),
        ("[1,\n 2,]", "line 2, column 4"),
        ("", "line 1, column 1"),
        ("1" * 5000, "too many digits"),
    ],
)
def test_what_is_refused(text, message):
    with pytest.raises(InputError, match=message) as caught:
        parse_json(text, source="design.json")
    assert str(caught.value).startswith("design.json: ")


def test_depth_within_the_limit_passes():
    parse_json("[" * 100 + "]" * 100)


def test_bytes_that_are_not_utf8(tmp_path):
    path = tmp_path / "latin.json"
    path.write_bytes('{"name": "Bögen"}'.encode("latin-1"))
    with pytest.raises(InputError, match=r"latin\.json: not UTF-8 text \(byte 11\)"):
        read_json(path)


def test_byte_order_mark_is_accepted(tmp_path):
    path = tmp_path / "bom.json"
    path.write_bytes(b"\xef\xbb\xbf[1]")
    assert read_json(path) == [1]


def test_numpy_and_what_is_not_finite():
    value = {
        "a": np.array([[1.5, np.nan]]),
        "b": np.int64(3),
        "c": (math.inf, np.bool_(True)),
        4: np.float32(0.5),
    }
    assert plain(value) == {"a": [[1.5, None]], "b": 3, "c": [None, True], "4": 0.5}


def test_layout_is_readable(tmp_path):
    path = write_json(
        tmp_path / "a.json", {"b": [1, 2.5], "a": [[1, 2], [3, 4]], "text": ["x", "y"], "none": []}
    )
    assert path.read_text() == (
        '{\n  "b": [1, 2.5],\n  "a": [\n    [1, 2],\n    [3, 4]\n  ],\n'
        '  "text": [\n    "x",\n    "y"\n  ],\n  "none": []\n}\n'
    )
    assert json.loads(path.read_text())["b"] == [1, 2.5]


def test_an_archive_that_unpacks_to_very_much_is_not_read(tmp_path, monkeypatch):
    import gzip

    from kop_exudyn.files import json_files

    monkeypatch.setattr(json_files, "SIZE_LIMIT", 10_000)
    path = tmp_path / "design.json.gz"
    path.write_bytes(gzip.compress(b"[" + b"0," * 100_000 + b"0]"))
    with pytest.raises(InputError, match="larger than"):
        json_files.read_json(path)


def test_a_name_that_says_so_gives_a_compressed_file(tmp_path):
    """It was written as text under the name, which no other program reads."""
    data = {"a": [1.5, 2.5], "b": "ü"}
    path = write_json(tmp_path / "a.json.gz", data)
    assert json.loads(gzip.decompress(path.read_bytes())) == read_json(path) == data
    assert write_json(tmp_path / "b.json.gz", data).read_bytes() == path.read_bytes()

"""Damaged files of every kind: read, or refused in one line, soon and in bounded memory; no pickle
is ever loaded.

studies/stress.py reads a hundred thousand of them.
"""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.files.arrays import load_arrays
from kop_exudyn.io.designs import load_design
from kop_exudyn.rods.sections import rectangle
from kop_exudyn.sqp.history import SQPState
from lib.stress.corpus import corpus
from lib.stress.fuzz import READERS, fuzz
from lib.stress.mutations import Tripwire, mutate, pickled_array

# the reader of mesh files, trimesh, casts whatever it finds
pytestmark = pytest.mark.filterwarnings(
    "ignore:invalid value encountered in cast:RuntimeWarning",
    "ignore:overflow encountered:RuntimeWarning",
)


def test_damaged_files(tmp_path):
    result = fuzz(range(1200), tmp_path)
    assert result.findings == []
    assert result.count == 1200 and result.slowest[0] < 10
    for name in corpus(tmp_path):
        assert result.refused[name] > 4, name
    assert sum(result.accepted.values()) > 30  # not all that changes a file makes it invalid


def test_mutations_follow_from_the_seed(tmp_path):
    for name, content in corpus(tmp_path).items():
        copies = [mutate(content, np.random.default_rng(seed)) for seed in (1, 1, 2, 3, 4)]
        assert copies[0] == copies[1], name
        assert len({*copies, content}) > 2, name


def test_the_fuzzing_notices_what_it_is_for(tmp_path, monkeypatch):
    def careless(path):
        np.load(io.BytesIO(pickled_array()), allow_pickle=True)
        raise ZeroDivisionError

    for name in READERS:
        if name != "kit":
            monkeypatch.setitem(READERS, name, lambda path: None)
    calls = iter([lambda path: None])  # the valid file at first
    monkeypatch.setitem(READERS, "kit", lambda path: next(calls, careless)(path))
    kinds = {(finding.file, finding.kind) for finding in fuzz(range(40), tmp_path).findings}
    assert kinds == {("kit-small.json", "ZeroDivisionError"), ("kit-small.json", "pickle")}


def test_hangs_and_hunger_are_noticed(tmp_path, monkeypatch):
    def hang(path):
        while True:
            pass

    for name in READERS:
        monkeypatch.setitem(READERS, name, lambda path: None)
    calls = iter([lambda path: None])
    monkeypatch.setitem(READERS, "job", lambda path: next(calls, hang)(path))
    states = iter([lambda path: None])
    monkeypatch.setitem(
        READERS, "states", lambda path: next(states, lambda path: bytearray(2**31))(path)
    )
    kinds = {
        finding.kind for finding in fuzz(range(40), tmp_path, seconds=0.02, megabytes=256).findings
    }
    assert kinds == {"hang", "MemoryError"}


def archive(tmp_path, entry: bytes):
    path = tmp_path / "x.npz"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("x.npy", entry)
    return path


def npy(header: str, data: bytes = b"") -> bytes:
    text = header.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + data


class TestArrays:
    """What the fuzzing found in the reader of arrays."""

    def test_a_pickle_is_refused_unread(self, tmp_path):
        with pytest.raises(InputError, match="not a readable file of arrays"):
            load_arrays(archive(tmp_path, pickled_array()))
        assert not Tripwire.sprung

    @pytest.mark.parametrize(
        "header",
        [
            # 745 GiB were allocated
            "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999,), }",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (True,), }",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }",
            "{'descr': '|V8', 'fortran_order': 3, 'shape': (1,), }",
            "",
            "{" * 50,
        ],
    )
    def test_headers_that_lie(self, tmp_path, header):
        with pytest.raises(
            InputError, match=r"^[^\n]*x\.npz: not a readable file of arrays: [^\n]*$"
        ):
            load_arrays(archive(tmp_path, npy(header, b"12345678")))

    def test_an_encrypted_archive(self, tmp_path):
        path = archive(
            tmp_path, npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }", b"12345678")
        )
        content = bytearray(path.read_bytes())
        for mark, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
            content[content.find(mark) + offset] |= 1
        path.write_bytes(content)
        with pytest.raises(InputError, match="encrypted"):
            load_arrays(path)


@pytest.mark.parametrize(
    "arrays",
    [
        {},
        {"numbers": np.array(3.0)},
        {"numbers": np.zeros(4)},
        {"numbers": np.zeros(5), "history": np.array("{")},
        {"numbers": np.zeros(5), "history": np.array('[{"step": 1}]'), "x": np.zeros(1)},
        {"numbers": np.zeros(5), "history": np.array("[]"), "x": np.zeros(1)},
    ],
)
def test_states_of_something_else(arrays):
    with pytest.raises(InputError, match="sqp"):
        SQPState.from_arrays(arrays)


class TestDesigns:
    @pytest.mark.parametrize(
        "path, value, message",
        [
            (("section", "width"), 1e300, "section.width = 1e+300: is out of range"),
            (
                ("curves", 0, "points", 1, 0),
                10**400,
                "points[1][0] = 'an integer of 401 digits': is out of range",
            ),
            (
                ("curves", 0, "points", 1, 0),
                -1e300,
                "curves[0].points[1][0] = -1e+300: is out of range",
            ),
        ],
    )
    def test_numbers_whose_powers_are_no_numbers(
        self, c_shell_data, write_json_file, path, value, message
    ):
        place = c_shell_data
        for step in path[:-1]:
            place = place[step]
        place[path[-1]] = value
        with pytest.raises(InputError) as caught:
            load_design(write_json_file("far.json", c_shell_data))
        assert message in str(caught.value)

    def test_long_texts_are_not_repeated(self, c_shell_data, write_json_file):
        with pytest.raises(InputError) as caught:
            load_design(write_json_file("long.json", c_shell_data | {"name": "a" * 5000}))
        assert len(str(caught.value)) < 500

    def test_a_section_of_the_size_of_the_universe(self):
        with pytest.raises(InputError, match="must be a positive number"):
            rectangle(1e200, 1.0)

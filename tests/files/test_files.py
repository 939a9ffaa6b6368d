"""Reading within limits, writing in one go."""

import gzip
import os
from pathlib import Path

import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.files.files import (
    check_output_file,
    file_stems,
    make_folder,
    read_bytes,
    write_bytes,
    write_text,
)


def test_writes_and_reads_back(tmp_path):
    path = write_text(tmp_path / "a.txt", "Länge\n")
    assert read_bytes(path) == "Länge\n".encode()
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_new_files_have_the_usual_permissions(tmp_path):
    (tmp_path / "usual").touch()
    path = write_bytes(tmp_path / "ours", b"")
    assert path.stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_overwrites_only_when_allowed(tmp_path):
    path = write_text(tmp_path / "a", "first")
    with pytest.raises(InputError, match="exists already"):
        write_text(path, "second")
    assert path.read_text() == "first"
    write_text(path, "third", overwrite=True)
    assert path.read_text() == "third"


def test_a_crash_while_writing_leaves_the_old_file_and_no_rubbish(tmp_path, monkeypatch):
    path = write_text(tmp_path / "a", "old")

    def fail(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(InputError, match="no space left"):
        write_text(path, "new", overwrite=True)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_gzip_is_read_whatever_the_name(tmp_path):
    path = tmp_path / "a.json"
    path.write_bytes(gzip.compress(b"content"))
    assert read_bytes(path) == b"content"


def test_a_gzip_bomb_is_not_unpacked(tmp_path):
    path = tmp_path / "bomb.gz"
    path.write_bytes(gzip.compress(bytes(10_000_000)))
    assert path.stat().st_size < 20_000
    with pytest.raises(InputError, match="larger than"):
        read_bytes(path, limit=100_000)


@pytest.mark.parametrize(
    "damage", [lambda b: b[:-9], lambda b: b[:20] + b"\0\0\0\0" + b[24:], lambda b: b[:4]]
)
def test_damaged_gzip(tmp_path, damage):
    path = tmp_path / "a.gz"
    path.write_bytes(damage(gzip.compress(os.urandom(1000))))
    with pytest.raises(InputError, match="damaged gzip file"):
        read_bytes(path)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda folder: folder / "missing", "no such file"),
        (lambda folder: folder, "is a folder"),
    ],
)
def test_unreadable(tmp_path, make, message):
    with pytest.raises(InputError, match=message):
        read_bytes(make(tmp_path))


def test_unwritable_output_is_found_before_the_work(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is a folder"):
        check_output_file(tmp_path)
    with pytest.raises(InputError, match="folder doesn't exist"):
        check_output_file(tmp_path / "no" / "such")
    with pytest.raises(InputError, match="is a file, expected a folder"):
        make_folder(tmp_path / "file")
    with pytest.raises(InputError, match="can't be written"):
        make_folder(tmp_path / "file" / "below")


def test_make_folder_leaves_nothing_in_it(tmp_path):
    assert list(make_folder(tmp_path / "a" / "b").iterdir()) == []


@pytest.mark.skipif(
    not Path("/proc/self").is_dir(), reason="needs a folder that nobody may write to"
)
def test_folder_that_nobody_may_write_to():
    with pytest.raises(InputError, match="can't be written"):
        make_folder("/proc/self/out")


def test_every_name_has_a_file_of_its_own():
    """Designs whose names differ in other characters only wrote over each other's files."""
    names = ["a b", "a_b", "A_B", "a+b", "a_b_2", "ü", "?", "!"]
    stems = file_stems(names)
    assert list(stems) == names and stems["a b"] == "a_b" and stems["ü"] == "ü"
    assert len({stem.casefold() for stem in stems.values()}) == len(names)
    assert file_stems(["one", "two"]) == {"one": "one", "two": "two"}

"""Seeded damage to files: to their bytes, to the tree of a JSON document, to the arrays in an
archive."""

from __future__ import annotations

import copy
import gzip
import io
import json
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

# What may stand where a number or a text is expected.
_ODD_TOKENS = (
    b"NaN",
    b"Infinity",
    b"-Infinity",
    b"1e999",
    b"1e-320",
    b"-0",
    b"null",
    b"true",
    b'""',
    b"[]",
    b"{}",
    b"9" * 400,
    b"1e308",
    b"0.1.2",
    b"\\u0000",
    b"[" * 300,
    b'"\xff\xfe"',
    b"\xed\xa0\x80",
    b"-1",
    b"1e7",
)
_ODD_VALUES: tuple[Any, ...] = (
    None,
    True,
    False,
    0,
    -1,
    1,
    2,
    10**9,
    -(10**30),
    1e-320,
    1e300,
    -1e300,
    0.5,
    "",
    "x",
    "\u0000",
    "../../x",
    "a" * 5000,
    [],
    {},
    [[]],
    [None],
    [0],
    [[0, 0]],
    {"type": "x"},
    [1, [2, [3]]],
)
_SHORT = 40  # bytes: larger pieces of a file are moved seldom


def mutate(content: bytes, rng: np.random.Generator) -> bytes:
    """A damaged copy; how much and in which way is drawn, with regard to what kind of file it
    is."""
    if content[:2] == b"PK" and rng.random() < 0.7:
        return _archive(content, rng)
    if content[:1] == b"{" and rng.random() < 0.6:
        return _document(content, rng)
    if rng.random() < 0.02:
        content = gzip.compress(content, 1)
    for _ in range(rng.geometric(0.6)):
        content = _BYTES[rng.integers(len(_BYTES))](content, rng)
    return content


# -- bytes -------------------------------------------------------------------------------------
def _place(content: bytes, rng: np.random.Generator) -> tuple[int, int]:
    start = int(rng.integers(len(content) + 1))
    length = (
        int(rng.integers(1, _SHORT))
        if rng.random() < 0.9
        else int(rng.integers(1, len(content) + 2))
    )
    return start, min(start + length, len(content))


def _flip(content: bytes, rng: np.random.Generator) -> bytes:
    data = bytearray(content)
    for place in rng.integers(max(len(data), 1), size=rng.integers(1, 9)):
        if data:
            data[place] ^= 1 << int(rng.integers(8))
    return bytes(data)


def _cut(content: bytes, rng: np.random.Generator) -> bytes:
    start, end = _place(content, rng)
    return content[:start] + content[end:]


def _truncate(content: bytes, rng: np.random.Generator) -> bytes:
    return content[: int(rng.integers(len(content) + 1))]


def _repeat(content: bytes, rng: np.random.Generator) -> bytes:
    start, end = _place(content, rng)
    return content[:end] + content[start:end] * int(rng.integers(1, 4)) + content[end:]


def _noise(content: bytes, rng: np.random.Generator) -> bytes:
    start, end = _place(content, rng)
    return content[:start] + rng.bytes(end - start) + content[end:]


def _token(content: bytes, rng: np.random.Generator) -> bytes:
    """Replace a word, most often a number, by something odd."""
    start, _ = _place(content, rng)
    while start < len(content) and not (chr(content[start]).isalnum() or content[start] in b"-."):
        start += 1
    end = start
    while end < len(content) and (chr(content[end]).isalnum() or content[end] in b"-.+_"):
        end += 1
    return content[:start] + _ODD_TOKENS[rng.integers(len(_ODD_TOKENS))] + content[end:]


_BYTES: tuple[Callable[[bytes, np.random.Generator], bytes], ...] = (
    _flip,
    _cut,
    _truncate,
    _repeat,
    _noise,
    _token,
    _token,
    _token,
)


# -- JSON --------------------------------------------------------------------------------------
def _document(content: bytes, rng: np.random.Generator) -> bytes:
    """Valid JSON with wrong, missing, further, exchanged or repeated content."""
    tree = json.loads(content)
    for _ in range(rng.geometric(0.6)):
        _change(tree, rng)
    return json.dumps(tree).encode()


def _change(tree: Any, rng: np.random.Generator) -> None:
    place, key = _random_place(tree, rng)
    if place is None:
        return
    kind = rng.integers(8)
    if kind == 0:
        del place[key]
    elif kind == 1 and isinstance(place, dict):
        place[str(rng.choice(["name", "x", "type", "points", ""]))] = place.pop(key)
    elif kind == 2 and isinstance(place, list):
        place.insert(key, copy.deepcopy(place[int(rng.integers(len(place)))]))
    elif kind == 3 and isinstance(place[key], (int, float)) and not isinstance(place[key], bool):
        place[key] = place[key] * float(rng.choice([-1.0, 0.0, 1e-12, 1e12, 1.001, 2.0])) + float(
            rng.choice([0.0, 1.0])
        )
    elif kind == 4:
        other, other_key = _random_place(tree, rng)
        place[key] = copy.deepcopy(other[other_key])
    else:
        place[key] = copy.deepcopy(_ODD_VALUES[rng.integers(len(_ODD_VALUES))])


def _random_place(tree: Any, rng: np.random.Generator) -> tuple[Any, Any]:
    """A container and a key in it, levels equally likely."""
    place, key = None, None
    while isinstance(tree, (dict, list)) and tree and (place is None or rng.random() < 0.75):
        place = tree
        key = (
            list(tree)[rng.integers(len(tree))]
            if isinstance(tree, dict)
            else int(rng.integers(len(tree)))
        )
        tree = tree[key]
    return place, key


# -- archives of arrays ------------------------------------------------------------------------
def _archive(content: bytes, rng: np.random.Generator) -> bytes:
    """A valid archive with damaged, missing, further or pickled arrays in it."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    names = list(entries)
    name = names[rng.integers(len(names))]
    kind = rng.integers(6)
    if kind == 0:
        del entries[name]
    elif kind == 1:
        entries[name] = pickled_array()
    elif kind == 2:
        entries[name] = _header(entries[name], rng)
    elif kind == 3:
        entries[str(rng.choice(["../x.npy", "x", "", "a/b/c/d.npy", name + "x"]))] = entries.pop(
            name
        )
    elif kind == 4:
        entries[name], entries[names[rng.integers(len(names))]] = (
            entries[names[rng.integers(len(names))]],
            entries[name],
        )
    else:
        entries[name] = _BYTES[rng.integers(len(_BYTES))](entries[name], rng)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries.items():
            archive.writestr(zipfile.ZipInfo(name or "x"), data)
    return buffer.getvalue()


def _header(entry: bytes, rng: np.random.Generator) -> bytes:
    """Another type or shape in the header of an .npy file."""
    new = rng.choice(
        [
            b"'|O'",
            b"'<f4'",
            b"'<U9'",
            b"'<i8'",
            b"'|V8'",
            b"[('a','<f8')]",
            b"'<M8[s]'",
            b"'|b1'",
            b"'x'",
        ]
    )
    if rng.random() < 0.5:
        return entry.replace(b"'<f8'", new, 1)
    start, end = entry.find(b"("), entry.find(b")")
    shape = rng.choice(
        [b"(99999999999,", b"(-1,", b"(0,", b"(2,2,2,", b"(1e9,", b"('a',", b"(True,", b"("]
    )
    return entry[:start] + shape + entry[end:]


class Tripwire:
    """Unpickling it sets off an alarm."""

    sprung = False

    def __reduce__(self):
        return _spring, ()


def _spring() -> None:
    Tripwire.sprung = True


def pickled_array() -> bytes:
    """An .npy file of objects, which only unpickling could read."""
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.array([Tripwire()], dtype=object), allow_pickle=True)
    return buffer.getvalue()

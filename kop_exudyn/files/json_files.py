"""JSON: read strictly, written readably and without values that other programs can't read."""

from __future__ import annotations

import gzip
import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ..errors import InputError
from .files import encoded, read_bytes, write_bytes, write_text

# Our documents are at most ten levels deep; this is short of what would exhaust Python's stack.
MAX_DEPTH = 100
# Of the text, unpacked: the largest released umbrella meshes have a tenth of it, and reading takes
# ten times as much memory.
SIZE_LIMIT = 64 * 2**20

# An innermost list without strings, as json.dumps spreads it over lines.
_FLAT_LIST = re.compile(r'\[\n\s+([^\[\]{}"]*?)\n\s*\]')
# How half of a UTF-16 pair is written; two that belong together are one character.
_HALF = re.compile(r"\\u[dD][89a-fA-F]")
_LINE_END = re.compile(r"\n\s+")


JSON_ENDINGS = (".json", ".json.gz")  # of the names of files that `read_json` reads


def is_json_file(path: str | Path) -> bool:
    """Whether a file's name is that of a JSON file, perhaps gzipped."""
    return str(path).lower().endswith(JSON_ENDINGS)


def json_stem(path: Path) -> str:
    """The name of a JSON file without its ending."""
    ending = next((end for end in JSON_ENDINGS[::-1] if path.name.lower().endswith(end)), "")
    return path.name[: len(path.name) - len(ending)]


def read_json(path: str | Path) -> Any:
    """The content of a JSON file, which may be gzipped.

    Raises InputError for unreadable files, for bytes that aren't UTF-8 and for what Python's reader
    would let pass: NaN and Infinity, numbers beyond double precision's range, a key twice in one
    object, excessive nesting; and for texts of more than 64 MB.
    """
    content = read_bytes(path, SIZE_LIMIT)
    try:
        text = content.decode("utf-8-sig")  # some editors start a file with a byte-order mark
    except UnicodeDecodeError as error:
        raise InputError(f"not UTF-8 text (byte {error.start})", source=path) from None
    return parse_json(text, source=path)


def parse_json(text: str, source: Any = None) -> Any:
    """`read_json` for text at hand; `source` is named in errors."""
    try:
        value = json.loads(
            text,
            parse_constant=_refuse_constant,
            parse_float=_finite,
            object_pairs_hook=_without_duplicates,
        )
        if not _shallower_than(value, MAX_DEPTH):
            raise RecursionError
        if _HALF.search(text):
            _refuse_surrogates(value)
    except json.JSONDecodeError as error:
        raise InputError(
            f"not JSON: line {error.lineno}, column {error.colno}: {error.msg}", source=source
        ) from None
    except RecursionError:
        raise InputError(f"nested more than {MAX_DEPTH} levels deep", source=source) from None
    except InputError as error:
        raise error.at(source) from None
    except ValueError:  # an integer of thousands of digits
        raise InputError("contains a number with too many digits", source=source) from None
    return value


def write_json(path: str | Path, value: Any, *, overwrite: bool = False) -> Path:
    """Write plain data, numpy's arrays and numbers included, as `to_json` does; compressed where
    the name ends in .gz. Raises InputError as `write_text`."""
    text = to_json(value)
    if not str(path).lower().endswith(".gz"):
        return write_text(path, text, overwrite=overwrite)
    content = gzip.compress(encoded(text, path), mtime=0)  # the same data gives the same bytes
    return write_bytes(path, content, overwrite=overwrite)


def to_json(value: Any) -> str:
    """Indented JSON text with a final line end; keys in the given order, lists of numbers on one
    line, NaN as null."""
    text = json.dumps(plain(value), indent=2, ensure_ascii=False, allow_nan=False)
    return _FLAT_LIST.sub(lambda found: f"[{_LINE_END.sub(' ', found[1])}]", text) + "\n"


def plain(value: Any, *, finite: bool = True) -> Any:
    """The same data in JSON's own types: tuples and arrays as lists, paths as texts.

    finite : whether numbers that aren't finite become None, or stay
    """
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) or not finite else None
    if isinstance(value, Mapping):
        return {str(key): plain(item, finite=finite) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item, finite=finite) for item in value]
    if isinstance(value, Path):
        return value.as_posix()
    return value


def _refuse_constant(name: str) -> NoReturn:
    raise InputError(f"{name} is not a number that JSON knows")


def _refuse_surrogates(value: Any) -> None:
    try:
        json.dumps(value, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        half = ord(error.object[error.start])
        raise InputError(
            f"contains \\u{half:04x}, half of a pair of surrogates, which is no character"
        ) from None


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise InputError(f"the number {text} is out of range")
    return value


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        keys = [key for key, _ in pairs]
        raise InputError(
            "is given twice in one object", field=next(k for k in keys if keys.count(k) > 1)
        )
    return result


def _shallower_than(value: Any, depth: int) -> bool:
    if isinstance(value, dict):
        value = list(value.values())
    if not isinstance(value, list):
        return True
    return depth > 0 and all(_shallower_than(item, depth - 1) for item in value)

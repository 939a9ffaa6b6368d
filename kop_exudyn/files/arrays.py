"""Named arrays in one .npz file: written in one go, read without pickles."""

from __future__ import annotations

import hashlib
import io
import math
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .files import SIZE_LIMIT, read_bytes, write_bytes

SEAL = "seal"


def save_arrays(
    path: str | Path, arrays: Mapping[str, np.ndarray], *, overwrite: bool = False
) -> Path:
    """Write arrays of numbers, truth values or texts; the same arrays give the same bytes.

    Raises InputError when the file exists already or can't be written, ValueError for arrays of
    objects.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            # not numpy.savez: its keywords collide with names such as "file"
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, np.asanyarray(array), allow_pickle=False)
    return write_bytes(path, buffer.getvalue(), overwrite=overwrite)


def load_arrays(path: str | Path, limit: int = SIZE_LIMIT) -> dict[str, np.ndarray]:
    """All arrays of a file.

    Raises InputError when it is damaged, needs pickle, or unpacks to more than `limit` bytes.
    """
    content = read_bytes(path, limit)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > limit:
                raise InputError(f"unpacks to more than {limit / 2**20:g} MB", source=path)
            return {
                entry.filename.removesuffix(".npy"): _read(archive, entry)
                for entry in archive.infolist()
            }
    except InputError:
        raise
    except (
        zipfile.BadZipFile,
        zlib.error,
        EOFError,
        ValueError,
        NotImplementedError,
        RuntimeError,
        TypeError,
        # the last three: numpy's reader of damaged headers
        SyntaxError,
        tokenize.TokenError,
    ) as error:
        raise InputError(
            f"not a readable file of arrays: {_one_line(error)}", source=path
        ) from None


def sealed(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The arrays with a seal: the SHA-256 of their names, kinds, shapes and contents."""
    return {**arrays, SEAL: np.array(_digest(arrays))}


def unsealed(
    arrays: Mapping[str, np.ndarray], source: Any = None, *, needed: bool = True
) -> dict[str, np.ndarray]:
    """The arrays without their seal.

    Raises InputError where it doesn't fit them: then they aren't what was written. Where it is
    missing, only if it is needed: files of earlier versions have none.
    """
    found = dict(arrays)
    seal = found.pop(SEAL, None)
    if seal is None and not needed:
        return found
    if seal is None or seal.dtype.kind != "U" or str(seal) != _digest(found):
        raise InputError("is damaged: it isn't what was written", source=source)
    return found


def numbers_of(
    arrays: Mapping[str, np.ndarray],
    name: str,
    shape: tuple[int | None, ...],
    *,
    finite: bool = True,
) -> np.ndarray:
    """One of several arrays as contiguous floats.

    shape : what it must have, None for any size

    Raises InputError, naming the array, when it is missing, holds no numbers, is of another shape
    or, unless that is allowed, not finite.
    """
    if name not in arrays:
        raise InputError("is missing", field=name)
    array = np.asarray(arrays[name])
    fits = len(array.shape) == len(shape) and all(
        size is None or size == given for size, given in zip(shape, array.shape)
    )
    if array.dtype.kind not in "fiu" or not fits:
        wanted = ", ".join("any" if size is None else str(size) for size in shape)
        raise InputError(
            f"expected numbers of shape ({wanted}), got {array.dtype} of shape {array.shape}",
            field=name,
        )
    array = np.ascontiguousarray(array, float).reshape(array.shape)
    if finite and not np.isfinite(array).all():
        raise InputError("contains numbers that are not finite", field=name)
    return array


def _digest(arrays: Mapping[str, np.ndarray]) -> str:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.asarray(arrays[name])
        digest.update(f"{name}|{array.dtype.str}|{array.shape}|".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _read(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> np.ndarray:
    content = archive.read(entry)
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    if version != (1, 0):
        raise ValueError(f"array format {version[0]}.{version[1]}")
    shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
    # before anything of that size is allocated
    if math.prod(shape) * dtype.itemsize != len(content) - stream.tell():
        raise ValueError(f"the array {entry.filename} isn't of the size that it claims")
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:120]

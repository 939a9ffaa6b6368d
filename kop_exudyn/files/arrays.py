"""Named arrays in one .npz file: written in one go, read without pickles."""

from __future__ import annotations

import io
import math
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..errors import InputError
from .files import SIZE_LIMIT, read_bytes, write_bytes


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

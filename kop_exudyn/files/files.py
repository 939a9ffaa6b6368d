"""Files: bounded reading, atomic writing, and knowing before a long computation that its output can
be written.

What a path is, is asked of os.path: pathlib's questions raise OSError for names that are too long.
"""

from __future__ import annotations

import gzip
import itertools
import os
import re
import tempfile
import zlib
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError, OccupiedError

# Far more than any design, kit or result needs; keeps a hostile archive from filling the memory.
SIZE_LIMIT = 512 * 2**20

_GZIP_MAGIC = b"\x1f\x8b"
_TEMPORARY = ".part"


def read_bytes(path: str | Path, limit: int = SIZE_LIMIT) -> bytes:
    """The content of a file, decompressed where it is gzip's (told by its first bytes, not by its
    name).

    Raises InputError when it can't be read, is damaged, or is larger than `limit` bytes.
    """
    path = as_path(path)
    try:
        with open(path, "rb") as file:
            content = file.read(limit + 1)
        if content[:2] == _GZIP_MAGIC:
            with gzip.open(path, "rb") as archive:
                content = archive.read(limit + 1)
    except FileNotFoundError:
        raise InputError("no such file", source=path) from None
    except IsADirectoryError:
        raise InputError("is a folder, expected a file", source=path) from None
    except (gzip.BadGzipFile, zlib.error, EOFError) as error:
        raise InputError(f"damaged gzip file: {error}", source=path) from None
    except OSError as error:
        raise InputError(f"can't be read: {reason_of(error)}", source=path) from None
    if len(content) > limit:
        raise InputError(f"larger than {limit / 2**20:g} MB", source=path)
    return content


def write_bytes(path: str | Path, content: bytes, *, overwrite: bool = False) -> Path:
    """Write a file in one go: readers see all of it or nothing, also when the process is killed
    meanwhile.

    Raises InputError when the file exists and `overwrite` is false, or when it can't be written.
    """
    path = as_path(path)
    check_output_file(path, overwrite=overwrite)
    temporary = None
    try:
        # in the same folder, so that os.replace stays within one file system and is atomic
        with tempfile.NamedTemporaryFile(
            dir=path.parent, prefix=f".{path.name}.", suffix=_TEMPORARY, delete=False
        ) as file:
            temporary = file.name
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"can't be written: {reason_of(error)}", source=path) from None
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)
    return path


def is_temporary(path: Path) -> bool:
    """Whether this is what `write_bytes` leaves when the process is killed while it writes."""
    return path.name.startswith(".") and path.name.endswith(_TEMPORARY)


def write_text(path: str | Path, text: str, *, overwrite: bool = False) -> Path:
    """`write_bytes` for text: UTF-8, line ends as they are. Raises InputError too as `encoded`."""
    return write_bytes(path, encoded(text, path), overwrite=overwrite)


def encoded(text: str, path: str | Path) -> bytes:
    """The text in UTF-8. Raises InputError naming the file that it is for, for text with
    surrogates, of file names that aren't UTF-8, say."""
    try:
        return text.encode()
    except UnicodeEncodeError as error:
        raise InputError(
            f"can't be written: a text has {text[error.start]!r}, which is no character",
            source=path,
        ) from None


def check_output_file(path: str | Path, *, overwrite: bool = False) -> None:
    """Raise InputError unless this file could be written now; its folder must exist."""
    path = as_path(path)
    if os.path.isdir(path):
        raise InputError("is a folder, expected a file to write", source=path)
    if os.path.exists(path) and not overwrite:
        raise OccupiedError("exists already", source=path)
    if not os.path.isdir(path.parent):
        raise InputError("can't be written: its folder doesn't exist", source=path)


def check_ending(path: Path, endings: Sequence[str], field: str) -> None:
    """Raise InputError unless a file to write has one of these endings.

    field : of the path, as errors name it
    """
    if not path.name.lower().endswith(tuple(endings)):
        raise InputError(
            f"expected a name that ends in {' or '.join(endings)}", field=field, value=str(path)
        )


def make_folder(path: str | Path) -> Path:
    """Make a folder for output, with its parents, and make sure that files can be written in it.

    Raises InputError when it can't be made or written to.
    """
    path = as_path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        # permission bits tell neither of a full nor of a read-only disk
        with tempfile.TemporaryFile(dir=path):
            pass
    except FileExistsError:
        raise InputError("is a file, expected a folder to write to", source=path) from None
    except OSError as error:
        raise InputError(f"can't be written: {reason_of(error)}", source=path) from None
    return path


def as_path(path: str | Path) -> Path:
    """The path; raises InputError for what is none, and for a name that no system knows."""
    if not isinstance(path, (str, os.PathLike)):
        raise InputError("expected a path", field="path", value=type(path).__name__)
    if "\0" in str(path):
        raise InputError("a name can't contain the character NUL", source=repr(str(path)))
    return Path(path)


def _umask() -> int:
    """The process's mask for new files; it can only be read by setting it."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


def reason_of(error: OSError) -> str:
    """What the system says of it, as part of a sentence."""
    return (error.strerror or str(error)).lower()


def file_stem(name: str) -> str:
    """A design's name as part of a file's: letters, digits and a few harmless characters."""
    return re.sub(r"[^\w.-]+", "_", name).strip("._") or "design"


def file_stems(names: Sequence[str]) -> dict[str, str]:
    """Names of designs as parts of files' names, each another one, also where upper and lower case
    are the same: a number is added to what others have already."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        stem = file_stem(name)
        numbered = (f"{stem}_{k}" for k in itertools.count(2))
        own = next(s for s in itertools.chain([stem], numbered) if s.casefold() not in taken)
        taken.add(own.casefold())
        found[name] = own
    return found

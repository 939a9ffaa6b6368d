"""Compiling the C sources into one shared library. Runs before the package is installed, so it
needs the standard library alone."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from functools import cache
from pathlib import Path

SOURCES = Path(__file__).parent / "sources"
BUILT = Path(__file__).parent / "built"  # where the installation puts the library
_FLAGS = ("-std=gnu11", "-O3", "-fPIC", "-shared", "-fno-math-errno", "-Wno-psabi")
_TIME_LIMIT_S = 300


class BuildError(Exception):
    """No library was made; the message says why."""


def compiler() -> list[str] | None:
    """The command of a C compiler: that of CC, or the first one found; None without any.

    The last resort is the package `ziglang`, a whole compiler as a wheel.
    """
    if os.environ.get("CC"):
        return shlex.split(os.environ["CC"])
    for name in ("cc", "gcc", "clang"):
        found = shutil.which(name)
        if found:
            return [found]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    return None


def build(folder: Path) -> Path:
    """Compile into a folder, which is made if need be; returns the library's path.

    Raises BuildError when there is no compiler, when it fails, or the folder can't be written.
    """
    command = compiler()
    if command is None:
        raise BuildError("no C compiler was found")
    target = folder / file_name()
    files = [str(file) for file in sorted(SOURCES.glob("*.c"))]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            made = Path(scratch) / target.name
            done = subprocess.run(
                [*command, *_flags(command), *files, "-o", str(made), "-lm"],
                capture_output=True,
                text=True,
                timeout=_TIME_LIMIT_S,
            )
            if done.returncode != 0 or not made.is_file():
                raise BuildError(f"{command[0]} failed: {done.stderr.strip()[-2000:]}")
            os.replace(made, target)  # at once: other processes may be looking for it
    except (OSError, subprocess.TimeoutExpired) as error:
        raise BuildError(str(error)) from None
    return target


@cache
def file_name() -> str:
    """Name of the library that belongs to these sources and this machine."""
    digest = hashlib.sha256(repr(_FLAGS).encode())
    for file in sorted(SOURCES.iterdir()):
        if file.suffix in (".c", ".h"):
            digest.update(file.name.encode() + file.read_bytes())
    place = f"{sysconfig.get_platform()}-{instruction_set() or 'plain'}"
    return f"kernels-{digest.hexdigest()[:16]}-{place}{'.dll' if os.name == 'nt' else '.so'}"


@cache
def instruction_set() -> str | None:
    """The x86-64 level with vectors of four numbers, if this processor is known to have it."""
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return None
    try:
        flags = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace")
    except OSError:
        return None
    words = next((line.split() for line in flags.splitlines() if line.startswith("flags")), [])
    return "x86-64-v3" if {"avx2", "fma", "bmi2"} <= set(words) else None


def _flags(command: list[str]) -> list[str]:
    level = instruction_set()
    if level is None:
        return list(_FLAGS)
    zig = "ziglang" in command
    return [*_FLAGS, f"-mcpu={level.replace('-', '_')}" if zig else f"-march={level}"]

"""Two versions of the package measured side by side, in turns, on one machine."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from statistics import median
from typing import Any

from kop_exudyn.errors import InputError

_SCRIPT = Path(__file__).with_name("version_cases.py")
_PARTS = ("kop_exudyn", "models")
_MADE = ("__pycache__", "built")  # by earlier runs
_CACHES = ("numba", "cache")
_SAME = 1e-6  # relative difference of two states that are taken for one


@dataclass(frozen=True)
class Case:
    """name : for readers; script : of `version_cases`, or "cold" and "warm" for `kop simulate`
    argument : its model (a file in the folder of models), or its size
    runs : in a process;  rounds : processes of each version, in turns
    """

    name: str
    script: str
    argument: str
    runs: int = 1
    rounds: int = 3


@dataclass(frozen=True)
class Version:
    """A copy of a version in a folder of its own, without anything compiled.

    models : folder of the designs that it is measured on
    """

    name: str
    folder: Path
    models: Path

    def measure(self, case: Case) -> tuple[float, float | None]:
        """Seconds of processor time (MiB for memory), and what tells the state.

        Raises RuntimeError with what the version said when it failed.
        """
        model = self.models / case.argument
        argument = str(model) if model.is_file() else case.argument
        if case.script in ("cold", "warm"):
            if case.script == "cold":
                self.forget()
            seconds, said = self._run("-m", "kop_exudyn", "simulate", argument, "--json")
            return seconds, float(json.loads(said)["fit"]["max_percent"])
        found = json.loads(self._run(str(_SCRIPT), case.script, argument, str(case.runs))[1])
        return found["amount"], found["state"]

    def forget(self) -> None:
        """Remove everything that was compiled."""
        for name in _MADE:
            for folder in list(self.folder.rglob(name)):
                shutil.rmtree(folder)
        for name in _CACHES:
            shutil.rmtree(self.folder / name, ignore_errors=True)

    def _run(self, *arguments: str) -> tuple[float, str]:
        """Processor seconds of a Python process with this version, and its last line."""
        settings = os.environ | {
            "PYTHONPATH": str(self.folder),
            "NUMBA_CACHE_DIR": str(self.folder / "numba"),
            "XDG_CACHE_HOME": str(self.folder / "cache"),
            "OMP_NUM_THREADS": "1",
        }
        before = os.times()
        done = subprocess.run(
            [sys.executable, *arguments],
            capture_output=True,
            text=True,
            env=settings,
            cwd=self.folder,  # Python looks there first
        )
        after = os.times()
        if done.returncode:
            raise RuntimeError((done.stderr.strip().splitlines() or ["no message"])[-1])
        seconds = after.children_user - before.children_user
        seconds += after.children_system - before.children_system
        return seconds, done.stdout if "--json" in arguments else done.stdout.splitlines()[-1]


def copied(
    source: str, name: str, repository: Path, folder: Path, models: Path | None = None
) -> Version:
    """A version from a folder with its files, or from a commit of the repository.

    models : default: its own

    Raises InputError when it is neither.
    """
    target = folder / name
    if Path(source).is_dir():
        for part in _PARTS:
            shutil.copytree(
                Path(source) / part, target / part, ignore=shutil.ignore_patterns(*_MADE)
            )
        return Version(name, target, models or target / "models")
    done = subprocess.run(
        ["git", "archive", "--format=tar", source, *_PARTS], cwd=repository, capture_output=True
    )
    if done.returncode:
        raise InputError("neither a folder nor a commit", field="--other", value=source)
    with tarfile.open(fileobj=BytesIO(done.stdout)) as archive:
        archive.extractall(target, filter="data")
    return Version(name, target, models or target / "models")


def compared(cases: list[Case], this: Version, other: Version) -> Iterator[dict[str, Any]]:
    """A row a case: medians of both versions, their ratio, the least and most ratio of a round, and
    whether both reached the same state."""
    for case in cases:
        found: dict[str, list] = {this.name: [], other.name: []}
        try:
            for _ in range(case.rounds):
                for version in (other, this):
                    found[version.name].append(version.measure(case))
        except RuntimeError as error:
            yield _row(case) | {"same state": f"{version.name} failed: {error}"[:120]}
            continue
        own, its = (([a for a, _ in found[v.name]]) for v in (this, other))
        states = [found[v.name][-1][1] for v in (this, other)]
        ratios = [a / b for a, b in zip(own, its)]
        apart = abs(states[0] - states[1]) <= _SAME * max(1.0, *map(abs, states))
        yield _row(case) | {
            "this": median(own),
            "other": median(its),
            "ratio": median(own) / median(its),
            "least ratio": min(ratios),
            "most": max(ratios),
            "same state": "yes" if apart else f"no: {states[0]:.9g} and {states[1]:.9g}",
        }


def _row(case: Case) -> dict[str, Any]:
    nothing = dict.fromkeys(("this", "other", "ratio", "least ratio", "most"))
    return {"case": case.name, "unit": "MiB" if case.script == "memory" else "s", **nothing}

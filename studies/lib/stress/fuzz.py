"""Feeds damaged files to every reader: each must read them or raise InputError, soon, and in
bounded memory."""

from __future__ import annotations

import logging
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from kop_exudyn.errors import InputError
from kop_exudyn.exchange.drawn_networks import read_network
from kop_exudyn.geometry.mesh_surface import load_mesh_surface
from kop_exudyn.io.checkpoint import CheckpointStore, Job
from kop_exudyn.io.designs import load_design
from kop_exudyn.io.kits import load_kit
from kop_exudyn.io.results import load_result, load_states
from kop_exudyn.io.studies import load_study
from kop_exudyn.sqp.history import SQPState

from .corpus import STUDY_DESIGNS, corpus
from .limits import TimeOut, memory_limit, time_limit
from .mutations import Tripwire, mutate


def _network(path):
    """A drawing, as far as `kop import` gets without knowing of rods."""
    return read_network(path).network


def _checkpoint(path: Path) -> SQPState:
    arrays = CheckpointStore(path.parent).load(path.stem)
    assert arrays is not None
    return SQPState.from_arrays(
        {name[4:]: value for name, value in arrays.items() if name.startswith("sqp/")}
    )


READERS: dict[str, Callable[[Path], Any]] = {
    "design": load_design,
    "kit": load_kit,
    "result": load_result,
    "states": load_states,
    "checkpoint": _checkpoint,
    "job": Job.load,
    "mesh": load_mesh_surface,
    "drawing": _network,
    "study": load_study,
}

# How often a file of the corpus is chosen, where reading it is slow.
_SELDOM = {
    "design-grid.json": 0.2,
    "design-release.json": 0.5,
    "drawing-net.dxf": 0.3,
    "mesh-patch.obj": 0.3,
    "mesh-patch.ply": 0.3,
    "mesh-patch.stl": 0.3,
}


@dataclass(frozen=True)
class Finding:
    """A mutation that a reader did not take well: what it raised, or "hang", or "pickle"."""

    seed: int
    file: str
    kind: str
    detail: str


@dataclass
class FuzzResult:
    """count : files read; accepted : of them without complaint; slowest : (seconds, seed, file)"""

    count: int = 0
    accepted: Counter = field(default_factory=Counter)
    refused: Counter = field(default_factory=Counter)
    findings: list[Finding] = field(default_factory=list)
    slowest: tuple[float, int, str] = (0.0, -1, "")


def fuzz(
    seeds: Iterable[int], folder: Path, seconds: float = 20.0, megabytes: float = 1024.0
) -> FuzzResult:
    """Read one mutated file for every seed.

    folder : for scratch files
    seconds : of processor time for one file; megabytes : by which the process may grow at most
    """
    files = corpus(folder)
    names = sorted(files)
    weights = np.array([_SELDOM.get(name, 1.0) for name in names])
    result = FuzzResult()
    for name in STUDY_DESIGNS:
        (folder / name).touch()
    # once as they are: modules are loaded before memory is limited, and the files are valid
    for name in names:
        READERS[name.partition("-")[0]](_written(folder, name, files[name]))
    with memory_limit(megabytes), _quiet():
        for seed in seeds:
            rng = np.random.default_rng([seed, 2])
            name = names[rng.choice(len(names), p=weights / weights.sum())]
            path = _written(folder, name, mutate(files[name], rng))
            _read(seed, name, path, result, seconds)
            path.unlink()
    return result


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the messages of readers that leave out what they don't know."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _written(folder: Path, name: str, content: bytes) -> Path:
    path = folder / name
    path.write_bytes(content)
    return path


def _read(seed: int, name: str, path: Path, result: FuzzResult, seconds: float) -> None:
    begin = process_time()
    result.count += 1
    try:
        with time_limit(seconds), np.errstate(all="ignore"):
            READERS[name.partition("-")[0]](path)
        result.accepted[name] += 1
    except InputError as error:
        result.refused[name] += 1
        if "\n" in str(error) or len(str(error)) > 2000:
            result.findings.append(Finding(seed, name, "message", str(error)[:200]))
    except TimeOut:
        result.findings.append(Finding(seed, name, "hang", f"more than {seconds:g} s"))
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        result.findings.append(
            Finding(
                seed,
                name,
                type(error).__name__,
                f"{str(error)[:120]} ({Path(where.filename).name}:{where.lineno})",
            )
        )
    if Tripwire.sprung:
        result.findings.append(Finding(seed, name, "pickle", "a pickle was loaded"))
        Tripwire.sprung = False
    result.slowest = max(result.slowest, (process_time() - begin, seed, name))

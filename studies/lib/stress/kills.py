"""Kills the command line's optimisation at random moments, resumes it, and compares what is left in
the end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np

from kop_exudyn.files.arrays import load_arrays
from kop_exudyn.files.json_files import write_json

from .arch import arch_data

# `kop` itself, with the class of the stress tests known to it, and small pictures in its report:
# drawing large ones takes longer than finding these kits
_PROGRAM = """
import sys
from functools import partial
import lib.stress.arch
from kop_exudyn.cli import main
from kop_exudyn.report import kit_report
kit_report.kit_pictures = partial(kit_report.kit_pictures, width=160, height=115)
sys.exit(main())
"""
_SAMPLES = 2  # of a verdict, which comes after all that is kept
_STUDIES = Path(__file__).resolve().parents[2]
# all in a result that may differ between two runs of one job
_TIMES = {"wall_s", "peak_memory_mb", "seconds"}


def write_designs(folder: Path, count: int = 2, joints: int = 6) -> Path:
    """Write some arches' design files."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, data in enumerate(arch_data(count, joints)):
        write_json(folder / f"arch_{number}.json", data)
    return folder


def start(designs: Path, out: Path, effort: str = "normal") -> subprocess.Popen:
    """`kop optimize DESIGNS --resume --out OUT` in a process of its own."""
    return subprocess.Popen(
        [
            sys.executable,
            "-c",
            _PROGRAM,
            "optimize",
            str(designs),
            "--parts",
            "linear=2",
            "--out",
            str(out),
            "--jobs",
            "1",
            "--effort",
            effort,
            "--samples",
            str(_SAMPLES),
            "--resume",
            "-q",
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (_STUDIES.parent, _STUDIES)))},
    )


def finish(process: subprocess.Popen, seconds: float = 3000.0) -> None:
    """Wait for success. Raises RuntimeError with what the process said otherwise."""
    _, said = process.communicate(timeout=seconds)
    if process.returncode:
        raise RuntimeError(
            f"exit status {process.returncode}: {said.decode(errors='replace')[-500:]}"
        )


def kill_after(
    process: subprocess.Popen, out: Path, seconds: float, patience: float = 1200.0
) -> bool:
    """SIGKILL so long after the run has opened its folder; False when it was done before."""
    limit = monotonic() + patience
    while (
        not (out / "checkpoints" / "job.json").exists()
        and process.poll() is None
        and monotonic() < limit
    ):
        sleep(0.01)
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
    process.communicate()
    return process.returncode == -signal.SIGKILL


def outcome(out: Path) -> dict[str, Any]:
    """All results of a run that don't depend on how long it took: numbers and arrays, bit for
    bit."""
    return {
        "result": _timeless(json.loads((out / "result.json").read_text(encoding="utf-8"))),
        "kit": json.loads((out / "kit.json").read_text(encoding="utf-8")),
        "states": {
            name: array.tobytes() for name, array in load_arrays(out / "states.npz").items()
        },
    }


def steps_kept(out: Path) -> int:
    """Accepted steps in the checkpoints, all of which must be readable."""
    return sum(
        int(load_arrays(path)["sqp/numbers"][1])
        for path in sorted((out / "checkpoints").glob("*.npz"))
    )


def killed_and_resumed(
    designs: Path, out: Path, delays: Sequence[float], effort: str = "normal"
) -> tuple[int, list[int]]:
    """Kill the run after each of these delays, resuming in between, then let it finish.

    Returns how many kills hit a running process, and the steps in the checkpoints after each.
    """
    hits, kept = 0, []
    for delay in delays:
        if not kill_after(start(designs, out, effort), out, delay):
            break
        hits += 1
        kept.append(steps_kept(out))
    finish(start(designs, out, effort))
    return hits, kept


def random_delays(seed: int, longest: float, count: int) -> np.ndarray:
    """(count,) seconds."""
    return np.random.default_rng([seed, 3]).uniform(0, longest, count)


def _timeless(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _timeless(item) for key, item in value.items() if key not in _TIMES}
    return [_timeless(item) for item in value] if isinstance(value, list) else value

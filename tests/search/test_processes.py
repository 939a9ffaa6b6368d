"""An optimisation's result is the same to the last bit, however many processes solve its designs,
and when."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from itertools import count
from time import sleep

import pytest
import scipy.linalg  # noqa: F401  # whose BLAS has to be there before its threads are counted
from support.grids import coarse_grid
from threadpoolctl import threadpool_info, threadpool_limits

from kop_exudyn.io.datasets import load_designs
from kop_exudyn.search.dataset import Dataset
from kop_exudyn.search.events import UNRELAXED
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.settings import StageSettings
from kop_exudyn.search.stages import Stages
from kop_exudyn.search.weights import Weights
from kop_exudyn.structures.base import design_from_dict


def tuned(designs, jobs: int) -> tuple:
    """Parameters and objectives of a few steps over the parts, which lead far from the direct
    projection."""
    values: list[float] = []
    with DesignPool(designs, jobs) as pool:
        pool.prepare()
        stages = Stages(
            Dataset.of_pool(pool, Weights.suiting(designs)),
            {"linear": 6, "angular": 3},
            StageSettings(assigned_steps=5),
            None,
            lambda event: values.append(event.record.value),
        )
        result = stages.assigned(stages.direct(), UNRELAXED)
    assert len(values) >= 3  # some steps were taken: there is something to compare
    return values, [evaluation.q.tobytes() for evaluation in result.designs]


@pytest.mark.parametrize("folder", ["small", "grids"])
def test_results_depend_on_no_process(repository, folder):
    if folder == "grids":
        names = ("01_dome", "03_enneper", "05_free_form")
        designs = [design_from_dict(coarse_grid(repository, name)) for name in names]
    else:
        designs = load_designs(repository / "models" / folder)
    alone = tuned(designs, 1)
    for jobs in (2, 3):
        assert tuned(designs, jobs) == alone, jobs


def test_one_thread_for_the_blas_while_designs_are_solved(repository):
    """Its sums would depend on how many cores there are."""

    def threads() -> dict[str, int]:
        """Of the libraries that have threads: other packages bring one without."""
        return {
            library["filepath"]: library["num_threads"]
            for library in threadpool_info()
            if library["user_api"] == "blas" and library.get("threading_layer") != "disabled"
        }

    pool = DesignPool(load_designs(repository / "models" / "small", 1))
    with threadpool_limits(2, user_api="blas"):
        before = threads()
        assert before and set(before.values()) == {2}
        with pool:
            assert set(threads().values()) == {1}
        # others may have been loaded meanwhile
        assert {library: threads()[library] for library in before} == before


BUSY = """
import os, sys, time
from pathlib import Path
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.search.pool import DesignPool
from kop_exudyn.search.weights import Weights

def large(objective, out):
    Path(out, str(os.getpid())).touch()
    while Path(out, "wait").exists():
        time.sleep(0.05)
    return bytes(10_000_000)  # more than a pipe holds

designs = load_designs(sys.argv[1])[:2]
with DesignPool(designs, 2) as pool:
    pool.prepare()
    pool.map(large, Weights.suiting(designs), {0: (sys.argv[2],), 1: (sys.argv[2],)})
"""


@pytest.mark.skipif(os.name != "posix", reason="a killed process has no sign there")
def test_workers_end_with_their_parent(repository, tmp_path):
    """Killed while they had results for it, it left them behind for ever."""

    def alive(pid: int) -> bool:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
        return True

    def wait_for(there) -> None:
        for turn in count():
            if there():
                return
            assert turn < 1200  # of 0.1 s: a busy machine may take long
            sleep(0.1)

    out = tmp_path / "out"
    out.mkdir()
    (out / "wait").touch()
    command = [sys.executable, "-c", BUSY, str(repository / "models" / "small"), str(out)]
    parent = subprocess.Popen(command)
    wait_for(lambda: parent.poll() is not None or len(list(out.iterdir())) == 3)
    workers = [int(file.name) for file in out.iterdir() if file.name != "wait"]
    try:
        assert len(workers) == 2 and all(map(alive, workers))
        parent.send_signal(signal.SIGKILL)
        parent.wait()
        (out / "wait").unlink()
        wait_for(lambda: not any(map(alive, workers)))
    finally:
        for pid in filter(alive, workers):
            os.kill(pid, signal.SIGKILL)

"""Kernels on disk that were compiled with an older version of what they call."""

import os
import subprocess
import sys
import time

import pytest

from kop_exudyn.rods.kernel_cache import drop_stale_kernels

CALLED = "import numba as nb\n\n\n@nb.njit(cache=True)\ndef called(x):\n    return {} * x\n"
CALLER = (
    "import numba as nb\nfrom called import called\n\n\n"
    "@nb.njit(cache=True)\ndef caller(x):\n    return called(x) + 1.0\n"
)


@pytest.fixture
def package(tmp_path):
    (tmp_path / "called.py").write_text(CALLED.format(2.0))
    (tmp_path / "caller.py").write_text(CALLER)
    (tmp_path / "other.py").write_text("print('no kernel')\n")
    return tmp_path


def result(package) -> float:
    done = subprocess.run(
        [sys.executable, "-c", "from caller import caller; print(caller(3.0))"],
        cwd=package,
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTHONPATH": str(package)},
    )
    return float(done.stdout)


def test_a_change_of_the_called_function_arrives(package):
    assert result(package) == 7.0 and len(list((package / "__pycache__").glob("*.nb[ic]"))) >= 2
    assert drop_stale_kernels(package) == 0  # fresh
    time.sleep(0.05)
    (package / "called.py").write_text(CALLED.format(5.0))
    assert result(package) == 7.0  # numba's own check doesn't see it
    assert drop_stale_kernels(package) > 0
    assert result(package) == 16.0
    assert drop_stale_kernels(package) == 0


def test_files_without_kernels_and_times_to_come(package):
    assert result(package) == 7.0
    later = time.time() + 3600
    os.utime(package / "other.py", (later, later))
    assert drop_stale_kernels(package) == 0
    # a clock that was wrong: dropped once more, nothing worse
    os.utime(package / "called.py", (later, later))
    assert drop_stale_kernels(package) > 0
    assert result(package) == 7.0

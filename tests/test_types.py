"""The package's annotations hold: users' type checkers read them (py.typed)."""

import importlib.resources
import subprocess
import sys


def test_mypy_finds_no_errors(repository):
    """With the configuration in setup.cfg; its cache is the usual one, so that a second run takes
    seconds."""
    done = subprocess.run(
        [sys.executable, "-m", "mypy"], cwd=repository, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_says_that_it_is_typed():
    assert importlib.resources.files("kop_exudyn").joinpath("py.typed").is_file()

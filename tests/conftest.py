"""Fixtures for all tests."""

from __future__ import annotations

import json
import logging
from functools import partial
from pathlib import Path

import hypothesis
import numpy as np
import pytest

from kop_exudyn.compiled.library import OFF, library
from kop_exudyn.fabrication.pieces import parts_list
from kop_exudyn.kit.cluster import cluster
from kop_exudyn.report import kit_report
from kop_exudyn.report.kit_picture import kit_pictures
from kop_exudyn.structures.base import design_from_dict
from kop_exudyn.structures.stacking import stacked_groups, stacked_parameters

# how long an example takes says how busy the machine is
hypothesis.settings.register_profile(
    "unhurried", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("unhurried")

REPOSITORY = Path(__file__).resolve().parents[1]

# Files of tests that take longest by themselves come first, so that several processes, each of
# which takes a whole file at a time, end together.
LONG = (
    "stress/test_kill_resume.py",
    "studies/test_quick_studies.py",
    "stress/test_optimisation_stress.py",
    "studies/test_quick_kits_of_classes.py",
    "docs/test_tutorial.py",
    "docs/test_notebooks.py",
    "studies/test_stress.py",
    "search/test_further_rounds.py",
    "report/test_viewer.py",
    "studies/test_quick_stage_studies.py",
    "test_types.py",
    "studies/test_benchmark.py",
    "analysis/test_engines.py",
    "docs/test_site.py",
)


def pytest_configure(config):
    if hasattr(config.option, "loadscopereorder"):  # of pytest-xdist: most tests first
        config.option.loadscopereorder = False


def pytest_collection_modifyitems(items):
    def place(item):
        name = "/".join(item.path.parts[-2:])
        return LONG.index(name) if name in LONG else len(LONG)

    items.sort(key=place)


@pytest.fixture(autouse=True)
def nothing_is_silenced():
    """Commands set what is logged, those of fixtures for whole modules too: every test begins with
    loggers that let everything pass."""
    logger = logging.getLogger("kop_exudyn")
    logger.setLevel(logging.NOTSET)
    logger.propagate, logger.disabled = True, False


@pytest.fixture(autouse=True, scope="session")
def small_pictures():
    """Reports draw a picture of every design; those of tests are small, since drawing a large one
    takes longer than finding a toy's kit. Large ones are drawn by tests/report/test_kit_picture."""
    with pytest.MonkeyPatch.context() as patch:
        small = partial(kit_pictures, width=160, height=115)
        patch.setattr(kit_report, "kit_pictures", small)
        yield


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the repository, for tests of its models, README and scripts."""
    return REPOSITORY


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Released data files that lie beside the repository and aren't part of it; the test is skipped
    without them."""
    folder = REPOSITORY.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("needs the released data files beside the repository")
    return folder


@pytest.fixture(params=["compiled", "numpy"], scope="module")
def kernels(request):
    """Compiled kernels, then NumPy in their place, for everything that is made meanwhile."""
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "numpy":
            patch.setenv(OFF, "0")
        library.cache_clear()
        if request.param == "compiled" and library() is None:
            pytest.skip("there are no compiled kernels")
        yield request.param
    library.cache_clear()


@pytest.fixture
def c_shell_data() -> dict:
    """The content of a valid C-shell design file: a uniform grid of 3 x 3 crossing straight
    curves."""
    lines = [[[-0.2, y], [2.2, y]] for y in (0.0, 1.0, 2.0)] + [
        [[x, -0.2], [x, 2.2]] for x in (0.0, 1.0, 2.0)
    ]
    return {
        "format": "kop_exudyn/design",
        "version": 1,
        "class": "c_shell",
        "name": "grid",
        "material": {"young": 2100.0, "poisson": 0.35},
        "section": {"type": "rectangle", "width": 0.02, "height": 0.01},
        "curves": [{"type": "polyline", "points": points} for points in lines],
        "crossings": "find",
        "free_ends": False,
        "rod_offset": 0.0,
        "opening": {"angle": 0.6, "side": "up"},
        "elements_per_piece": 2,
    }


@pytest.fixture
def write_json_file(tmp_path):
    """A function (name, data) that writes a JSON file for a test and gives its path."""

    def write(name: str, data) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(data), encoding="utf-8")
        return path

    return write


# Two small C-shells and the kit that their elements are clustered to: what files for workshop and
# desk are tested with.


def shell(name: str, stretch: float):
    """Three curves across two, with corners everywhere and one length at each curve's ends; units
    are metres."""
    along = [[[-1.2, y - 0.1], [0, y], [1.2, y - 0.1 * stretch]] for y in (-0.5, 0.4 * stretch)]
    across = [
        [[x, -0.9], [x * 1.1 + 0.02, 0], [x, 0.9 * stretch]] for x in (-0.8, 0.05, 0.7 * stretch)
    ]
    # pieces then fit a sheet of 1000 x 600 mm
    along, across = ((0.85 * np.array(curves)).tolist() for curves in (along, across))
    return design_from_dict(
        {
            "class": "c_shell",
            "name": name,
            "opening": {"angle": 0.2},
            "crossings": "find",
            "free_ends": False,
            "material": {"young": 2.1e9, "poisson": 0.35, "elastic_limit": 4e7},
            "section": {"type": "rectangle", "width": 0.03, "height": 0.004},
            "curves": [
                {"type": "spline", "points": points, "closed": False} for points in along + across
            ],
        }
    )


@pytest.fixture(scope="session")
def shells():
    return [shell("first", 1.0), shell("second", 1.1)]


@pytest.fixture(scope="session")
def clustering(shells):
    """Kit and assignment of all elements of both shells."""
    return cluster(
        stacked_groups(shells), stacked_parameters(shells), {"linear": 3, "angular": 2}, seed=1
    )


@pytest.fixture(scope="session")
def parts(shells, clustering):
    return parts_list(clustering.kit, clustering.assignment, shells)

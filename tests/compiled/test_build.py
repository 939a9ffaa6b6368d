"""The compiled library: made, found again, made anew after changes, and done without."""

from __future__ import annotations

import ctypes
import logging
import shutil
import sys

import numpy as np
import pytest

from kop_exudyn.compiled import build, library
from kop_exudyn.equilibrium.newton import solve
from kop_exudyn.equilibrium.system import System
from kop_exudyn.scene.builder import SceneBuilder

needs_compiler = pytest.mark.skipif(build.compiler() is None, reason="there is no compiler")


@pytest.fixture
def nothing_built(tmp_path, monkeypatch):
    """Folders without a library, and sources of our own: one quick file."""
    sources = tmp_path / "sources"
    sources.mkdir()
    (sources / "one.c").write_text("int number(void) { return 1; }\n")
    monkeypatch.setattr(build, "SOURCES", sources)
    monkeypatch.setattr(library, "BUILT", tmp_path / "built")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv(library.OFF, raising=False)
    for cached in (build.file_name, library.library):
        cached.cache_clear()
    yield tmp_path
    for cached in (build.file_name, library.library):
        cached.cache_clear()


@needs_compiler
def test_a_library_belongs_to_its_sources(nothing_built):
    first = build.build(nothing_built / "here")
    assert first.name == build.file_name() and ctypes.CDLL(str(first)).number() == 1
    (build.SOURCES / "one.c").write_text("int number(void) { return 2; }\n")
    build.file_name.cache_clear()
    second = build.build(nothing_built / "here")
    assert second != first and ctypes.CDLL(str(second)).number() == 2
    assert sorted(p.name for p in (nothing_built / "here").iterdir()) == sorted(
        [first.name, second.name]
    )


@pytest.mark.parametrize("command", ["false", "no-such-compiler"])
def test_without_a_compiler_that_works_there_is_no_library(nothing_built, monkeypatch, command):
    monkeypatch.setenv("CC", command)
    with pytest.raises(build.BuildError):
        build.build(nothing_built / "here")
    assert not any((nothing_built / "here").glob("*"))


def test_what_is_missing_is_said_once_and_numpy_takes_over(nothing_built, monkeypatch, caplog):
    monkeypatch.setenv("CC", "false")
    with caplog.at_level(logging.WARNING):
        assert library.library() is None and library.library() is None
    assert [("once" in r.message, "NumPy" in r.message) for r in caplog.records] == [
        (True, False),
        (False, True),
    ]


def test_a_file_that_is_no_library_is_said_and_left_alone(nothing_built, caplog):
    folder = nothing_built / "built"
    folder.mkdir()
    (folder / build.file_name()).write_bytes(b"not a library")
    assert library.library() is None
    assert "can't be loaded" in caplog.text


@needs_compiler
@pytest.mark.skipif(sys.platform == "win32", reason="folders can't be closed to their owner")
def test_a_package_that_can_not_be_written_is_built_in_the_users_folder(nothing_built, monkeypatch):
    (nothing_built / "file").write_text("")
    monkeypatch.setattr(library, "BUILT", nothing_built / "file" / "built")
    monkeypatch.setattr(build, "SOURCES", nothing_built / "real")
    shutil.copytree(build.__file__.replace("build.py", "sources"), nothing_built / "real")
    build.file_name.cache_clear()
    assert library.library() is not None
    assert [p.name for p in (nothing_built / "cache" / "kop_exudyn").iterdir()] == [
        build.file_name()
    ]


def test_addresses_are_of_contiguous_arrays_of_the_right_kind():
    array = np.zeros((4, 4))
    fixed = array.copy()
    fixed.flags.writeable = False
    for right in (array, array[1:], array[:0], np.zeros((3, 0)), fixed):
        assert library.address(right) == right.ctypes.data
    for wrong in (array.T[1:], array[:, :2], array.astype(np.float32), array.astype(int)):
        with pytest.raises(TypeError, match="contiguous"):
            library.address(wrong)


def test_both_forms_lead_to_the_same_state(monkeypatch):
    """A clamped rod under its own weight, bent far."""
    states = []
    for value in ("1", "0"):
        monkeypatch.setenv(library.OFF, value)
        library.library.cache_clear()
        builder = SceneBuilder()
        bodies = builder.bodies(np.linspace([0.0, 0, 0], [1, 0, 0], 9))
        stiffness = np.array([1e4, 1e3, 1e3, 1.0, 1.0, 1.0])
        nodes = builder.nodes(bodies).tolist()
        builder.rod(nodes, stiffness, length=1.0, weight=[0, 0.3, -4.0])
        builder.pin(0)
        system = System(builder.build())
        found = solve(system, np.zeros(0))
        states.append((found.state.positions, found.elastic_energy, system.factorisation.pivots))
    library.library.cache_clear()
    (x, energy, pivots), (y, other, others) = states
    assert np.abs(x - y).max() < 1e-9 and np.ptp(x[:, 2]) > 0.3
    assert energy == pytest.approx(other, rel=1e-9)
    assert np.prod(pivots / others.mean()) == pytest.approx(
        np.prod(others / others.mean()), rel=1e-6
    )

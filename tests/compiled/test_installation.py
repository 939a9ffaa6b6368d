"""What is needed to install: a compiler, unless there is one."""

from __future__ import annotations

import importlib.util

import pytest


@pytest.fixture
def backend(repository):
    file = repository / "build_system" / "backend.py"
    spec = importlib.util.spec_from_file_location("backend", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_compiler_is_asked_for_where_there_is_none(backend, repository, monkeypatch, tmp_path):
    monkeypatch.chdir(repository)
    monkeypatch.setenv("CC", "any")
    assert backend._compiler() == []
    monkeypatch.delenv("CC")
    monkeypatch.setenv("PATH", str(tmp_path))
    (needed,) = backend._compiler() or [""]
    there = importlib.util.find_spec("ziglang") is not None
    assert needed.startswith("ziglang>=") is not there
    assert callable(backend.build_wheel) and callable(backend.prepare_metadata_for_build_editable)

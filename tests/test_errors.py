"""Errors keep what they are where a file's name is filled in, and between processes."""

from __future__ import annotations

import pickle

import pytest

from kop_exudyn.errors import InputError, OccupiedError
from kop_exudyn.geometry.centring import TooFarError


@pytest.mark.parametrize("kind", [InputError, OccupiedError, TooFarError])
@pytest.mark.parametrize("how", [pickle.dumps, None], ids=["pickled", "at"])
def test_kind_and_fields_stay(kind, how):
    error = kind("is wrong", field="points[3]", value=[1.0, 2.0])
    again = pickle.loads(how(error)) if how else error.at("file.json")
    assert type(again) is kind
    assert (again.message, again.field, again.value) == ("is wrong", "points[3]", [1.0, 2.0])
    assert again.source == (None if how else "file.json")

"""Kits survive the way through a file."""

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.io.kits import load_kit, save_kit
from kop_exudyn.kit.parts import Kit


def test_round_trip_is_exact(tmp_path):
    generator = np.random.default_rng(0)
    kit = Kit({"linear": generator.random((12, 2)), "angular": generator.random(5)})
    read = load_kit(save_kit(tmp_path / "kit.json", kit))
    assert read.sizes == kit.sizes
    np.testing.assert_array_equal(read.vector, kit.vector)


@pytest.mark.parametrize(
    "parts, message",
    [
        ({}, "kit.json: parts"),
        ({"linear": []}, r"parts.linear = \[\]: must have at least 1"),
        ({"linear": [[1, "2"]]}, r"parts.linear\[0\]\[1\] = '2': must be a number"),
        ({"linear": [[1, 2], [1]]}, "kit.linear"),
        ({"linear": [[-1, 2]]}, r"kit.linear\[0\] = \[-1.0, 2.0\]: outside"),
        ({"cubic": [1]}, "unknown kind of parts"),
    ],
)
def test_mistakes(write_json_file, parts, message):
    path = write_json_file("kit.json", {"format": "kop_exudyn/kit", "version": 1, "parts": parts})
    with pytest.raises(InputError, match=message) as caught:
        load_kit(path)
    assert str(caught.value.source) == str(path)


def test_is_not_overwritten_by_chance(tmp_path):
    path = save_kit(tmp_path / "kit.json", Kit({"angular": [1.0]}))
    with pytest.raises(InputError, match="exists already"):
        save_kit(path, Kit({"angular": [2.0]}))
    assert load_kit(path).vector.tolist() == [1.0]

"""Result files keep the names that other programs rely on."""

import json

import numpy as np
import pytest

from kop_exudyn.equilibrium.equilibria import Equilibrium
from kop_exudyn.errors import InputError
from kop_exudyn.files.arrays import load_arrays
from kop_exudyn.io.results import load_result, load_states, save_result, save_states
from kop_exudyn.scene.state import State

SOLVED = {
    "fit": {"max_percent": 1.0, "mean_percent": 0.5},
    "elastic_energy": 2.0,
    "energy_ratio": 1.1,
    "stable": True,
    "exudyn": {
        "version": "1.13",
        "newton_steps": 1,
        "residual": 1e-12,
        "moved": 1e-12,
        "wall_s": 0.1,
    },
}
RESULT = {
    "designs": [
        {
            "name": "a",
            "elements": 9,
            "direct": {"failed": "buckles"},
            "unrelaxed": SOLVED,
            "relaxed": SOLVED,
            "assigned": SOLVED,
        }
    ],
    "kit": {"linear": [[1.0, 2.0]], "angular": [0.1]},
    "assignment": [{"kind": "linear", "part": [0, 0], "variant": [1, 0]}],
    "steps": {"relaxed": 10, "assigned": 5},
    "equilibria": 100,
    "newton_iterations": 400,
    "wall_s": 12.5,
    "peak_memory_mb": 300.0,
    "settings": {"seed": 0},
}


def test_names_in_the_file(tmp_path):
    data = json.loads(save_result(tmp_path / "result.json", RESULT).read_text())
    assert set(RESULT) <= set(data) and data["format"] == "kop_exudyn/result"
    assert {key: data[key] for key in RESULT} == RESULT
    assert load_result(tmp_path / "result.json") == data


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda r: r.pop("equilibria"), "equilibria: is missing"),
        (lambda r: r["designs"][0].pop("assigned"), r"designs\[0\].assigned: is missing"),
        (
            lambda r: r["designs"][0]["assigned"].pop("exudyn"),
            r"designs\[0\].assigned.exudyn: is missing",
        ),
        (
            lambda r: r["designs"][0]["direct"].update(stable=False),
            r"designs\[0\].direct.stable: unknown field",
        ),
        (lambda r: r.update(wall_s=float("nan")), "wall_s: must be a number"),
    ],
)
def test_an_incomplete_result_is_not_written(tmp_path, change, message):
    result = json.loads(json.dumps(RESULT))
    change(result)
    with pytest.raises(ValueError, match=message):
        save_result(tmp_path / "result.json", result)
    assert not (tmp_path / "result.json").exists()


def test_other_formats_are_told_apart(write_json_file):
    with pytest.raises(InputError, match="not a result file"):
        load_result(
            write_json_file("kit.json", {"format": "kop_exudyn/kit", "version": 1, "parts": {}})
        )


def test_states_round_trip(tmp_path):
    generator = np.random.default_rng(1)
    state = State(generator.random((3, 3)), generator.random((3, 3, 3)), generator.random(2))
    equilibrium = Equilibrium(
        state, generator.random(4), 0.5, 0.25, generator.random((2, 6)), 1.0, 1.0, 3, 1e-12, 0, 0.1
    )
    found = load_states(
        save_states(tmp_path / "states.npz", {("a shape", "assigned", "deployed"): equilibrium})
    )
    arrays = found["a shape", "assigned", "deployed"]
    assert sorted(arrays) == ["angles", "parameters", "positions", "rotations", "torque"]
    for name in ("angles", "positions", "rotations"):
        np.testing.assert_array_equal(arrays[name], getattr(state, name))
    np.testing.assert_array_equal(arrays["parameters"], equilibrium.q)
    assert arrays["torque"] == 0.25


def test_pickled_arrays_are_refused(tmp_path):
    path = tmp_path / "states.npz"
    np.savez(path, a=np.array([{"a": 1}], dtype=object))
    with pytest.raises(InputError, match="not a readable file of arrays"):
        load_arrays(path)


def test_an_archive_that_unpacks_to_too_much(tmp_path):
    path = tmp_path / "bomb.npz"
    np.savez_compressed(path, a=np.zeros(10**6))
    assert path.stat().st_size < 50_000
    with pytest.raises(InputError, match="unpacks to more than"):
        load_arrays(path, limit=10**6)

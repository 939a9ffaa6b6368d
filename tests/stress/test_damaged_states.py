"""Checkpoints and files of states that are damaged: refused, or still right; never a crash.

Twenty thousand of them, which take a minute, were read when the checks were written; here are a
few.
"""

from __future__ import annotations

import numpy as np
import pytest

from kop_exudyn.compiled.library import library
from kop_exudyn.equilibrium.system import System
from kop_exudyn.errors import InputError
from kop_exudyn.files.arrays import numbers_of, sealed, unsealed
from kop_exudyn.io.checkpoint import CheckpointStore, Job
from kop_exudyn.rods.rotations import compose_increments, exp_so3, log_so3
from kop_exudyn.scene.state import State
from lib.stress.arch import arches
from lib.stress.damaged_states import DamagedStates, damaged, same


def test_damaged_sets(tmp_path):
    findings = DamagedStates(tmp_path).run(range(1200))
    assert findings.wrong == []
    assert findings.count == 1200
    for what in ("front", "checkpoint", "state"):
        assert findings.counts[f"{what}: refused"] > 120, findings.counts
    # what only moves numbers a little is solved to the same equilibrium
    assert findings.counts["state: an equilibrium"] > 4


def test_what_is_let_through_is_noticed(tmp_path, monkeypatch):
    """A seal that is not looked at lets damage pass for good."""
    monkeypatch.setattr("lib.stress.damaged_states.unsealed", lambda arrays: arrays)
    findings = DamagedStates(tmp_path).run(range(0, 60, 3))
    assert any("passed for good" in line for line in findings.wrong)


def test_seals():
    arrays = {"a": np.arange(3.0), "b": np.array("text")}
    assert same(unsealed(sealed(arrays)), arrays)
    rng = np.random.default_rng(0)
    for _ in range(50):
        changed = damaged(sealed(arrays), rng)
        if not same(changed, sealed(arrays)):
            with pytest.raises(InputError, match="isn't what was written"):
                unsealed(changed)
    assert same(unsealed(arrays, needed=False), arrays)


def test_checkpoints_are_sealed(tmp_path):
    store = CheckpointStore.open(tmp_path / "c", Job.of({"a": 1}, []))
    store.save("one", {"x": np.ones(3)})
    assert same(store.load("one"), {"x": np.ones(3)})


STATE = {"positions": np.zeros((2, 3)), "rotations": np.tile(np.eye(3), (2, 1, 1))}
STATE["angles"] = np.zeros(1)


@pytest.mark.parametrize(
    "name, value",
    [
        ("rotations", np.ones((2, 1, 1))),
        ("rotations", np.tile(np.eye(3), (3, 1, 1))),
        ("rotations", np.tile(np.diag([1.0, 1, -1]), (2, 1, 1))),
        ("rotations", np.tile(2 * np.eye(3), (2, 1, 1))),
        ("positions", np.zeros((2, 3), complex)),
        ("positions", np.full((2, 3), np.nan)),
        ("angles", np.array(["a"])),
        ("angles", np.zeros((1, 1))),
        ("angles", np.zeros(0)),
    ],
)
def test_states_are_checked_array_by_array(name, value):
    assert State.of(STATE, 2, 1).positions.shape == (2, 3)
    with pytest.raises(InputError, match=name):
        State.of(STATE | {name: value}, 2, 1)
    with pytest.raises(InputError, match="is missing"):
        State.of({k: v for k, v in STATE.items() if k != name}, 2, 1)
    assert numbers_of({"a": np.array([np.inf])}, "a", (None,), finite=False)[0] == np.inf


def test_compiled_code_refuses_what_does_not_fit():
    design = arches()[0]
    scene = design.scene(design.fitted_role.name)
    system, good = System(scene), scene.initial
    system.set_parameters(design.parameters)
    system.assemble(good)
    bad = [
        State(good.positions, np.ones((len(good.rotations), 1, 1)), good.angles),
        State(good.positions[:-1], good.rotations, good.angles),
        State(good.positions, good.rotations, np.zeros(len(good.angles) + 1)),
        State(good.positions.ravel(), good.rotations, good.angles),
    ]
    for state in bad:
        with pytest.raises((ValueError, IndexError)):
            system.assemble(state)
    if library() is None:
        return
    system.factorise(1.0)
    for rhs in (np.ones(system.n_unknowns + 1), np.ones(system.n_unknowns - 1)):
        with pytest.raises(ValueError, match="right-hand side"):
            system.solve(rhs)


@pytest.mark.parametrize("shape", [(4, 1, 1), (9, 1), (3, 3), (4, 2)])
def test_rotations_of_another_shape(shape):
    with pytest.raises(ValueError, match="expected"):
        compose_increments(np.ones(shape), np.ones((4, 3)))
    if shape[-1] != 3:
        with pytest.raises(ValueError, match="expected"):
            exp_so3(np.ones(shape))
    if shape[-2:] != (3, 3):
        with pytest.raises(ValueError, match="expected"):
            log_so3(np.ones(shape))

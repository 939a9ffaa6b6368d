"""Designs of all classes simulated by Exudyn, against the fast solver's states."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from support.grids import coarse_grid
from support.shells import shell_data
from support.umbrellas import make

import kop_exudyn as kop
from kop_exudyn.cli import main
from kop_exudyn.equilibrium import newton
from kop_exudyn.errors import InputError
from kop_exudyn.structures.base import design_from_dict

CLASSES = ["c_shell", "grid", "umbrella"]
_SAME = 1e-6  # of the size: joints of the two engines' states


def content(repository, name: str) -> dict:
    """The content of a small design's file, with few elements."""
    if name == "umbrella":
        return make("bowl", 1) | {"plate_model": "rigid", "arm_elements": 1}
    data = shell_data("shell") if name == "c_shell" else coarse_grid(repository)
    return data | {"elements_per_piece": 1}


@pytest.mark.parametrize("name", CLASSES)
def test_exudyn_deploys_a_design_of_every_class(repository, name, monkeypatch):
    """To the fast solver's state, from the same start, without asking the fast solver."""
    data = content(repository, name)
    fast = kop.simulate(design_from_dict(data))
    design = design_from_dict(data)
    design.target  # the smooth design of a C-shell is simulated for its target

    def never(*arguments, **options):
        raise AssertionError("the fast solver was asked")

    monkeypatch.setattr(newton._Run, "solve", never)
    found = kop.simulate(design, engine="exudyn")
    for role in design.roles:
        a, b = found.equilibria[role.name], fast.equilibria[role.name]
        apart = np.abs(a.state.positions - b.state.positions).max()
        assert apart < _SAME * design.scene(role.name).size
        assert a.stable and a.elastic_energy == pytest.approx(b.elastic_energy, rel=1e-8, abs=1e-12)
        assert found.confirmations[role.name].moved < _SAME
    assert found.to_dict()["engine"] == "exudyn" and fast.to_dict()["engine"] == "fast"
    assert found.to_dict().keys() == fast.to_dict().keys()
    assert found.newton_iterations > 0


def test_exudyn_finds_the_state_under_loads(repository):
    design = design_from_dict(content(repository, "grid"))
    loads = replace(
        design.loads,
        gravity=np.array([0.0, 0.0, -20.0]),
        joints=np.array([10]),
        forces=np.array([[0.0, 0.0, -0.5]]),
    )
    fast, found = (kop.simulate(design, loads, engine=name).loaded for name in ("fast", "exudyn"))
    apart = np.abs(found.joints - fast.joints).max()
    assert apart < _SAME * design.target.size
    assert found.deflections.max() == pytest.approx(fast.deflections.max(), rel=1e-6)


def test_the_command(repository, capsys):
    file = str(repository / "models" / "small" / "01_sinh.json")
    assert main(["simulate", file, "--engine", "exudyn", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["engine"] == "exudyn" and found["stable"]
    assert found["newton_iterations"] > found["exudyn"]["newton_steps"] >= 1
    assert found["exudyn"]["gaps"]["opening"] < 1e-8


def test_unknown_engines_are_named(repository):
    design = design_from_dict(content(repository, "c_shell"))
    with pytest.raises(InputError, match="unknown engine"):
        kop.simulate(design, engine="abaqus")

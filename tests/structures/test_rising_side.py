"""C-shells whose target mesh lies on the other side of their plane than they rise to."""

import json
from pathlib import Path

import pytest

import kop_exudyn as kop
from kop_exudyn.analysis.input_check import check_designs
from kop_exudyn.exchange.polygons import write_mesh_obj

SMALL = Path(__file__).resolve().parents[2] / "models" / "small"


@pytest.fixture(scope="module")
def shells(tmp_path_factory):
    """A small shell with its own deployed surface as a mesh, and the same with its mirror image;
    by the sides that they rise to."""
    folder = tmp_path_factory.mktemp("sides")
    source = SMALL / "01_sinh.json"
    data = json.loads(source.read_text())
    target = kop.load_design(source).target
    write_mesh_obj(folder / "up.obj", target.vertices, target.faces)
    write_mesh_obj(folder / "down.obj", target.vertices * (1, 1, -1), target.faces)

    def shell(side: str | None, mesh: str):
        opening = {"angle": data["opening"]["angle"]} | ({} if side is None else {"side": side})
        own = data | {"opening": opening, "target": {"file": f"{mesh}.obj"}, "name": "shell"}
        path = folder / "shell.json"
        path.write_text(json.dumps(own))
        return kop.load_design(path)

    return shell


@pytest.mark.parametrize("side, mesh", [(None, "down"), ("up", "down"), ("down", "up")])
def test_the_other_side_is_proposed_and_fits(side, mesh, shells):
    (told,) = shells(side, mesh).cautions
    assert f'opening.side "{mesh}"' in told and f"rising {mesh} it would be right on it" in told
    assert shells(mesh, mesh).cautions == []


def test_no_target_or_one_that_suits_needs_no_word(shells):
    assert shells(None, "up").cautions == []
    assert kop.load_design(SMALL / "01_sinh.json").cautions == []


def test_simulating_says_so(shells, caplog):
    result = kop.simulate(shells(None, "down"))
    assert result.fit.max_percent > 1
    assert "rises up" in caplog.text and "kop import --side down" in caplog.text
    caplog.clear()
    other = kop.simulate(shells("down", "down"))
    assert other.fit.max_percent < 0.5 * result.fit.max_percent
    assert "rises" not in caplog.text


def test_checking_says_so_once(shells, caplog):
    """A warning of the simulation said it as well."""
    (check,) = check_designs([shells(None, "down")], {"linear": 2, "angular": 2}, fit=False)
    (told,) = check.cautions
    assert "rises up" in told
    assert "rises up" not in caplog.text

"""A finished run read back gives the result that was written."""

import json

import numpy as np
import pytest
from support.settings import ONE_STEP

from kop_exudyn.errors import InputError
from kop_exudyn.files.arrays import load_arrays, save_arrays, unsealed
from kop_exudyn.io.results import load_result, save_result, save_states
from kop_exudyn.io.saved_runs import load_run
from kop_exudyn.report.kit_drawings import final_states, histories, stage_rows, summary_rows
from kop_exudyn.search.result import STAGES
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings
from kop_exudyn.search.stage_results import Jump
from kop_exudyn.structures.fitting import TargetFitting


@pytest.fixture(scope="module")
def finished(shells, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    events = []
    result = optimize_kit(
        shells,
        {"linear": 3, "angular": 2},
        settings=JobSettings(jobs=1, baselines=False, stages=ONE_STEP),
        observer=events.append,
    )
    result.stages["direct"].jumps.append(Jump(shells[0].name, 0.5, 0.07))
    save_result(folder / "result.json", result.to_dict())
    save_states(folder / "states.npz", final_states(result))
    return result, folder


def test_what_was_written_is_read(finished, shells):
    result, folder = finished
    again = load_run(folder, shells)
    np.testing.assert_array_equal(again.kit.vector, result.kit.vector)
    for a, b in zip(again.stages["assigned"].designs, result.stages["assigned"].designs):
        np.testing.assert_array_equal(a.q, b.q)
        assert a.fit.max_percent == pytest.approx(b.fit.max_percent, rel=1e-6)
        for role in ("deployed", "rest"):
            scale = np.abs(b.equilibria["deployed"].stress).max(axis=0)
            assert (
                np.abs(a.equilibria[role].stress - b.equilibria[role].stress).max(axis=0)
                <= 1e-6 * scale
            ).all()
    assert again.to_dict()["designs"][0]["assigned"]["exudyn"]["moved"] < 1e-8


def test_all_stages_come_back(finished, shells, monkeypatch):
    """Nothing is deployed anew for them."""
    result, folder = finished
    for design in shells:
        monkeypatch.setattr(design, "deploy", None)
    again = load_run(folder, shells)
    assert list(again.stages) == [stage for stage in STAGES if stage in result.stages]
    assert list(again.stages) == ["direct", "relaxed", "assigned"]
    for stage, found in result.stages.items():
        for a, b in zip(again.stages[stage].designs, found.designs):
            np.testing.assert_array_equal(a.q, b.q)
            assert a.value == pytest.approx(b.value, rel=1e-9)
    for a, b in zip(again.references, result.references):
        assert a.energy == pytest.approx(b.energy, rel=1e-9)
        assert a.equilibria["deployed"].torque == pytest.approx(
            b.equilibria["deployed"].torque, rel=1e-6
        )


def test_snaps_belong_to_their_stages(finished, shells):
    result, folder = finished
    again = load_run(folder, shells)
    for stage, found in result.stages.items():
        assert [j.design for j in again.stages[stage].jumps] == [j.design for j in found.jumps]
    last = again.stages["direct"].jumps[-1]
    assert (last.design, last.fraction) == (shells[0].name, 0.5) and last.distance == pytest.approx(
        0.07
    )


def test_history_and_redeployed_designs_come_back(finished, shells, monkeypatch):
    """Nothing is deployed anew for them."""
    result, folder = finished
    for design in shells:
        monkeypatch.setattr(design, "deploy", None)
    again = load_run(folder, shells)
    assert again.events == result.events and {event.stage for event in again.events} == {
        "relaxed",
        "assigned",
    }
    assert histories(again) == histories(result)
    assert len(again.redeployed) == 2
    for n, (a, b) in enumerate(zip(again.redeployed, result.redeployed)):
        np.testing.assert_array_equal(a.q, b.q)
        assert again.redeployment(n)["same_state"] == result.redeployment(n)["same_state"]
        assert a.fit.max_percent == pytest.approx(b.fit.max_percent, rel=1e-6)


def test_designs_that_could_not_be_opened_are_told(finished, shells, tmp_path):
    result, folder = finished
    data = json.loads((folder / "result.json").read_text())
    data["designs"][1]["redeployed"] = {"failed": "buckled"}
    (tmp_path / "result.json").write_text(json.dumps(data))
    save_arrays(tmp_path / "states.npz", load_arrays(folder / "states.npz"))
    assert str(load_run(tmp_path, shells).redeployed[1]) == "buckled"
    data["history"][0]["value"] = []
    (tmp_path / "result.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match="result.json: history: isn't a history of steps"):
        load_run(tmp_path, shells)


def test_strength_is_in_every_stage(finished):
    result, folder = finished
    for entry in load_result(folder / "result.json")["designs"]:
        for stage in ("direct", "relaxed", "assigned"):
            assert set(entry[stage]["strength"]) == {"deployed", "rest"}
            for figures in entry[stage]["strength"].values():
                assert figures["utilisation"] == pytest.approx(figures["equivalent_stress"] / 4e7)
                assert 0 < figures["utilisation"] < 5
    headings, rows = summary_rows(result)
    largest = max(s["utilisation"] for s in result.summary("assigned", 0)["strength"].values())
    assert rows[0][headings.index("utilisation")] == largest


def test_results_tell_how_far_the_inputs_are_off_their_targets(finished, shells):
    result, folder = finished
    headings, rows = stage_rows(result)
    for n, entry in enumerate(load_result(folder / "result.json")["designs"]):
        joints = shells[n].deploy()["deployed"].state.positions[shells[n].joints]
        found = entry["input"]["fit"]["max_percent"]
        assert rows[n][headings.index("input, %")] == found
        assert entry["input"]["elastic_energy"] == result.references[n].energy
        assert found == pytest.approx(
            TargetFitting(shells[n].target).minimum_zone(joints).max_percent, rel=1e-4
        )


def test_folders_of_earlier_versions(finished, shells, tmp_path):
    """They have neither parameters nor input states: the last stage is there, the input is
    simulated again."""
    result, folder = finished
    old = {
        name: array
        for name, array in unsealed(load_arrays(folder / "states.npz")).items()
        if name.split("/")[1] != "input" and name.split("/")[3] not in ("parameters", "torque")
    }
    save_arrays(tmp_path / "states.npz", old)
    data = json.loads((folder / "result.json").read_text())
    for name in ("history", "jumps", "status"):
        del data[name]
    (tmp_path / "result.json").write_text(json.dumps(data))
    again = load_run(tmp_path, shells)
    assert list(again.stages) == ["assigned"] and again.events == []
    assert again.stages["assigned"].value == result.stages["assigned"].value
    assert again.references[0].energy == pytest.approx(result.references[0].energy, rel=1e-9)


def test_designs_are_found_by_name(finished, shells):
    assert [d.name for d in load_run(finished[1], shells[::-1]).designs] == ["first", "second"]
    for given in (shells[:1], [*shells, shells[0]]):
        with pytest.raises(InputError, match="not only once"):
            load_run(finished[1], given)


def test_changed_designs_are_noticed(finished, shells):
    from dataclasses import replace

    folder = finished[1]
    changed = [type(d)(d.name, d.network, replace(d.model, elements=3), d.opening) for d in shells]
    with pytest.raises(InputError, match="another version"):
        load_run(folder, changed)
    wider = [type(d)(d.name, d.network, d.model, 1.3 * d.opening) for d in shells]
    with pytest.raises(InputError, match="no equilibria of this design: its file has been changed"):
        load_run(folder, wider)
    # with another modulus the states are the same, and stresses were mixtures of both
    for field, factor, named in (("young", 4.0, "elastic_energy"), ("elastic_limit", 0.1, "util")):
        other = []
        for d in shells:
            material = replace(d.model.material, **{field: factor * (_of(d, field) or 1e7)})
            model = replace(d.model, material=material)
            other.append(type(d)(d.name, d.network, model, d.opening))
        with pytest.raises(InputError, match=f"changed since the run .*{named}"):
            load_run(folder, other)


def _of(design, field):
    return getattr(design.model.material, field)

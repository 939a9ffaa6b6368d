"""A finished run read back gives the result that was written."""
import numpy as np
import pytest

from kop_exudyn.analysis.kit_result import KitResult
from kop_exudyn.errors import InputError
from kop_exudyn.io.results import save_result, save_states
from kop_exudyn.io.saved_runs import load_run
from kop_exudyn.optimize.job import JobSettings, run_job
from kop_exudyn.optimize.stages import StageSettings


@pytest.fixture(scope="module")
def finished(shells, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    stages = StageSettings(schedule=(1e4,), relaxed_steps=1, assigned_steps=1, reassignments=0, path_steps=2)
    outcome = run_job(shells, {"linear": 3, "angular": 2}, JobSettings(jobs=1, baselines=False, stages=stages))
    result = KitResult(shells, outcome.references, outcome.stages)
    save_result(folder / "result.json", result.to_dict())
    save_states(folder / "states.npz", {
        (design.name, stage, role): eq.state for stage, found in result.stages.items()
        for design, outcome in zip(shells, found.designs) for role, eq in outcome.equilibria.items()})
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
            assert (np.abs(a.equilibria[role].stress - b.equilibria[role].stress).max(axis=0) <= 1e-6 * scale).all()
    assert again.to_dict()["designs"][0]["assigned"]["exudyn"]["moved"] < 1e-8


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
    with pytest.raises(InputError, match="no equilibria"):
        load_run(folder, wider)

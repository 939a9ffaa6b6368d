"""Sweeps: what is computed, what is kept, in which order, and where."""

from __future__ import annotations

import os
from pathlib import Path

import distributed
import numpy as np
import pytest
from support.dask_clusters import hurried, local_cluster

from kop_exudyn.errors import InputError, SimulationFailure
from lib.sweep import Task, digests, run_sweep
from lib.sweep_store import SweepStore


def square(x: float, scale: float = 1.0, note: Path | None = None) -> dict:
    if note is not None:
        with open(note, "a", encoding="utf-8") as file:
            file.write(f"{x:g}\n")
    return {"square": scale * x**2, "array": np.arange(3) * x, "process": os.getpid()}


def add(step: float, before: dict | None) -> dict:
    return {"sum": step + (before or {"sum": 100.0})["sum"]}


def start() -> dict:
    return {"sum": 1.0}


def fail(x: float) -> dict:
    raise SimulationFailure("buckled", where=f"design {x:g}")


def give_up(x: float) -> dict:
    raise ZeroDivisionError


def die_once(mark: Path) -> dict:
    if not mark.with_suffix(".was_here").exists():
        mark.with_suffix(".was_here").write_text("")
        os._exit(1)
    return {"alive": True}


def squares(note: Path | None = None, numbers=(1.0, 2.0, 3.0)) -> list[Task]:
    return [Task(f"square of {x:g}", square, {"x": x}, {"note": note}) for x in numbers]


CHAIN = [
    Task("first", start),
    Task("second", add, {"step": 2.0}, after="first"),
    Task("third", add, {"step": 3.0}, after="second"),
]


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_are_plain_and_in_the_tasks_order(tmp_path, jobs):
    found = run_sweep(squares() + CHAIN, SweepStore(tmp_path), jobs=jobs)
    assert list(found) == ["square of 1", "square of 2", "square of 3", "first", "second", "third"]
    assert [found[f"square of {x}"].value["square"] for x in (1, 2, 3)] == [1, 4, 9]
    assert found["square of 2"].value["array"] == [0, 2, 4]
    assert found["third"].value == {"sum": 6.0}
    assert (found["square of 1"].value["process"] == os.getpid()) == (jobs == 1)


def test_an_interrupted_sweep_goes_on_where_it_stopped(tmp_path):
    note = tmp_path / "calls"
    with pytest.raises(ZeroDivisionError):
        run_sweep(
            [*squares(note), Task("bad", give_up, {"x": 1.0}), *squares(note, [4.0])],
            SweepStore(tmp_path),
        )
    assert note.read_text().split() == ["1", "2", "3"]
    seen = []
    run_sweep(
        squares(note, [1.0, 2.0, 3.0, 4.0]),
        SweepStore(tmp_path),
        observer=lambda result, is_new: seen.append((result.name, is_new)),
    )
    assert note.read_text().split() == ["1", "2", "3", "4"]
    assert seen == [
        ("square of 1", False),
        ("square of 2", False),
        ("square of 3", False),
        ("square of 4", True),
    ]


def test_a_result_belongs_to_its_settings_and_to_all_that_came_before(tmp_path):
    file = tmp_path / "design.json"
    file.write_text("1")

    def digest(**changes) -> str:
        chain = [
            Task("first", square, {"x": 1.0} | changes),
            Task("last", add, {"step": 1.0}, after="first"),
        ]
        return digests(chain)["last"]

    assert digest() == digest()
    assert len({digest(), digest(x=2.0), digest(scale=2.0), digest(x=file)}) == 4
    old = digest(x=file)
    file.write_text("2")
    assert digest(x=file) != old
    options = [
        digests([Task("a", square, {"x": 1.0}, {"note": note})])["a"] for note in (None, file)
    ]
    assert options[0] == options[1]


def test_a_failed_simulation_is_a_result_and_the_next_one_is_told(tmp_path):
    found = run_sweep(
        [Task("broken", fail, {"x": 3.0}), Task("next", add, {"step": 1.0}, after="broken")],
        SweepStore(tmp_path),
    )
    assert "buckled" in found["broken"].failed and found["next"].failed is None
    assert found["next"].value == {"sum": 101.0}


def test_results_of_other_sweeps_are_taken_where_the_tasks_are_the_same(tmp_path):
    note = tmp_path / "calls"
    run_sweep(squares(note), SweepStore(tmp_path / "one"))
    run_sweep(squares(note), SweepStore(tmp_path / "two", also=[tmp_path / "one"]))
    assert len(note.read_text().split()) == 3 and not (tmp_path / "two").exists()


def test_cleared_stores_forget(tmp_path):
    store = SweepStore(tmp_path)
    run_sweep(squares(), store)
    store.clear()
    assert store.load("square of 1", digests(squares())["square of 1"]) is None


def test_damaged_results_are_named(tmp_path):
    store = SweepStore(tmp_path)
    run_sweep(squares(), store)
    next(tmp_path.glob("square_of_1-*.json")).write_text("{")
    with pytest.raises(InputError, match="not JSON"):
        run_sweep(squares(), store)


@pytest.mark.parametrize(
    "tasks, message",
    [
        ([Task("a", start), Task("a", start)], "same name"),
        ([Task("a", add, {"step": 1.0}, after="b")], "isn't before it"),
        ([Task("a", square, {"x": Path("missing.json")})], "can't be read"),
    ],
)
def test_impossible_tasks_are_refused(tmp_path, tasks, message):
    with pytest.raises(InputError, match=message):
        run_sweep(tasks, SweepStore(tmp_path))


def test_settings_must_be_plain(tmp_path):
    with pytest.raises(TypeError, match="plain data"):
        digests([Task("a", square, {"x": np.ones(2)})])


@pytest.mark.filterwarnings("ignore")
def test_a_dying_worker_costs_only_its_task(tmp_path):
    (tmp_path / "mark").write_text("")
    found = run_sweep(
        [*squares(), Task("dies", die_once, {"mark": tmp_path / "mark"})],
        SweepStore(tmp_path),
        jobs=2,
    )
    assert found["dies"].value == {"alive": True} and found["square of 3"].value["square"] == 9


@pytest.mark.filterwarnings("ignore")
def test_a_local_cluster_of_two_workers_gives_the_same(tmp_path):
    with local_cluster(2) as cluster:
        tasks = squares() + CHAIN + [Task("broken", fail, {"x": 3.0})]
        there = run_sweep(
            tasks, SweepStore(tmp_path / "cluster"), scheduler=cluster.scheduler_address
        )
    here = run_sweep(tasks, SweepStore(tmp_path / "here"))
    for name, result in here.items():
        assert {k: v for k, v in there[name].value.items() if k != "process"} == {
            k: v for k, v in result.value.items() if k != "process"
        }
    assert there["square of 1"].value["process"] != os.getpid()


@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_does_not_answer_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(distributed, "Client", hurried(distributed.Client))
    with pytest.raises(InputError, match="no Dask scheduler"):
        run_sweep(squares(), SweepStore(tmp_path), scheduler="tcp://127.0.0.1:9")

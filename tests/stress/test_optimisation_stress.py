"""Optimisation jobs that no user would ask for: they end in a kit or in a clean refusal, and never
worse than they began."""

from __future__ import annotations

import os
import signal
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from support.settings import FEW_ERRORS, QUICK

from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.kit.parts import Kit
from kop_exudyn.search import pool, request
from kop_exudyn.search.evaluation import Evaluation
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from lib.stress.arch import Arch, arches
from lib.stress.interruption import MemoryStore, fingerprint

SCHEDULE = (1e3, 1e5)


def run(designs, parts, kit=None, **stages):
    """The kit of a job with one start, unless `stages` ask for more."""
    own = {"schedule": SCHEDULE, "effort": "quick", "requirements": FEW_ERRORS} | stages
    settings = JobSettings(jobs=1, stages=StageSettings(**own))
    return optimize_kit(
        designs,
        {"linear": parts} if kit is None else None,
        kit=kit,
        settings=settings,
        store=MemoryStore(),
    )


def check(outcome, designs, given=False):
    """What holds of every job that ended: finite values, stable states, every element exactly its
    part.

    Only the parts of a given kit may be beyond the designs' own bounds.
    """
    for stage in outcome.stages.values():
        for evaluation in stage.designs:
            assert isinstance(evaluation, SimulationFailure) or np.isfinite(evaluation.value)
    assigned = outcome.stages["assigned"]
    if assigned.value is None:
        return
    assert all(eq.stable for e in assigned.designs for eq in e.equilibria.values())
    realised = assigned.assignment.matrix(assigned.kit) @ assigned.kit.vector
    np.testing.assert_array_equal(np.concatenate([e.q for e in assigned.designs]), realised)
    if given:
        return
    lower, upper = (
        np.concatenate([getattr(d, name) for d in designs]) for name in ("lower", "upper")
    )
    assert (realised >= lower - 1e-12).all() and (realised <= upper + 1e-12).all()


EVEN = np.full((5, 2), 0.12)


@pytest.mark.parametrize(
    "designs, parts",
    [
        ([Arch("even", EVEN, 0.96)], 1),
        ([Arch("even", EVEN, 0.96)], 2),  # fewer different elements than parts
        ([Arch("even", EVEN, 0.96), Arch("twin", EVEN, 0.96)], 5),
        (
            [
                Arch(
                    "mirrored",
                    [[0.1, 0.12], [0.12, 0.1], [0.1, 0.12], [0.1, 0.12], [0.12, 0.1]],
                    0.9,
                )
            ],
            3,
        ),
        (arches(), 10),  # every element its own part
    ],
)
def test_elements_that_repeat_and_parts_to_spare(designs, parts):
    """Nothing has to change: the objective stays that of the inputs, 0.02 a design, and can only
    fall by a trifle."""
    outcome = run(designs, parts)
    check(outcome, designs)
    assert outcome.stages["assigned"].value == pytest.approx(0.02 * len(designs), rel=1e-3)


def test_one_part_for_all():
    designs = arches()
    outcome = run(designs, 1, effort="normal")
    check(outcome, designs)
    assert len(outcome.stages["assigned"].kit["linear"]) == 1
    assert outcome.stages["assigned"].value < outcome.stages["direct"].value


@pytest.mark.parametrize("bounds", [(0.12, 0.12), (0.05, 0.09), (0.15, 0.2), (0.11, 0.13)])
def test_bounds_that_bind(bounds):
    designs = arches()
    outcome = run(designs, 2, bounds={"linear": bounds})
    check(outcome, designs)
    for stage in outcome.stages.values():
        assert (stage.kit["linear"] >= bounds[0] - 1e-12).all() and (
            stage.kit["linear"] <= bounds[1] + 1e-12
        ).all()


def test_designs_whose_own_bounds_leave_no_room():
    designs = [Arch("fixed", EVEN, 0.96, bounds=(0.12, 0.12))]
    outcome = run(designs, 1)
    check(outcome, designs)
    np.testing.assert_array_equal(outcome.stages["assigned"].designs[0].q, EVEN.ravel())


def test_bounds_without_room_for_any_part_are_refused():
    with pytest.raises(InputError, match="bounds"):
        run(arches(), 2, bounds={"linear": (0.2, 0.1)})


@pytest.mark.parametrize(
    "schedule", [(1e-6,), (1e9,), (1e-6, 1e9), (1e9, 1e-6), (1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9)]
)
def test_weights_of_the_clusters_over_fifteen_decades(schedule):
    designs = arches()
    outcome = run(designs, 2, schedule=schedule)
    check(outcome, designs)
    stages = outcome.stages
    assert (
        stages["assigned"].value <= stages["unrelaxed"].value * (1 + 1e-9) < stages["direct"].value
    )


def test_the_other_hessian():
    designs = arches()
    outcome = run(designs, 2, hessian="bfgs")
    check(outcome, designs)
    assert outcome.stages["assigned"].value < outcome.stages["direct"].value


@pytest.mark.parametrize(
    "part, built", [(0.1, True), (5.0, True), (1e-3, None), (1e6, False), (0.0, False)]
)
def test_kits_that_the_designs_are_not_made_for(part, built, caplog, monkeypatch):
    """Stretched, wound up, or impossible: each design has a state or says why not. Stretched a
    hundredfold (None), what the solver finds is kept only where Exudyn confirms it. (Of most of
    these nothing is solved in use: all parts are in another unit.)"""
    monkeypatch.setattr(request, "_FAR_OFF", np.inf)
    designs = arches()
    outcome = run(designs, 1, kit=Kit({"linear": [[part, part]]}))
    check(outcome, designs, given=True)
    for evaluation in outcome.stages["assigned"].designs:
        if built or (built is None and isinstance(evaluation, Evaluation)):
            assert evaluation.confirmations["deployed"].moved < 1e-6
        elif built is None:
            assert "Exudyn refuses the state" in str(evaluation)
        else:
            assert isinstance(evaluation, SimulationFailure) and "to the parts" in str(evaluation)


@pytest.mark.parametrize(
    "pieces, message",
    [
        (np.full((5, 2), -0.1), "not positive"),
    ],
)
def test_inputs_that_can_not_be_simulated(pieces, message):
    with pytest.raises(SimulationFailure, match=f"bad: input design: .*{message}"):
        run([*arches(1), Arch("bad", pieces, 0.5)], 2)


def test_inputs_that_are_no_numbers_are_refused():
    with pytest.raises(InputError, match="must be finite numbers"):
        run([*arches(1), Arch("bad", np.full((5, 2), np.nan), 0.5)], 2)


class TestWorkers:
    def test_killing_workers_changes_nothing(self, monkeypatch, caplog):
        """SIGKILL to a worker while it works, twice: the batch is run again by new workers."""
        designs = arches(3)
        settings = JobSettings(
            jobs=2,
            stages=replace(
                QUICK,
                schedule=(1e3,),
                relaxed_steps=2,
                assigned_steps=2,
                path_steps=3,
            ),
        )
        undisturbed = fingerprint(optimize_kit(designs, {"linear": 2}, settings=settings))
        batches, kills = [], []
        original = pool.DesignPool._run

        def run_and_kill(self, tasks):
            batches.append(len(tasks))
            if len(batches) in (3, 6) and self._parallel is not None:
                killer = threading.Timer(0.1, _kill_a_worker, [kills])
                killer.start()
                try:
                    with monkeypatch.context() as patch:
                        patch.setattr(pool, "_run_task", _slow_task)
                        return original(self, tasks)
                finally:
                    killer.join()
            return original(self, tasks)

        monkeypatch.setattr(pool.DesignPool, "_run", run_and_kill)
        assert fingerprint(optimize_kit(designs, {"linear": 2}, settings=settings)) == undisturbed
        assert len(kills) == 2
        assert caplog.text.count("a worker process ended unexpectedly") == 2

    def test_workers_that_always_die_end_the_job(self, monkeypatch, caplog):
        monkeypatch.setattr(pool, "_run_task", _die)
        with pytest.raises(SimulationFailure, match="worker processes keep ending unexpectedly"):
            optimize_kit(arches(2), {"linear": 2}, settings=JobSettings(jobs=2))


_RUN_TASK = pool._run_task


def _slow_task(task):
    time.sleep(0.15)
    return _RUN_TASK(task)


def _die(task):
    os.kill(os.getpid(), signal.SIGKILL)


def _kill_a_worker(kills: list[int]) -> None:
    from joblib.externals.loky import reusable_executor

    worker = next(iter(reusable_executor._executor._processes))
    os.kill(worker, signal.SIGKILL)
    kills.append(worker)

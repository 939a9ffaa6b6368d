"""Interrupted at any moment and resumed, a job gives what it would have given undisturbed, bit for
bit."""

from __future__ import annotations

import errno
import os
from dataclasses import replace

import numpy as np
import pytest
from support.settings import FEW_ERRORS

from kop_exudyn.errors import InputError
from kop_exudyn.files import files
from kop_exudyn.files.arrays import load_arrays
from kop_exudyn.report.kit_run import optimize_and_report
from kop_exudyn.search import pool
from kop_exudyn.search.run import optimize_kit
from kop_exudyn.search.settings import JobSettings, StageSettings
from lib.stress import kills
from lib.stress.arch import arches
from lib.stress.interruption import FailingStore, MemoryStore, fingerprint, resumed_at

PARTS = {"linear": 2}
SCHEDULE = (1e3, 1e5)
# From one start, with all stages; and from several, which the checkpoints of each begin anew.
STAGES = StageSettings(schedule=SCHEDULE, requirements=FEW_ERRORS)
SETTINGS = JobSettings(jobs=1, stages=replace(STAGES, effort="quick"))
SEVERAL_STARTS = JobSettings(jobs=1, stages=STAGES)


class Undisturbed:
    """A job that nobody disturbs: its outcome and events, what it cost, and its checkpoints."""

    def __init__(self, settings):
        self.store, events = MemoryStore(), []
        found = optimize_kit(
            arches(), PARTS, settings=settings, store=self.store, observer=events.append
        )
        self.fingerprint = fingerprint(found, events)
        self.cost = found.equilibria, found.newton_iterations
        self.saves = self.store.saves
        assert self.saves >= 8

    def is_resumed(self, settings, at, after):
        """Whether a job interrupted at a checkpoint, before it is kept or right after, ends like
        this one; after it, nothing may be done again."""
        outcome, events = resumed_at(at, arches(), PARTS, settings, after)
        assert not after or (outcome.equilibria, outcome.newton_iterations) == self.cost
        return fingerprint(outcome, events) == self.fingerprint


@pytest.fixture(scope="module")
def undisturbed():
    return Undisturbed(SETTINGS)


@pytest.fixture(scope="module")
def of_several_starts():
    found = Undisturbed(SEVERAL_STARTS)
    assert sum(str(name).startswith("assigned-") for name in found.store.kept) >= 4
    return found


@pytest.mark.parametrize("at, after", [(1, True), (2, False), (4, True), (7, False), (-1, True)])
def test_interrupted_at_a_checkpoint(undisturbed, at, after):
    at = at if at > 0 else undisturbed.saves
    assert undisturbed.is_resumed(SETTINGS, at, after)


@pytest.mark.parametrize("back, after", [(2, True)])
def test_interrupted_between_starts(of_several_starts, back, after):
    at = of_several_starts.saves - back
    assert of_several_starts.is_resumed(SEVERAL_STARTS, at, after)


@pytest.mark.parametrize("batch", [1, 2, 5, 13, 21])
def test_interrupted_between_checkpoints(undisturbed, monkeypatch, batch):
    """In the middle of a step: while the batch-th lot of simulations is running."""
    store, events, batches = MemoryStore(), [], []
    original = pool.DesignPool._run

    def interrupted(self, tasks):
        batches.append(len(tasks))
        if len(batches) == batch:
            original(self, tasks[:1])
            raise KeyboardInterrupt
        return original(self, tasks)

    monkeypatch.setattr(pool.DesignPool, "_run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        optimize_kit(arches(), PARTS, settings=SETTINGS, store=store)
    outcome = optimize_kit(arches(), PARTS, settings=SETTINGS, store=store, observer=events.append)
    assert fingerprint(outcome, events) == undisturbed.fingerprint


def test_interrupted_again_and_again(undisturbed):
    """At every checkpoint, each run getting just one further."""
    store, events, runs = MemoryStore(), [], 0
    while True:
        failing = FailingStore(1, KeyboardInterrupt(), after=True)
        failing.kept, events, runs = store.kept, [], runs + 1
        try:
            outcome = optimize_kit(
                arches(), PARTS, settings=SETTINGS, store=failing, observer=events.append
            )
            break
        except KeyboardInterrupt:
            continue
    assert runs == undisturbed.saves + 1
    assert fingerprint(outcome, events) == undisturbed.fingerprint


@pytest.mark.parametrize(
    "damage",
    [
        lambda arrays: arrays.pop("tally"),
        lambda arrays: arrays.pop("sqp/numbers"),
        lambda arrays: arrays.pop("kit"),
        lambda arrays: arrays.update({"sqp/x": np.zeros(3)}),
        lambda arrays: arrays.update({"0/deployed/numbers": np.zeros(2)}),
        lambda arrays: arrays.update({"states/0/deployed/numbers": np.zeros(2)}),
    ],
)
def test_a_checkpoint_of_something_else(undisturbed, damage):
    store = MemoryStore()
    store.kept = {name: dict(arrays) for name, arrays in undisturbed.store.kept.items()}
    before = set(store.kept)
    damage(store.kept["relaxed-1000"])
    if "0/deployed/numbers" in store.kept["relaxed-1000"]:  # an array too many harms nobody
        optimize_kit(arches(), PARTS, settings=SETTINGS, store=store)
        return
    with pytest.raises(InputError, match="checkpoint 'relaxed-1000' is damaged: start anew"):
        optimize_kit(arches(), PARTS, settings=SETTINGS, store=store)
    assert store.kept.keys() == before


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """What an undisturbed run leaves."""
    out = tmp_path_factory.mktemp("good") / "out"
    optimize_and_report(arches(), PARTS, out=out, settings=SETTINGS)
    return kills.outcome(out)


class TestFullDisk:
    @pytest.mark.parametrize("write", [1, 6, 11])
    def test_the_run_ends_cleanly_and_goes_on_later(self, tmp_path, monkeypatch, good, write):
        """No space left at the write-th file: one line, the files before it whole, none half
        written, then resumed."""
        original, writes = os.fsync, []

        def fsync(descriptor):
            writes.append(descriptor)
            if len(writes) >= write:
                raise OSError(errno.ENOSPC, "No space left on device")
            original(descriptor)

        monkeypatch.setattr(files.os, "fsync", fsync)
        with pytest.raises(InputError, match="can't be written: no space left on device"):
            optimize_and_report(arches(), PARTS, out=tmp_path / "full", settings=SETTINGS)
        left = [path for path in (tmp_path / "full").rglob("*") if path.is_file()]
        assert not [path for path in left if path.name.startswith(".")]
        for path in left:
            if path.suffix == ".npz":
                load_arrays(path)
        monkeypatch.setattr(files.os, "fsync", original)
        optimize_and_report(arches(), PARTS, out=tmp_path / "full", settings=SETTINGS, resume=True)
        assert kills.outcome(tmp_path / "full") == good

    def test_a_store_that_raises_leaves_what_it_kept(self):
        store = FailingStore(4, OSError(errno.ENOSPC, "No space left on device"))
        with pytest.raises(OSError, match="No space left"):
            optimize_kit(arches(), PARTS, settings=SETTINGS, store=store)
        assert store.saves == 3 and store.kept


def test_what_a_kill_while_writing_leaves_is_cleaned_up(tmp_path, good):
    """Killed before the job was recorded: an empty folder and a piece of a file are no obstacle."""
    checkpoints = tmp_path / "out" / "checkpoints"
    checkpoints.mkdir(parents=True)
    piece = checkpoints / ".job.json.x3f.part"
    piece.write_bytes(b"{")
    optimize_and_report(arches(), PARTS, out=tmp_path / "out", settings=SETTINGS, resume=True)
    assert not piece.exists()
    assert kills.outcome(tmp_path / "out") == good


def test_killed_processes(tmp_path):
    """SIGKILL to the command line, wherever it is; no step that a checkpoint held is ever lost."""
    designs = kills.write_designs(tmp_path / "designs")
    kills.finish(kills.start(designs, tmp_path / "good", "quick"))
    hits, kept = kills.killed_and_resumed(designs, tmp_path / "killed", (0.0, 0.3), "quick")
    assert hits == 2 and kept == sorted(kept)
    assert kills.outcome(tmp_path / "killed") == kills.outcome(tmp_path / "good")

"""The clock that says where a run's time goes."""

from time import sleep
from types import SimpleNamespace

import pytest

from kop_exudyn.search import objective
from lib.phases import REST, PhaseClock, StepCosts, medians


class Work:
    def outer(self):
        sleep(0.02)
        self.inner()
        return "done"

    def inner(self):
        sleep(0.05)

    def fails(self):
        raise ValueError("as it must")


PHASES = {"outer": [(Work, "outer"), (Work, "fails")], "inner": [(Work, "inner")]}


def test_each_moment_counts_for_the_innermost_phase():
    clock, work = PhaseClock(), Work()
    with clock.running(PHASES):
        assert work.outer() == "done"
        sleep(0.03)
    assert clock.seconds["inner"] == pytest.approx(0.05, abs=0.02)
    assert clock.seconds["outer"] == pytest.approx(0.02, abs=0.015)
    assert clock.seconds[REST] == pytest.approx(0.03, abs=0.02)
    assert clock.calls["Work.outer"] == clock.calls["Work.inner"] == 1


def test_functions_are_put_back_also_after_errors():
    before, clock, work = Work.outer, PhaseClock(), Work()
    with pytest.raises(ValueError), clock.running(PHASES):
        work.fails()
    assert Work.outer is before
    work.outer()
    assert clock.calls["Work.outer"] == 0


def test_the_package_is_whole_again():
    before = objective.solve
    with PhaseClock().running():
        assert objective.solve is not before
    assert objective.solve is before


def test_steps_leave_out_what_precedes_an_sqp():
    clock = PhaseClock()
    with clock.running(PHASES):
        costs = StepCosts(clock)
        for sqp in ("relaxed-1", "relaxed-1", "relaxed-1", "assigned-1", "assigned-1"):
            Work().inner()
            costs(
                SimpleNamespace(
                    sqp=sqp, stage=sqp.partition("-")[0], record=SimpleNamespace(trials=2)
                )
            )
    assert [step.sqp for step in costs.steps] == ["relaxed-1", "relaxed-1", "assigned-1"]
    found = medians(costs.steps)
    assert found["relaxed"]["steps"] == 2 and found["relaxed"]["trials"] == 2
    assert found["relaxed"]["all"] == pytest.approx(0.05, abs=0.02)

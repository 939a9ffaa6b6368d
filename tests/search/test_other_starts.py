"""Other starts where the best one ends in designs that snap: which are tried, in which order."""

from types import SimpleNamespace

import pytest

from kop_exudyn.search import starts
from kop_exudyn.search.stage_results import StageResult
from kop_exudyn.search.starts import Starts, TriedStart, forgiving_from_starts


def result(value, snapping=()):
    return StageResult([], None, None, value=value, snapping=snapping)


@pytest.fixture
def search(monkeypatch):
    """Stages of which no design is solved: each start has an end, where that opens, what forgives
    on the way to it, and what comes of rounds from where it opens. Calls are noted."""
    calls = []
    outcomes = {}
    lost = outcomes.setdefault("unproved", [])

    def numbered():
        return [outcome for number, outcome in outcomes.items() if isinstance(number, int)]

    def of(start):
        return next(outcome for outcome in numbered() if outcome["start"] is start)

    def optimised(stages, start, numbers, seen):
        calls.append(("optimised", start.value))
        seen.append(start)
        return of(start)["end"]

    def ended(end):
        return next(outcome for outcome in numbered() if outcome["end"] is end)

    def opened(stages, end, before, numbers, last_resorts, seen, there):
        assert not last_resorts and there.value == ended(end)["opens"]  # not opened once more
        calls.append(("rounds", end.value))
        return ended(end)["rounds"]

    def substitute(stages, best, seen):
        calls.append(("on the way", seen[0].value))
        return of(seen[0])["on the way"]

    def resorts(stages, given, others, numbers, before):
        calls.append(("resorts", given.value))
        return result(7.0)

    def otherwise(stages, given, lost, dear=False):
        mended = outcomes.get("otherwise")
        return (given, lost) if mended is None else (mended, ())

    monkeypatch.setattr(starts, "made_otherwise", otherwise)
    monkeypatch.setattr(starts, "assigned_stage", optimised)
    monkeypatch.setattr(starts, "opened_stage", opened)
    monkeypatch.setattr(starts, "substitute", substitute)
    monkeypatch.setattr(starts, "secured_steps", lambda stages, other, numbers, forgiving: other)
    monkeypatch.setattr(starts, "forgiving_stage", resorts)
    monkeypatch.setattr(starts, "unproved", lambda stages, one: (0,) if one.value in lost else ())
    stages = SimpleNamespace(
        rule=SimpleNamespace(parts_move=True),
        required=SimpleNamespace(opening=True),
        confirmed=lambda one: one,
        opened_by_itself=lambda end: result(ended(end)["opens"]),
    )
    return stages, outcomes, calls


def found(outcomes, given):
    """What the first stage left: the best start, of J 1, and others that aren't optimised."""
    for k, (value, opens, on_the_way, rounds) in given.items():
        outcomes[k] = {
            "start": result(10.0 + k),
            "end": result(value),
            "opens": opens,
            "on the way": on_the_way,
            "rounds": rounds,
        }
    tried = [TriedStart("relaxed", 5.0, 1.0, kept=True)]
    tried += [TriedStart("model", 10.0 + k) for k in given]
    left = [(k, outcomes[k]["start"]) for k in given]
    return Starts(result(1.0), tried, [], {}, left, 101)


def test_nothing_is_tried_where_the_best_forgives(search):
    stages, outcomes, calls = search
    given = found(outcomes, {1: (1.0, 1.0, None, result(1.0))})
    best = result(1.05)
    assert forgiving_from_starts(stages, given, best, None) is best and not calls


def test_the_first_start_that_forgives_is_the_last(search):
    stages, outcomes, calls = search
    given = found(
        outcomes,
        {
            1: (1.0, 1.1, None, result(1.1, (0,))),
            2: (1.0, 1.0, None, result(1.02)),
            3: (1.0, 1.0, None, result(1.0)),
        },
    )
    won = forgiving_from_starts(stages, given, result(1.0, (0,)), None)
    assert won.value == 1.02 and [one.kept for one in given.tried] == [False, False, True, False]
    assert calls == [("optimised", 11.0), ("rounds", 1.0), ("optimised", 12.0), ("rounds", 1.0)]


@pytest.mark.parametrize(
    ("opens", "order", "won"),
    [((9.0, 1.1), [1.1, 1.0], 1.05), ((9.0, 5.0), [1.1, 1.0], 1.05), ((4.0, 9.0), [1.0], 1.05)],
)
def test_long_ways_back_are_put_off(search, opens, order, won):
    """Rounds from another state come after all starts, the nearest first."""
    stages, outcomes, calls = search
    given = found(
        outcomes,
        {
            1: (1.0, opens[0], None, result(1.05)),
            2: (1.1, opens[1], None, result(1.2, (1,))),
        },
    )
    assert forgiving_from_starts(stages, given, result(1.0, (0,)), None).value == won
    assert given.tried[1].kept
    assert [value for what, value in calls if what == "rounds"] == order


def test_a_dear_result_is_bettered_by_one_more_start(search):
    stages, outcomes, calls = search
    given = found(
        outcomes, {1: (1.0, 9.0, result(1.3), result(1.15)), 2: (1.0, 1.0, None, result(1.0))}
    )
    won = forgiving_from_starts(stages, given, result(1.4), None)
    assert won.value == 1.15 and given.tried[1].kept
    assert calls == [("optimised", 11.0), ("on the way", 11.0), ("rounds", 1.0)]
    dear = result(1.3)
    calls.clear()
    given = found(outcomes, {1: (1.0, 9.0, result(1.3), result(1.4, (0,)))})
    assert forgiving_from_starts(stages, given, dear, None) is dear
    assert given.tried[0].kept


def test_what_is_proved_comes_first(search):
    """A result that more errors make snap is gone on from only where nothing else is found."""
    stages, outcomes, calls = search
    outcomes["unproved"] += [1.0, 1.01]
    given = found(outcomes, {1: (1.0, 1.0, None, result(1.02))})
    assert forgiving_from_starts(stages, given, result(1.0), None, sure=True).value == 1.02
    assert given.tried[1].kept
    given = found(outcomes, {1: (1.0, 1.0, None, result(1.01))})
    kept = result(1.0)
    assert forgiving_from_starts(stages, given, kept, None, sure=True) is kept
    assert given.tried[0].kept
    calls.clear()  # where it needn't be sure, nothing is asked
    assert forgiving_from_starts(stages, given, kept, None) is kept and not calls


def test_where_no_start_forgives_there_are_last_resorts(search):
    stages, outcomes, calls = search
    given = found(outcomes, {1: (1.0, 1.0, None, result(1.0, (0,)))})
    assert forgiving_from_starts(stages, given, result(1.0, (0,)), None).value == 7.0
    assert calls[-1] == ("resorts", 1.0)


def test_designs_that_snap_are_first_made_of_the_same_parts_otherwise(search):
    """Where that costs little, no other start is tried."""
    stages, outcomes, calls = search
    given = found(outcomes, {1: (1.0, 1.0, None, result(1.0))})
    outcomes["otherwise"] = result(1.05)
    won = forgiving_from_starts(stages, given, result(1.0, (0,)), None)
    assert won.value == 1.05 and won.snapping == () and not calls


@pytest.mark.parametrize(("other", "value"), [(1.15, 1.15), (1.4, 1.3)])
def test_where_that_is_dear_one_more_start_is_tried(search, other, value):
    stages, outcomes, calls = search
    given = found(outcomes, {1: (1.0, 1.0, None, result(other))})
    outcomes["otherwise"] = result(1.3)
    won = forgiving_from_starts(stages, given, result(1.0, (0,)), None)
    assert won.value == value and calls == [("optimised", 11.0), ("rounds", 1.0)]
    assert [one.kept for one in given.tried] == [value == 1.3, value == 1.15]

"""Several starts for the assigned stage, most of them found under a quadratic model alone.

Clustering sees an element by its distance to a part. The designs' objective, however, hardly
changes along most directions, and a kit that follows these is better than the nearest one. Under a
quadratic model at designs that are known (the inputs, the relaxed ones), assignments cost nothing
but linear algebra: from several clusterings they are improved (reassign.py), shaken and improved
again (iterated local search: Lourenço, Martin and Stützle 2003), and the best of them are built.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from ..kit.cluster import cluster
from ..kit.parts import Assignment, Kit
from .assigned import assigned_stage
from .demands import unproved
from .evaluation import Evaluation
from .events import SQPLabel
from .exchange import exchanged
from .forgiving import DEAR, forgiving_stage, secured_steps, substitute
from .opening import opened_stage
from .problems import AssignedProblem
from .reassign import LocalModel, Reassignment, improved
from .remaking import made_otherwise
from .settings import EFFORTS, Effort
from .shaking import shaken
from .stage_results import StageResult
from .stages import Stages

log = logging.getLogger(__name__)

_DAMPINGS = (1e-3, 1e-5)  # of the models
# times the lowest J built: starts above that aren't optimised. Measured on three C-shells (12 + 5
# parts): one that began at 1.9 times J of the relaxed designs' parts ended 17 % below these.
_PROMISING = 3.0
_NUMBERS = 100  # of rounds, at most, of each start: every SQP has a name of its own
_SPARE = 2  # other starts, at most, that are tried where designs of the best one snap
_SAME = 1e-6  # relative; starts whose predictions are that close are one


@dataclass(frozen=True)
class TriedStart:
    """One start of the assigned stage.

    origin : "relaxed", "model" for one that was found under a quadratic model, or "neighbour" for
        a kit of another size whose parts were split or merged
    built : J of the designs built of its kit, None where one failed
    optimised : J after the assigned stage; None where that didn't run or a design failed
    kept : whether it is the result
    """

    origin: str
    built: float | None
    optimised: float | None = None
    kept: bool = False


@dataclass
class Starts:
    """What the assigned stage ended in from several starts.

    best : result; tried : what was tried, in the order of the starts
    others : results from other starts, in the order of J
    seen : by number in `tried`, results on the way of starts that were optimised
    left : numbers in `tried` of starts that weren't optimised, and these, in the order of J
    first : number of the next SQP that has no name yet
    """

    best: StageResult
    tried: list[TriedStart]
    others: list[tuple[int, StageResult]]
    seen: dict[int, list[StageResult]]
    left: list[tuple[int, StageResult]]
    first: int

    def fresh(self) -> Iterator[int]:
        """Numbers of SQPs that have no name yet."""
        numbers = count(self.first)
        self.first += _NUMBERS
        return numbers


def assigned_from_starts(
    stages: Stages,
    built: StageResult,
    bases: Sequence[Sequence[Evaluation]],
    neighbours: Sequence[StageResult] = (),
) -> Starts:
    """The best of assigned stages from several starts, and what was tried.

    built : the relaxed designs at their parts, which is always a start
    bases : evaluations of all designs at which the objective is modelled, one list a base
    neighbours : further starts, of kits of other sizes, not confirmed yet; they are optimised
        whatever their J

    Effort says how many starts are looked for (`StageSettings.effort`). The start of the relaxed
    stage is one of them; they are optimised in the order of J, unless J is far above the lowest.
    The best one is improved by exchanges in the end, see exchange.py.
    """
    effort = EFFORTS[stages.settings.effort]
    found = []
    if effort.clusterings and stages.rule.parts_move:
        found = model_starts(stages, bases, effort)
    starts = [
        ("relaxed", built),
        *(("model", start) for start in found),
        *(("neighbour", start) for start in neighbours if start.value is not None),
    ]
    tried = [TriedStart(origin, start.value) for origin, start in starts]
    limit = _PROMISING * min(start.merit for _, start in starts)
    promising = [n for n in range(len(starts)) if n == 0 or starts[n][1].merit <= limit]
    order = sorted(promising, key=lambda n: starts[n][1].merit)[: effort.optimised]
    # what a merged kit costs at first says little of where it ends
    order += [n for n, (origin, _) in enumerate(starts) if origin == "neighbour" and n not in order]
    best, which = built, 0
    ends: list[tuple[int, StageResult]] = []
    seen: dict[int, list[StageResult]] = {}
    for k, n in enumerate(order):
        start = starts[n][1] if starts[n][0] == "relaxed" else stages.confirmed(starts[n][1])
        numbers = None if k == 0 else count(1 + _NUMBERS * k)
        end = assigned_stage(stages, start, numbers, seen=seen.setdefault(n, []))
        tried[n] = replace(tried[n], optimised=end.value)
        log.info(
            "start %d (%s) ends at J = %s, from %s", k + 1, starts[n][0], end.value, start.value
        )
        ends.append((n, end))
        if k == 0 or end.merit < best.merit:
            best, which = end, n
    numbers = count(1 + _NUMBERS * len(order))
    settings = stages.settings
    best = exchanged(
        stages,
        best,
        lambda result: stages.assigned(
            result,
            SQPLabel.of_round(next(numbers)),
            settings.round_steps,
            settings.assigned_tolerance,
        ),
    )
    tried[which] = replace(tried[which], optimised=best.value, kept=True)
    left = sorted(set(range(len(starts))) - set(order), key=lambda n: starts[n][1].merit)
    return Starts(
        replace(best, jumps=built.jumps),
        tried,
        sorted(
            ((n, end) for n, end in ends if n != which and end.value is not None),
            key=lambda pair: pair[1].merit,
        ),
        seen,
        [(n, starts[n][1]) for n in left if starts[n][1].value is not None],
        1 + _NUMBERS * (len(order) + 1),
    )


def forgiving_from_starts(
    stages: Stages,
    found: Starts,
    result: StageResult,
    before: StageResult | None,
    sure: bool = False,
) -> StageResult:
    """A result whose designs keep to their shape whatever errors of the workshop do, from other
    starts than the best one where that ended in designs that snap, or in a far higher J so as to
    keep them from it; `result` where none is better.

    Whether a kit forgives can't be told from J: kits of nearly the same J differ in it. What costs
    least is to make the designs that snap of the same parts otherwise. Where that doesn't help, or
    costs much, the ends of the other starts are looked at, and then starts that weren't optimised,
    a few at most. Where a design opens into quite another state, the way back from there is long:
    results on the way to that end are looked at first, and the way back is gone where these cost
    much, or nothing else forgives. In the end, `forgiving_stage` has its last resorts.

    result : of the best start, without these
    sure : whether what isn't proved to forgive is given up for another start that is
    """
    dear = DEAR * found.best.merit
    lost = sorted({*result.snapping, *(unproved(stages, result) if sure else ())})
    if not lost and result.merit <= dear:
        return result
    if not stages.rule.parts_move:
        return result if not result.snapping else _resorted(stages, result, found.fresh(), before)
    tried = found.tried
    optimised = {n for n, _ in found.others}
    kept = next(n for n, one in enumerate(tried) if one.kept)
    winners: list[_Winner] = []
    put_off: list[tuple[StageResult, int, StageResult, Iterator[int]]] = []

    def won_by(n: int, end: StageResult) -> None:
        if end.value is not None and not end.snapping:
            winners.append(_Winner(n, end, not sure or not unproved(stages, end)))

    def opened_from(n: int, end: StageResult, numbers: Iterator[int], there: StageResult) -> None:
        won_by(n, opened_stage(stages, end, before, numbers, False, found.seen.get(n, ()), there))

    def enough() -> bool:
        return any(won.proved and won.result.merit <= dear for won in winners)

    won_by(kept, _of_the_same_parts(stages, result, lost, found.fresh()))
    others = [*found.others, *found.left[:1]] if winners else _candidates(found)
    for n, start in [] if enough() else others:
        log.info("trying start %d (%s) as well", n + 1, tried[n].origin)
        numbers, end = found.fresh(), start
        if n not in optimised:
            seen = found.seen.setdefault(n, [])
            end = assigned_stage(stages, stages.confirmed(start), numbers, seen=seen)
            tried[n] = replace(tried[n], optimised=end.value)
        if end.value is None:
            continue
        there = stages.opened_by_itself(end) if stages.required.opening else end
        if there.merit <= _PROMISING * end.merit:
            opened_from(n, end, numbers, there)
        else:
            put_off.append((there, n, end, numbers))
            if n not in optimised:  # those of the others were looked at before
                other = substitute(stages, found.best, found.seen[n])
                if other is not None:
                    won_by(n, secured_steps(stages, other, numbers, forgiving=True))
        if enough():
            break
    for k, (there, n, end, own) in enumerate(sorted(put_off, key=lambda one: one[0].merit)):
        if enough() or (winners and k > 0):
            break
        opened_from(n, end, own, there)
    if not winners:
        return _resorted(stages, result, found.fresh(), before)
    best = min(winners, key=lambda won: (not won.proved, won.result.merit))
    if best.result is result:
        return result
    tried[:] = [replace(one, kept=k == best.start) for k, one in enumerate(tried)]
    log.info(
        "start %d forgives, at J = %s, from %s", best.start + 1, best.result.value, result.value
    )
    steps = result.steps + best.result.steps
    return replace(best.result, steps=steps, jumps=result.jumps)


@dataclass(frozen=True)
class _Winner:
    """A result that forgives, the number of its start, and whether that is as sure as is asked
    for."""

    start: int
    result: StageResult
    proved: bool


def _of_the_same_parts(
    stages: Stages, result: StageResult, lost: Sequence[int], numbers: Iterator[int]
) -> StageResult:
    """The result with designs that snap made of the same parts otherwise and the parts optimised
    from there; as it was where that doesn't help."""
    if not lost:
        return result
    mended, still = made_otherwise(stages, result, lost, dear=True)
    if still:
        return result
    won = secured_steps(stages, mended, numbers, forgiving=True)
    return replace(won, snapping=(), steps=won.steps - result.steps)


def _candidates(found: Starts) -> list[tuple[int, StageResult]]:
    """Other starts that may forgive: those that were optimised first."""
    return [*found.others, *found.left][:_SPARE]


def _resorted(
    stages: Stages, result: StageResult, numbers: Iterator[int], before: StageResult | None
) -> StageResult:
    """What the last resorts make of a result with designs that snap."""
    resorted = forgiving_stage(stages, result, (), numbers, before)
    return replace(resorted, jumps=result.jumps)


def model_starts(
    stages: Stages, bases: Sequence[Sequence[Evaluation]], options: Effort
) -> list[StageResult]:
    """Designs built of kits that quadratic models at the bases prefer; not confirmed yet, in the
    order of J. Those of which a design failed are left out.

    bases : evaluations of all designs, one list a base
    """
    found: list[StageResult] = []
    for base in bases:
        derivatives = stages.dataset.derivatives(list(base), hessian=True)
        refined = [d.evaluation for d in derivatives]
        for damping in _DAMPINGS:
            model = LocalModel.of(
                derivatives,
                stages.dataset.design_weights,
                stages.dataset.split(stages.dataset.scales()),
                damping,
            )
            for start in _best_under(stages, model, options):
                built = stages.built_from(
                    start.kit, start.assignment, refined, start.free,
                    (stages.settings.path_steps + 1) // 2,
                )  # fmt: skip
                log.info(
                    "a start under the model (damping %g): J = %s, predicted %.5g",
                    damping,
                    built.value,
                    sum(e.value for e in refined) + start.total,
                )
                found.append(built)
    whole = [built for built in found if built.value is not None]
    return sorted(whole, key=lambda built: built.merit)


def _best_under(stages: Stages, model: LocalModel, options: Effort) -> list[Reassignment]:
    """The best kits under one model that differ, by iterated local search from some clusterings."""
    settings, dataset = stages.settings, stages.dataset
    q = np.concatenate(model.base)
    ends: list[Reassignment] = []
    for number in range(options.clusterings):
        rng = np.random.default_rng([settings.seed, number])
        first = cluster(
            dataset.groups,
            q,
            stages.rule.sizes,
            bounds=settings.bounds,
            restarts=1,
            seed=settings.seed + number,
            penalties=stages.projection.penalties,
        )
        best = _improved(stages, model, first.kit, first.assignment)
        for _ in range(options.shakes):
            if best is None:
                break
            start = shaken(best.assignment, best.kit, rng)
            trial = _improved(stages, model, best.kit, start)
            if trial is not None and trial.total < best.total:
                best = trial
        ends += [best] if best is not None else []
    ends.sort(key=lambda end: end.total)
    kept: list[Reassignment] = []
    for end in ends:
        value, values = end.total, [k.total for k in kept]
        if all(abs(value - other) > _SAME * abs(other) for other in values):
            kept.append(end)
    return kept[: options.built]


def _improved(
    stages: Stages, model: LocalModel, kit: Kit, assignment: Assignment
) -> Reassignment | None:
    problem = AssignedProblem(
        stages.dataset,
        kit,
        assignment,
        stages.settings.bounds,
        stages.settings.constraints,
        costs=stages.costs,
    )
    return improved(problem, model)

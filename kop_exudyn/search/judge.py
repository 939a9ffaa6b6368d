"""What results are worth, and whether they meet what is required: judged, opened, confirmed and
tried with errors of the workshop."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Self

import numpy as np

from ..errors import SimulationFailure
from ..kit.part_costs import PartCosts
from ..kit.reuse import PieceCount
from .dataset import Dataset
from .evaluation import Evaluation
from .requirements import Requirements
from .stage_results import StageResult, realised

log = logging.getLogger(__name__)


class Judge:
    """Judges results for one dataset, whose requirements are those of steps.

    required : of results
    costs : of the parts
    reuse : what a piece less is worth, see `StageSettings.reuse`
    """

    def __init__(
        self, dataset: Dataset, required: Requirements, costs: PartCosts, reuse: float = 0.0
    ):
        self.dataset = dataset
        self.required = required
        self.costs = costs
        self.reuse = reuse

    def asking(self, required: Requirements | None = None, dataset: Dataset | None = None) -> Self:
        """The same with other requirements of results, or another dataset and with it other
        requirements of steps; those that aren't given stay."""
        other = copy(self)
        other.required = required or self.required
        other.dataset = dataset or self.dataset
        return other

    def judged(self, result: StageResult) -> StageResult:
        """The same result with the objective of its designs, what the parts cost included, and the
        cost of exceeded bounds."""
        value, penalty = self._value(result)
        return replace(
            result, value=value, penalty=penalty, reuse_factor=self._reuse_factor(result)
        )

    def opened(self, result: StageResult) -> StageResult:
        """The same result with every design in the state that it opens into by itself; not
        confirmed yet.

        A design for which no such state is found keeps the one it is in.
        """
        found = {
            n: d for n, d in enumerate(result.designs) if isinstance(d, Evaluation) and not d.way
        }
        designs = list(result.designs)
        for n, evaluation in self.dataset.open(found).items():
            if isinstance(evaluation, SimulationFailure):
                log.info("%s", evaluation)
            else:
                designs[n] = evaluation
        return self.judged(replace(result, designs=designs))

    def confirmed(self, result: StageResult) -> StageResult:
        """The same result at Exudyn's own solutions; a design that Exudyn doesn't confirm becomes a
        failure."""
        found = {n: d for n, d in enumerate(result.designs) if isinstance(d, Evaluation)}
        designs = list(result.designs)
        for n, evaluation in self.dataset.confirm(found).items():
            designs[n] = evaluation
        return self.judged(replace(result, designs=designs))

    def kept(self, result: StageResult) -> StageResult:
        """A result that the search goes on from: opened where the stages are secured."""
        return self.opened(result) if self.dataset.requirements.opening else result

    def best_confirmed(self, *results: StageResult) -> StageResult:
        """The first of these results whose designs Exudyn confirms; the first one, with its
        failures, where there is none."""
        found = [self.confirmed(results[0])]
        for result in results[1:]:
            if found[-1].value is not None:
                break
            found.append(self.confirmed(result))
        return found[-1] if found[-1].value is not None else found[0]

    def weighed(self, result: StageResult) -> StageResult:
        """The same result judged by the weights of these stages; with the states on the way where
        designs have to open by themselves."""
        opening = self.dataset.requirements.opening
        found = {
            n: (d.q, dict(d.equilibria), d.way if opening else ())
            for n, d in enumerate(result.designs)
            if isinstance(d, Evaluation)
        }
        designs = list(result.designs)
        for n, evaluation in self.dataset.judge(found).items():
            designs[n] = evaluation
        return self.confirmed(replace(result, designs=designs))

    def snapping(self, result: StageResult, among: Sequence[int] | None = None) -> tuple[int, ...]:
        """The designs of a result that errors of the workshop make snap, where it is required that
        they don't.

        among : which designs are tried; default: all
        """
        tried = range(len(result.designs)) if among is None else among
        designs = {n: result.designs[n] for n in tried}
        found = {n: d for n, d in designs.items() if isinstance(d, Evaluation)}
        return tuple(self.dataset.requiring(self.required).snapping(found))

    def redeployed(self, result: StageResult) -> list[Evaluation | SimulationFailure]:
        """Every design built of the result's parts and deployed from its own starting geometry,
        with the states on its way there where designs have to open by themselves."""
        places = [
            d.q if isinstance(d, Evaluation) else design.parameters
            for d, design in zip(result.designs, self.dataset.designs)
        ]
        free = np.concatenate(places)[self.dataset.free]
        q = realised(self.dataset, result.kit, result.assignment, free)
        secured = self.dataset.requiring(replace(self.required, samples=0))
        found = secured.redeploy(q, range(len(result.designs)))
        opened = {n: at for n, at in found.items() if isinstance(at, Evaluation)}
        found = {**found, **secured.confirm(opened)}
        return [found[n] for n in range(len(result.designs))]

    def opened_by_itself(self, result: StageResult) -> StageResult:
        """The states that a result's designs open into from their assembly."""
        return self.judged(replace(result, designs=self.redeployed(result)))

    def share(self, result: StageResult, n: int) -> float:
        """Design n's share of what results are compared by; infinite where it failed."""
        outcome = result.designs[n]
        if not isinstance(outcome, Evaluation):
            return np.inf
        dataset = self.dataset
        return dataset.design_weights[n] * outcome.value + dataset.penalty_of(outcome)

    def piece_cost(self, result: StageResult) -> float:
        """By how much J may rise for a piece less, see `StageSettings.reuse`."""
        if not self.reuse or result.value is None:
            return 0.0
        return self.reuse * (result.value + result.penalty) / self._pieces(result).fabricated

    def _reuse_factor(self, result: StageResult) -> float:
        if not self.reuse:
            return 1.0
        count = self._pieces(result)
        return float((count.fabricated / count.elements) ** self.reuse)

    def _pieces(self, result: StageResult) -> PieceCount:
        return PieceCount(result.kit, result.assignment, self.dataset.group_designs)

    def _value(self, result: StageResult) -> tuple[float | None, float]:
        """The objective and the cost of exceeded bounds; (None, 0) where a design failed."""
        found = [design for design in result.designs if isinstance(design, Evaluation)]
        if len(found) < len(result.designs):
            return None, 0.0
        value = self.dataset.value(found)
        return value + self.costs.value(result.kit), self.dataset.merit(found) - value

"""What steps and results of the stages have to meet, and how sure that has to be: the same stages
that ask for more, or for other things.

Steps are tried with few sets of a workshop's errors, as each of them costs solves of all designs.
They come to where just these sets are forgiven; so their ends are proved with other and more sets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from .evaluation import Evaluation
from .stage_results import StageResult
from .stages import Stages
from .weights import Weights

_MORE = 4  # times the sets of errors, where more are asked for
_AT_A_STEP = 100  # of them, of all designs together
# how much larger than a workshop's are the errors that prove a result, at most
_PROOF_MARGIN = 1.25
_SURE = 10  # times the sets of errors, as large as a workshop's, of which none may make it snap


def secured(stages: Stages, forgiving: bool = False, but: Sequence[int] = ()) -> Stages:
    """The same stages with designs kept on the branch along which they open: reassigned ones are
    judged where they open into, and steps that leave the branch are refused.

    forgiving : steps to where errors of the workshop make a design snap are refused as well
    but : designs that may snap nevertheless, as they do already
    """
    required = stages.required if forgiving else replace(stages.required, samples=0)
    exempt = frozenset(stages.dataset.numbers[n] for n in but)
    return stages.asking(dataset=replace(stages.dataset, requirements=required, exempt=exempt))


def careful(stages: Stages) -> Stages:
    """The same stages with more sets of errors that results, and steps that are to forgive, are
    tried with; not so many more where there are many designs, as each step tries all."""
    samples = stages.required.samples
    most = max(samples, _AT_A_STEP // len(stages.dataset.designs))
    return stages.asking(replace(stages.required, samples=min(_MORE * samples, most)))


def proving(stages: Stages) -> Stages:
    """The same stages with other and more sets of errors, to try results with: steps that keep to
    some sets come to where just these are forgiven."""
    return _with_other_errors(stages, _MORE, _PROOF_MARGIN, 1)


def sure(stages: Stages) -> Stages:
    """The same stages with as many sets of errors as large as a workshop's, and other ones, as tell
    a share of one in a hundred, where ten are tried at a step."""
    return _with_other_errors(stages, _SURE, 1.0, 2)


def _with_other_errors(stages: Stages, times: int, margin: float, stream: int) -> Stages:
    """The same stages with so many times the sets of errors, no larger than the margin, from
    another stream of random numbers."""
    required = stages.required
    return stages.asking(
        replace(
            required,
            samples=times * required.samples,
            margin=min(required.margin, margin),
            seed=required.seed + stream,
        )
    )


def unproved(
    stages: Stages, result: StageResult, among: Sequence[int] | None = None
) -> tuple[int, ...]:
    """The designs that other and more sets of errors than steps are tried with make snap.

    Errors larger than a workshop's tell it in few sets. A design that one of them makes snap isn't
    lost yet: more sets of the workshop's own errors have the last word.

    among : which designs are tried; default: all
    """
    return sure(stages).snapping(result, proving(stages).snapping(result, among))


def minding(stages: Stages, result: StageResult, members: Sequence[int]) -> Stages:
    """The same stages with those sets of errors required besides that make some designs of a result
    snap, of all those that prove it.

    members : these designs
    """
    dataset = stages.dataset
    minded = {number: list(sets) for number, sets in dataset.minded.items()}
    designs = {n: d for n in members if isinstance(d := result.designs[n], Evaluation)}
    for prover in (sure(stages), proving(stages)):
        for n, sets in dataset.requiring(prover.required).unforgiven(designs).items():
            minded.setdefault(dataset.numbers[n], []).extend(sets)
    return stages.asking(dataset=replace(dataset, minded=minded))


def calmer(stages: Stages, factor: float) -> Stages:
    """The same stages with all terms but the fit weighing more: less stress and energy leave a
    design fewer shapes to snap into.

    factor : times their weights
    """
    weights = stages.dataset.weights
    more = {name: factor * w for name, w in weights.of_terms().items() if name != "fit"}
    return _weighing(stages, Weights.of({**weights.to_dict(), **more}))


def levelled(stages: Stages, level: float) -> Stages:
    """The same stages with deviations beyond a level counting with their fourth power.

    level : share of a design's size
    """
    return _weighing(stages, replace(stages.dataset.weights, level=level))


def _weighing(stages: Stages, weights: Weights) -> Stages:
    return stages.asking(dataset=replace(stages.dataset, weights=weights))

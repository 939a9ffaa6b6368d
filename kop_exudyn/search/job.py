"""The whole job: from input designs to one kit, all baselines and both stages."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from ..errors import SimulationFailure
from ..kit.optimality import ClusteringGap, clustering_gaps
from ..kit.parts import Kit
from ..structures.base import Design
from .assigned import assigned_stage, opened_stage
from .dataset import Dataset
from .objective import Evaluation, Reference, Weights
from .pool import DesignPool
from .settings import StageSettings
from .stage_results import StageResult
from .stages import Observer, Stages, Store


@dataclass(frozen=True)
class JobSettings:
    """What a run is made with.

    weights : of the objective's terms, default: the fit weight that suits the designs' class, see
        `Design.fit_weight`
    design_weights : how much each design counts (default: all the same)
    stages : settings of the stages
    jobs : processes
    baselines : also compute the unrelaxed baseline
    """

    weights: Weights | None = None
    design_weights: tuple[float, ...] | None = None
    stages: StageSettings = StageSettings()
    jobs: int = 2
    baselines: bool = True


@dataclass
class JobOutcome:
    """What `run_job` found.

    references : of all designs
    stages : by name
    redeployed : by design, the state in which the assigned parts end when they are opened from
        their flat (or compact) assembly, not led there from the relaxed design: bending-active
        structures have several stable states
    clustering : by kind, how far the parts of the direct stage are from the best clustering of the
        input elements
    equilibria, newton_iterations : solved in all
    peak_memory_mb : of this process and its workers together
    """

    references: list[Reference]
    stages: dict[str, StageResult] = field(default_factory=dict)
    redeployed: list[Evaluation | SimulationFailure] = field(default_factory=list)
    clustering: dict[str, ClusteringGap] = field(default_factory=dict)
    equilibria: int = 0
    newton_iterations: int = 0
    peak_memory_mb: float = 0.0


def run_job(
    designs: Sequence[Design],
    parts: Mapping[str, int],
    settings: JobSettings = JobSettings(),
    store: Store | None = None,
    observer: Observer | None = None,
    announce: Callable[[str], None] = lambda phase: None,
    kit: Kit | None = None,
) -> JobOutcome:
    """Find a kit of that many parts a kind for all designs; or, given a kit, project the designs
    onto it.

    store : keeps checkpoints, from which an interrupted run goes on
    observer : sees every accepted step; announce : is told the phases' names

    Raises InputError for impossible requests, SimulationFailure when an input design can't be
    simulated.
    """
    with DesignPool(designs, settings.jobs) as pool:
        announce("input designs")
        pool.prepare()
        weights = settings.weights or Weights.suiting(designs)
        dataset = Dataset.of_pool(pool, weights, settings.design_weights)
        stages = Stages(dataset, parts if kit is None else kit, settings.stages, store, observer)
        outcome = JobOutcome(pool.references)
        found = outcome.stages
        announce("direct projection")
        found["direct"] = stages.direct()
        if settings.baselines and kit is None:
            announce("unrelaxed baseline")
            found["unrelaxed"] = stages.assigned(found["direct"], "unrelaxed")
        announce("relaxed stage")
        relaxed = stages.relaxed(found["direct"].kit)
        announce("path to the parts")
        found["relaxed"], at_parts = stages.to_parts(relaxed)
        announce("assigned stage")
        found["assigned"] = assigned_stage(stages, at_parts)
        announce("deployment of the assigned designs")
        if settings.stages.redeployments:
            found["assigned"] = opened_stage(stages, found["assigned"])
        outcome.redeployed = stages.redeployed(found["assigned"])
        announce("bound on the clustering")
        outcome.clustering = clustering_gaps(
            dataset.groups,
            dataset.parameters,
            found["direct"].kit,
            bounds=settings.stages.bounds,
        )
        outcome.peak_memory_mb = pool.peak_memory_mb()
        outcome.equilibria, outcome.newton_iterations = (
            dataset.tally.equilibria,
            dataset.tally.newton_iterations,
        )
    return outcome

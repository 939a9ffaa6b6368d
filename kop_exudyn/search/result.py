"""The outcome of a kit optimisation, in the words of the result file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from ..arrays import Indices
from ..checks import check_choice, check_whole
from ..errors import InputError, SimulationFailure
from ..kit.optimality import ClusteringGap
from ..kit.parts import Assignment, Kit
from ..kit.reuse import PieceCount
from ..structures.base import Design
from ..structures.deviation import fit_summary
from ..structures.fitting import TargetFitting
from ..structures.opening import SAME_STATE
from ..structures.stacking import group_designs
from ..structures.strength import strength_summary
from ..units import Units, common_units
from ..wording import counted
from .evaluation import Evaluation, distance
from .events import Stage, StageEvent, events_to_list
from .objective import Reference
from .stage_results import StageResult
from .starts import TriedStart

INPUT = "input"  # the designs as given, before all stages
REDEPLOYED = "redeployed"  # the assigned designs, opened from their assembly
STAGES = tuple(stage.value for stage in Stage)


@dataclass
class KitResult:
    """All stages of one run.

    designs, references : what was asked for
    stages : by name ("direct", "unrelaxed", "relaxed", "assigned"; "published": what the published
        method leaves, and "published_opened": the same as its designs open from their assembly)
    at_parts : between the last two: every element its nearest part, where the assigned stage began;
        None where the result was read from a file
    events : accepted steps of all SQPs, in order
    redeployed : by design, the state that the assigned parts open into by themselves, with those
        on the way there (`Evaluation.way`) and the stress in all of them
        (`Evaluation.utilisation`); empty where it wasn't computed
    clustering : by kind, how far the parts that the search began with are from the best clustering
        of the input elements
    seconds : wall time of "search" (both stages) and, where that was asked for, "published"; of
        "confirmation" by Exudyn the sum over all processes
    tried : starts of the assigned stage, and what came of them
    buildable : by design, whether it can be built from the kit and what stops it, as plain data;
        empty where that was not looked at
    verdict : the same in words: which can be built, and what stops the others
    given, warnings : the same of the input designs, which no kit can mend; no warning where nothing
        stops them
    equilibria, newton_iterations : solved in all
    wall_s : wall time of the whole run, s
    peak_memory_mb : largest memory of all its processes together, MB
    settings : as given, for the record
    """

    designs: list[Design]
    references: list[Reference]
    stages: dict[str, StageResult] = field(default_factory=dict)
    at_parts: StageResult | None = None
    events: list[StageEvent] = field(default_factory=list)
    equilibria: int = 0
    newton_iterations: int = 0
    wall_s: float = 0.0
    peak_memory_mb: float = 0.0
    settings: Mapping[str, Any] = field(default_factory=dict)
    redeployed: Sequence[Evaluation | SimulationFailure] = ()
    clustering: Mapping[str, ClusteringGap] = field(default_factory=dict)
    tried: Sequence[TriedStart] = ()
    seconds: dict[str, float] = field(default_factory=dict)
    buildable: Sequence[Mapping[str, Any]] = ()
    verdict: Sequence[str] = ()
    given: Sequence[Mapping[str, Any]] = ()
    warnings: Sequence[str] = ()

    def __repr__(self) -> str:
        sizes = ", ".join(f"{count} {kind}" for kind, count in self.kit.sizes.items())
        return f"<KitResult: {sizes} parts for {', '.join(d.name for d in self.designs)}>"

    @property
    def units(self) -> Units | None:
        """Of the designs and so of the kit; None where no design names any."""
        return common_units({design.name: design.units for design in self.designs})

    @property
    def kit(self) -> Kit:
        """The kit that the run was for, in the designs' units."""
        return replace(self.stages["assigned"].kit, units=self.units)

    @property
    def assignment(self) -> Assignment:
        return self.stages["assigned"].assignment

    def pieces(self) -> list[dict[str, Indices]]:
        """By design: kind -> (m,) how many elements each part realises."""
        found, first = [], 0
        for design in self.designs:
            rows = slice(first, first + len(design.groups))
            whole = self.assignment
            own = Assignment(whole.groups[rows], whole.part[rows], whole.variant[rows], whole.n_q)
            found.append(own.pieces(self.kit))
            first = rows.stop
        return found

    def piece_count(self) -> PieceCount:
        """The pieces of every part by design, and how many have to be made."""
        return PieceCount(self.kit, self.assignment, group_designs(self.designs))

    def summary(self, stage: str, number: int) -> dict[str, Any]:
        """Fit, energy and confirmation of one design after a stage, or {"failed": why}."""
        check_choice("stage", stage, self.stages)
        self._check_number(number)
        outcome = self.stages[stage].designs[number]
        return summary_of(outcome, self.designs[number], self.references[number])

    def input_summary(self, number: int) -> dict[str, Any]:
        """Fit and energy of one input design: what of a stage's deviation no kit is to blame
        for."""
        self._check_number(number)
        design, reference = self.designs[number], self.references[number]
        state = reference.equilibria[design.fitted_role.name].state
        fit = TargetFitting(reference.target).minimum_zone(state.positions[design.joints])
        return {
            "fit": fit_summary(design, reference.target, fit, state),
            "elastic_energy": reference.energy,
        }

    def redeployment(self, number: int) -> dict[str, Any]:
        """Where the assigned design's parts open into by themselves: fit, energy, whether it's the
        kept state, and Exudyn's confirmation.

        {"failed": why} where that deployment (or the design) failed.
        """
        self._check_number(number)
        if not self.redeployed:
            raise InputError("the designs were not opened in this run", field="redeployed")
        opened, kept = self.redeployed[number], self.stages["assigned"].designs[number]
        if isinstance(opened, SimulationFailure):
            return {"failed": str(opened)}
        if isinstance(kept, SimulationFailure):
            return {"failed": str(kept)}
        design, target = self.designs[number], self.references[number].target
        role = design.fitted_role.name
        moved = distance(design, opened, kept)
        energy = opened.equilibria[role].elastic_energy
        return {
            "same_state": moved <= SAME_STATE,
            "moved_percent": 100 * moved,
            "fit": fit_summary(design, target, opened.fit, opened.equilibria[role].state),
            "elastic_energy": energy,
            "energy_ratio": energy / self.references[number].energy,
            "exudyn": opened.confirmations[role].to_dict() if opened.confirmations else None,
        }

    def _check_number(self, number: int) -> None:
        check_whole("number", number)
        if number >= len(self.designs):
            raise InputError(
                f"there are {counted(len(self.designs), 'design')}, numbered from 0",
                field="number",
                value=number,
            )

    def to_dict(self) -> dict[str, Any]:
        """As result.json has it."""
        count = self.piece_count()
        return {
            "units": None if self.units is None else self.units.to_dict(),
            **({"verdict": list(self.verdict)} if self.verdict else {}),
            **({"warnings": list(self.warnings)} if self.warnings else {}),
            "designs": [
                {
                    "name": design.name,
                    "elements": design.n_elements,
                    "input": {
                        **self.input_summary(n),
                        **({"buildable": dict(self.given[n])} if self.given else {}),
                    },
                    **{stage: self.summary(stage, n) for stage in STAGES if stage in self.stages},
                    **({"redeployed": self.redeployment(n)} if self.redeployed else {}),
                    **({"buildable": dict(self.buildable[n])} if self.buildable else {}),
                }
                for n, design in enumerate(self.designs)
            ],
            "kit": {kind: _plain(parts) for kind, parts in self.kit.parts.items()},
            "assignment": self.assignment.to_dict(),
            "pieces": {"to_make": count.fabricated, "elements": count.elements},
            "clustering": {kind: gap.to_dict() for kind, gap in self.clustering.items()},
            "tried": [asdict(start) for start in self.tried],
            "steps": {
                stage: self.stages[stage].steps
                for stage in ("relaxed", "assigned", "unrelaxed", "published")
                if stage in self.stages
            },
            "objective": {
                stage: self.stages[stage].value for stage in STAGES if stage in self.stages
            },
            "jumps": [
                {
                    "stage": name,
                    "design": j.design,
                    "fraction": j.fraction,
                    "distance_percent": 100 * j.distance,
                }
                for name, stage in self.stages.items()
                for j in stage.jumps
            ],
            "status": {
                stage: result.status for stage, result in self.stages.items() if result.status
            },
            "equilibria": self.equilibria,
            "newton_iterations": self.newton_iterations,
            "wall_s": self.wall_s,
            "seconds": dict(self.seconds),
            "peak_memory_mb": self.peak_memory_mb,
            "settings": dict(self.settings),
            "history": events_to_list(self.events),
        }


def summary_of(
    outcome: Evaluation | SimulationFailure, design: Design, reference: Reference
) -> dict[str, Any]:
    """One design's figures: fit in % of the size, energies, stability, Exudyn's
    confirmation, stresses."""
    if isinstance(outcome, SimulationFailure):
        return {"failed": str(outcome)}
    role = design.fitted_role.name
    energy, state = outcome.equilibria[role].elastic_energy, outcome.equilibria[role].state
    return {
        "fit": fit_summary(design, reference.target, outcome.fit, state),
        "elastic_energy": energy,
        "energy_ratio": energy / reference.energy,
        "stable": all(eq.stable for eq in outcome.equilibria.values()),
        "exudyn": outcome.confirmations[role].to_dict() if outcome.confirmations else None,
        "confirmed": sorted(outcome.confirmations),
        "strength": strength_summary(design, outcome.equilibria),
    }


def _plain(parts: np.ndarray) -> list:
    return (parts[:, 0] if parts.shape[1] == 1 else parts).tolist()

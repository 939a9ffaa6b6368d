"""From the outcome of a kit optimisation to what its figures draw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..errors import SimulationFailure
from ..kit.groups import ElementGroup
from ..kit.kinds import part_kind
from ..kit.optimality import ClusteringGap
from ..search.evaluation import Evaluation
from ..search.result import INPUT, REDEPLOYED, STAGES, KitResult
from ..search.starts import TriedStart
from ..structures.base import Design
from ..structures.strength import beyond_limit
from ..units import unit_of
from ..wording import counted
from .designs import DrawnDesign, DrawnState
from .history import History, HistoryStep
from .parameters import ElementCloud, PartSpace

DRAWN_STAGES = ("direct", "relaxed", "assigned")


def drawn_designs(result: KitResult) -> list[DrawnDesign]:
    """Every design after the drawn stages, placed on its target, over the input design's rods."""
    return drawn_stages(result, DRAWN_STAGES)


def drawn_stages(result: KitResult, stages: Sequence[str]) -> list[DrawnDesign]:
    """The same for the stages asked for, where the result has them."""
    drawn = []
    for n, (design, reference) in enumerate(zip(result.designs, result.references)):
        states = [
            drawn_state(design, result.stages[stage].designs[n], stage)
            for stage in stages
            if stage in result.stages
        ]
        role = design.fitted_role.name
        wanted = design.scene(role).polylines(reference.equilibria[role].state)
        drawn.append(DrawnDesign(design.name, states, wanted))
    return drawn


def drawn_state(design: Design, outcome: Evaluation | SimulationFailure, title: str) -> DrawnState:
    """One design's fitted state at its best placement."""
    if isinstance(outcome, SimulationFailure):
        return DrawnState(title, failed=outcome.reason)
    role = design.fitted_role.name
    state, placement = outcome.equilibria[role].state, outcome.fit.placement
    return DrawnState(
        title,
        [placement.apply(line) for line in design.scene(role).polylines(state)],
        placement.apply(state.positions[design.joints]),
        100 * outcome.fit.distances / outcome.fit.size,
    )


def histories(result: KitResult) -> list[History]:
    """The accepted steps of both stages, with all values of w_c and all rounds after each other."""
    titles = {"relaxed": "relaxed: all elements", "assigned": "assigned: parts only"}
    steps: dict[str, list[HistoryStep]] = {stage: [] for stage in titles}
    for event in result.events:
        if event.stage in steps:
            steps[event.stage].append(HistoryStep(event.terms, event.weight, event.round))
    return [History(title, steps[stage]) for stage, title in titles.items()]


def part_spaces(result: KitResult) -> list[PartSpace]:
    """Parts and elements by kind: the inputs', and those of the relaxed stage where all designs
    have them."""
    clouds = {"input elements": [design.parameters for design in result.designs]}
    relaxed = result.stages["relaxed"]
    if not any(isinstance(outcome, SimulationFailure) for outcome in relaxed.designs):
        clouds["relaxed elements"] = [outcome.q for outcome in relaxed.evaluations]
    groups = [group for design in result.designs for group in design.groups]
    owners = [n for n, design in enumerate(result.designs) for _ in design.groups]
    spaces = []
    # planes before histograms
    kinds = sorted(result.kit.parts.items(), key=lambda item: -item[1].shape[1])
    for name, parts in kinds:
        members = [(group, n) for group, n in zip(groups, owners) if group.kind == name]
        spaces.append(
            PartSpace(
                name,
                part_kind(name).parameter_names,
                parts,
                [_cloud(label, name, members, q) for label, q in clouds.items()],
                "" if result.units is None else result.units.length,
            )
        )
    return spaces


def _cloud(
    label: str,
    kind_name: str,
    members: Sequence[tuple[ElementGroup, int]],
    parameters: Sequence[np.ndarray],
) -> ElementCloud:
    """Elements with the most parameters as the parts that would realise them, the others as plain
    values."""
    kind = part_kind(kind_name)
    most = max(group.indices.shape[1] for group, _ in members)
    full, ends = [np.empty((0, kind.n_parameters))], [np.empty(0)]
    for group, n in members:
        values = parameters[n][group.indices]
        if group.indices.shape[1] == most:
            full.append(kind.canonical(kind.variants_of(most).lift(values)))
        else:
            ends.append(values.ravel())
    return ElementCloud(label, np.concatenate(full), np.concatenate(ends))


def summary_rows(result: KitResult) -> tuple[list[str], list[list]]:
    """Headings and rows of the table of all designs as built: elements, energy, stress."""
    headings = [
        "design",
        "elements",
        "energy ratio",
        f"largest stress, {'MPa' if result.units else unit_of('stress', None)}",
        "utilisation",
        "stable",
    ]
    scale = 1.0 if result.units is None else 1e-6 * result.units.stress_si(1.0)
    rows = []
    for n, design in enumerate(result.designs):
        final = result.summary("assigned", n)
        stress = _worst(final, "equivalent_stress")
        rows.append(
            [
                design.name,
                design.n_elements,
                final.get("energy_ratio"),
                None if stress is None else scale * stress,
                _worst(final, "utilisation"),
                final.get("stable"),
            ]
        )
    return headings, rows


def stage_rows(result: KitResult) -> tuple[list[str], list[list]]:
    """Headings and rows: the largest deviation of every design's joints after every stage, %."""
    stages = [stage for stage in STAGES if stage in result.stages]
    rows = []
    for n, design in enumerate(result.designs):
        found = [result.input_summary(n), *(result.summary(stage, n) for stage in stages)]
        rows.append([design.name, *(_fit(summary, "max_percent") for summary in found)])
    return ["design", *(f"{stage.replace('_', ' ')}, %" for stage in (INPUT, *stages))], rows


def displaced_rows(result: KitResult) -> tuple[list[str], list[list]]:
    """Headings and rows: how far every design's joints are from their own places in the target
    after every stage at most, % of its size."""
    stages = [stage for stage in STAGES if stage in result.stages]
    rows: list[list] = []
    for n, design in enumerate(result.designs):
        outcomes = (result.stages[stage].designs[n] for stage in stages)
        found = [
            100 * float(outcome.fit.displacements.max()) / outcome.fit.size
            if isinstance(outcome, Evaluation)
            else None
            for outcome in outcomes
        ]
        rows.append([design.name, *found])
    return ["design", *(f"{stage.replace('_', ' ')}, %" for stage in stages)], rows


def final_states(result: KitResult) -> dict[tuple[str, str, str], Equilibrium]:
    """(design, stage, role) -> equilibrium, for all that were found.

    The designs as given are stage "input", those that opened from their assembly in the end stage
    "redeployed".
    """
    inputs = {
        (design.name, INPUT, role): equilibrium
        for design, reference in zip(result.designs, result.references)
        for role, equilibrium in reference.equilibria.items()
    }
    outcomes = {stage: found.designs for stage, found in result.stages.items()} | {
        REDEPLOYED: result.redeployed
    }
    return inputs | {
        (design.name, stage, role): equilibrium
        for stage, found in outcomes.items()
        for design, outcome in zip(result.designs, found)
        if isinstance(outcome, Evaluation)
        for role, equilibrium in outcome.equilibria.items()
    }


def remarks(result: KitResult, verdicts: bool = False) -> list[str]:
    """What a reader should know besides the figures: snaps, other states to open into, yield, how
    SQPs ended.

    verdicts : whether verdicts on the designs tell already where they open into, and their stress
    """
    stages = result.stages
    found = [
        f"{jump.design} snapped at {jump.fraction:.0%} of the way to its parts: "
        f"{jump.distance:.1%} of its size."
        for jump in stages["assigned"].jumps
    ]
    own = [] if verdicts else list(enumerate(result.designs))
    found += [
        _about_opening(design.name, result.redeployment(n), result.summary("assigned", n))
        for n, design in own
        if result.redeployed
    ]
    found += [_about_strength(design.name, result.summary("assigned", n)) for n, design in own]
    found += [_about_clustering(kind, gap) for kind, gap in result.clustering.items()]
    found = [remark for remark in found if remark]
    if len(result.designs) > 1 and "stock" not in result.settings:
        count = result.piece_count()
        found.append(
            f"{counted(count.fabricated, 'piece has', 'pieces have')} to be made so "
            "that the designs "
            f"can be built one after the other; they have {counted(count.elements, 'element')}."
        )
    if "published" in result.stages and result.seconds:
        found.append(_about_published(result))
    if len(result.tried) > 1:
        found.append(_about_starts(result.tried))
    return found + [
        f"The {name} stage ended after {counted(stage.steps, 'step')}: {stage.status}."
        for name, stage in stages.items()
        if stage.status and name != "published_opened"  # the same steps, only opened
    ]


def _about_published(result: KitResult) -> str:
    """The published method beside ours: deviation of the opened states, energy, steps, time."""

    def told(stage: str) -> str:
        found = [result.summary(stage, n) for n in range(len(result.designs))]
        failed = [design.name for design, one in zip(result.designs, found) if "failed" in one]
        if failed:
            return f"can't build {', '.join(failed)}"
        largest = max(one["fit"]["max_percent"] for one in found)
        ratio = sum(one["energy_ratio"] for one in found) / len(found)
        return f"largest deviation {largest:.2f} %, energy {ratio:.2f} times the inputs'"

    steps = result.stages["published"].steps
    return (
        f"The published method (BFGS, nearest parts, no reassignment) with as many parts: "
        f"{told('published')} in the states that the designs are led to, "
        f"{told('published_opened')} as they open; {counted(steps, 'step')} in "
        f"{result.seconds['published']:.0f} s. This kit: {told('assigned')}; "
        f"{result.seconds['search']:.0f} s."
    )


_ORIGINS = {
    "relaxed": "that of the relaxed stage",
    "model": "found under the model",
    "neighbour": "the kit of the next larger size, with parts merged",
}


def _about_starts(tried: Sequence[TriedStart]) -> str:
    """From how many starts the assigned stage ran, and which one was kept."""
    ends = [start.optimised for start in tried if start.optimised is not None]
    kept = next(start for start in tried if start.kept)
    others = ", ".join(f"{end:.4g}" for end in sorted(ends))
    return (
        f"{counted(len(tried), 'start')} of the assigned stage, the best {len(ends)} optimised "
        f"(J = {others}); the one kept is {_ORIGINS[kept.origin]}."
    )


def _about_clustering(kind: str, gap: ClusteringGap) -> str:
    """How good the parts are that the search began with."""
    if gap.exact and gap.gap_percent < 0.01:
        return f"The {kind} parts that the search began with are the best clustering of the inputs."
    return (
        f"The {kind} parts that the search began with are within {gap.gap_percent:.1f} % of the "
        f"projection energy of the best clustering of the inputs (proven; it says nothing of the "
        f"designs built from them)."
    )


def _about_opening(name: str, opened: Mapping, kept: Mapping) -> str:
    """A sentence where a design, opened from its flat or compact assembly, ends in another state
    than the kept one."""
    if "failed" in kept or opened.get("same_state"):
        return ""
    if "failed" in opened:
        return f"{name} could not be opened from its assembly: {opened['failed']}."
    ratio = opened["elastic_energy"] / kept["elastic_energy"]
    return (
        f"{name} has several stable states: opened from its assembly without guidance it settles "
        f"{opened['moved_percent']:.1f} % of its size from the one shown, at {ratio:.3f} times "
        f"its elastic energy "
        f"({opened['fit']['max_percent']:.2f} % from the target at most); it has to be led into "
        f"the one shown."
    )


def _about_strength(name: str, summary: Mapping) -> str:
    """A sentence where rods of an assigned design are stressed beyond their elastic limit."""
    beyond = [
        f"{strength['utilisation']:.2f} times in its {role} state"
        for role, strength in summary.get("strength", {}).items()
        if beyond_limit(strength["utilisation"])
    ]
    return (
        (
            f"{name}'s rods are stressed beyond their elastic limit, {' and '.join(beyond)}: they "
            f"would yield or "
            "break; thinner ones are stressed less."
        )
        if beyond
        else ""
    )


def _fit(summary: Mapping, name: str) -> float | None:
    return summary["fit"][name] if "fit" in summary else None


def _worst(summary: Mapping, name: str) -> float | None:
    """The largest stress or utilisation of all states."""
    known = [
        strength[name]
        for strength in summary.get("strength", {}).values()
        if strength[name] is not None
    ]
    return max(known, default=None)

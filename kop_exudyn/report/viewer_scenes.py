"""From designs, simulations and results to what the 3D page shows."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..drawing.colours import kit_colours
from ..equilibrium.equilibria import Equilibrium
from ..equilibrium.newton import solve
from ..errors import SimulationFailure
from ..fabrication.pieces import DesignPieces, PartsList, parts_list_of
from ..fabrication.placement import PlacedPieces
from ..kit.kinds import PartKind, part_kind
from ..scene.scene import Scene
from ..search.evaluation import Evaluation
from ..search.result import KitResult
from ..structures.base import Design, Target
from ..structures.deviation import fit_summary
from ..structures.fitting import FitResult, Placement, TargetFitting, best_placement
from ..structures.opening import SAME_STATE
from ..structures.strength import design_strength
from ..units import Units, in_millimetres
from ..wording import counted, counted_parts
from .clipping import clipped
from .viewer import ViewerDesign, ViewerPart, ViewerRods, ViewerScene, ViewerState

log = logging.getLogger(__name__)

_SLENDERNESS = 250  # size over breadth of rods that have no section of their own
_LEAST_SHARE = 0.04  # of the opening: nearer to flat, the branch meets its bifurcation
_NEIGHBOURS = 3  # of a joint: as far as the farthest of them, the target is drawn


def kit_scene(result: KitResult, *, frames: int = 0, title: str | None = None) -> ViewerScene:
    """The designs of a kit optimisation in all stages, inputs first.

    frames : how many states on the way to the opening to show at most, in the assigned stage
    """
    parts = parts_list_of(result)
    designs = []
    for n, (placed, reference) in enumerate(zip(parts.designs, result.references)):
        drawing = _Drawing(placed, parts)
        states, failed = drawing.states("input", reference.equilibria), {}
        for stage, found in result.stages.items():
            outcome = found.designs[n]
            if isinstance(outcome, Evaluation):
                states += drawing.states(
                    stage, outcome.equilibria, frames if stage == "assigned" else 0
                )
            else:
                failed[stage] = outcome.reason
        designs.append(drawing.finish(states, failed))
    return ViewerScene(
        title or f"{counted_parts(result.kit.sizes)} for {counted(len(designs), 'design')}",
        designs,
        viewer_parts(parts),
        unit=_length(result.units),
    )


def design_scene(
    design: Design, equilibria: Mapping[str, Equilibrium], *, frames: int = 0
) -> ViewerScene:
    """One design in its final states, as `kop simulate` finds them."""
    drawing = _Drawing(DesignPieces(design, ()), None)
    return ViewerScene(
        design.name,
        [drawing.finish(drawing.states("input", equilibria, frames), {})],
        unit=_length(design.units),
    )


def _length(units: Units | None) -> str:
    return "units" if units is None else units.length


def viewer_parts(parts: PartsList) -> list[ViewerPart]:
    """All parts, kind by kind, each with a colour of its own."""
    found = []
    colours = kit_colours(parts.kit.sizes)
    for kind, values in parts.kit.parts.items():
        for k, colour in enumerate(colours[kind]):
            found.append(
                ViewerPart(
                    parts.labels[kind][k],
                    kind,
                    colour,
                    _dimensions(part_kind(kind), values[k], parts.kit.units),
                    parts.counts[kind][:, k].tolist(),
                )
            )
    return found


def opening_path(
    design: Design, equilibria: Mapping[str, Equilibrium], frames: int
) -> list[Equilibrium]:
    """States in which a design is opened from its assembly, backwards, the one before the deployed
    state first: at most so many, the assembly among them.

    equilibria : of all roles
    frames : how many at most
    Where the assembly opens into another state than the deployed one, its states are those from
    there back towards the closed state, as far as they can be followed. Without an actuated
    assembly there are none then.
    """
    final = equilibria[design.fitted_role.name]
    if frames < 1:
        return []
    try:
        opened = list(design.opened_through(final.q, equilibria).values())
    except SimulationFailure as failure:
        log.info("%s: its opening isn't shown from the assembly on: %s", design.name, failure)
        return _closed(design, final, frames)
    if not opened:
        return []
    x, y = (eq.state.positions[design.joints] for eq in (opened[-1], final))
    placed = best_placement(x, y)
    apart = np.abs(placed.apply(x) - y).max() / design.target.size
    if apart > SAME_STATE:
        log.warning(
            "%s: the assembly opens into another state, %.2g %% of its size away; the opening is "
            "shown as far back from this one as it can be followed",
            *(design.name, 100 * apart),
        )
        return _closed(design, final, frames)
    way = opened[:-1]
    kept = np.unique(np.round(np.linspace(0, len(way) - 1, min(frames, len(way)))).astype(int))
    return [way[k] for k in kept[::-1]]


def _closed(design: Design, final: Equilibrium, frames: int) -> list[Equilibrium]:
    """States of the deployed role on the way back from its opening to that of another role, as far
    as they can be followed."""
    role = design.fitted_role.name
    closed = [r.opening for r in design.roles if r.name != role and r.opening is not None]
    if final.opening is None or not closed:
        return []
    shares, path, last = np.linspace(1, _LEAST_SHARE, frames + 1)[1:], [], final
    for share in shares:
        opening = closed[0] + share * (final.opening - closed[0])
        try:
            last = solve(design.systems[role], last.q, last, opening)
        except SimulationFailure as failure:
            log.info(
                "%s: the opening is shown from %.0f %% on: %s", design.name, 100 * share, failure
            )
            break
        path.append(last)
    return path


@dataclass(frozen=True)
class _Drawing:
    """Draws the states of one design; without parts, all rods are alike."""

    pieces: DesignPieces
    parts: PartsList | None

    @property
    def design(self) -> Design:
        return self.pieces.design

    @cached_property
    def fitting(self) -> TargetFitting:
        return TargetFitting(self.design.target)

    @cached_property
    def placed(self) -> dict[str, PlacedPieces]:
        return {role.name: PlacedPieces.of(self.pieces, role.name) for role in self.design.roles}

    def states(
        self, stage: str, equilibria: Mapping[str, Equilibrium], frames: int = 0
    ) -> list[ViewerState]:
        """All roles of a stage; the fitted one at its best placement, with the frames of its
        opening."""
        found, fitted = [], self.design.fitted_role.name
        for role, equilibrium in equilibria.items():
            if role != fitted:
                found.append(self._state(stage, role, equilibrium))
                continue
            fit = self.fitting.minimum_zone(equilibrium.state.positions[self.design.joints])
            state = self._state(stage, role, equilibrium, fit.placement)
            off = self._off(fit, equilibrium)
            found.append(replace(state, note=" · ".join(filter(None, (off, state.note)))))
            path = opening_path(self.design, equilibria, frames)
            found += [
                replace(self._state(stage, role, eq, fit.placement), final=False) for eq in path
            ]
        return found

    def _off(self, fit: FitResult, equilibrium: Equilibrium) -> str:
        """How far from the target, as the page and the results have it."""
        found = fit_summary(self.design, self.design.target, fit, equilibrium.state)
        told = [
            f"{what} at most {found[f'{name}_percent']:.2g} %, "
            f"{in_millimetres(found[name], self.design.units)}"
            for what, name in (("joints", "max"), ("between them", "pieces_max"))
            if what == "joints" or found["pieces_max"] != found["max"]
        ]
        return f"off target: {'; '.join(told)}"

    def finish(self, states: Sequence[ViewerState], failed: Mapping[str, str]) -> ViewerDesign:
        """The design with these states."""
        rods = {role: self._rods(placed) for role, placed in self.placed.items()}
        return ViewerDesign(
            self.design.name, rods, states, _target_near(self.design.target), failed
        )

    def _rods(self, placed: PlacedPieces) -> ViewerRods:
        scene = placed.scene
        half = 0.5 * scene.size / _SLENDERNESS
        plain = np.array([[half, half], [-half, half], [-half, -half], [half, -half]])
        outlines = [
            plain if chain.section is None else chain.section.outline for chain in scene.chains
        ]
        distinct = list({id(outline): outline for outline in outlines}.values())
        place = {id(outline): k for k, outline in enumerate(distinct)}
        return ViewerRods(
            np.array([len(chain.nodes) for chain in scene.chains]),
            np.array([self._number(piece) for piece in placed.chain_pieces]),
            distinct,
            np.array([place[id(outline)] for outline in outlines]),
            np.array(
                [self._number(placed.pieces.by_parameter.get(p)) for p in placed.corners], dtype=int
            ),
        )

    def _number(self, piece: Any) -> int:
        """The part's place in `viewer_parts`, -1 for none."""
        if piece is None or self.parts is None:
            return -1
        sizes = self.parts.kit.sizes
        return (
            sum(sizes[kind] for kind in list(sizes)[: list(sizes).index(piece.kind)]) + piece.part
        )

    def _state(
        self, stage: str, role: str, equilibrium: Equilibrium, placement: Placement | None = None
    ) -> ViewerState:
        placed, state = self.placed[role], equilibrium.state
        scene, nodes = placed.scene, _ring_nodes(placed.scene)
        x, R = scene.node_poses(state)
        joints = state.positions[self.design.joints]
        corners = state.positions[[corner.body for corner in placed.corners.values()]].reshape(
            -1, 3
        )
        deviation = None
        if placement is not None:
            x, joints, corners = (
                placement.apply(x),
                placement.apply(joints),
                placement.apply(corners),
            )
            R = placement.rotation @ R
            distances = np.sqrt(self.design.target.surface.closest(x).squared_distances)
            deviation = 100 * distances[nodes] / self.design.target.size
        strength = design_strength(self.design, {role: equilibrium})[role]
        largest = strength.largest
        utilisation = None if largest is None else _ring_values(scene, strength.utilisation)
        note = "" if largest is None else f"stress: max {100 * largest:.0f} % of its limit"
        return ViewerState(
            stage,
            role,
            x[nodes],
            R[nodes],
            joints,
            corners,
            deviation,
            utilisation,
            equilibrium.opening,
            placed=placement is not None,
            note=note,
        )


def _target_near(target: Target) -> tuple[np.ndarray, np.ndarray]:
    """The target around the joints, cut off at a distance from them: surfaces may go on far beyond
    the design."""
    tree = cKDTree(target.positions)
    reach = tree.query(target.positions, k=min(_NEIGHBOURS + 1, len(target.positions)))[0].max()
    return clipped(target.vertices, target.faces, tree.query(target.vertices)[0] - reach)


def _ring_nodes(scene: Scene) -> np.ndarray:
    """(M,) nodes of all rod pieces, one after the other."""
    return np.concatenate([chain.nodes for chain in scene.chains])


def _ring_values(scene: Scene, values: np.ndarray) -> np.ndarray:
    """(M,) at every ring the larger value (E,) of the elements beside it, NaN on rigid pieces."""
    found: Iterable[np.ndarray] = (
        np.fmax(
            np.append(values[chain.elements], np.nan), np.insert(values[chain.elements], 0, np.nan)
        )
        if len(chain.elements)
        else np.full(len(chain.nodes), np.nan)
        for chain in scene.chains
    )
    return np.concatenate(list(found))


def _dimensions(kind: PartKind, values: np.ndarray, units: Units | None) -> str:
    if kind.angular:
        return ", ".join(f"{np.degrees(v):.2f}°" for v in values)
    lengths = ", ".join(f"{name} = {v:.4g}" for name, v in zip(kind.parameter_names, values))
    return lengths if units is None else f"{lengths} {units.length}"

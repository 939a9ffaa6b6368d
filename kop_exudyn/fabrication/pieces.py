"""Which piece of which part sits where: what cut lists, assembly plans and coloured drawings are
made from.

Parts are numbered from 1 within their kind and labelled by the kind's initial: L1, L2, ..., A1, ...
Elements are numbered from 1 within their design, in the order of its groups; joints in the order of
the design's joints.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..checks import check_kind
from ..errors import InputError
from ..kit.kinds import PartKind, part_kind
from ..kit.parts import Assignment, Kit
from ..scene.state import State
from ..search.evaluation import Evaluation
from ..search.result import KitResult
from ..structures.base import Design
from ..structures.fitting import TargetFitting


@dataclass(frozen=True)
class Piece:
    """One element of a design, built from a part.

    element : number within the design, from 1
    kind, part : the part, numbered from 0 within its kind
    variant : name of the way in which it is built in
    parameters (k_e,) : places of the element's parameters in the design's q
    columns (k_e,) : which parameter of the part realises each of them
    values (k_e,) : the element's parameters, realised
    """

    element: int
    kind: str
    part: int
    variant: str
    parameters: tuple[int, ...]
    columns: tuple[int, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class DesignPieces:
    """All pieces of one design."""

    design: Design
    pieces: tuple[Piece, ...]

    @cached_property
    def by_parameter(self) -> dict[int, Piece]:
        """The piece that each parameter of the design belongs to."""
        return {parameter: piece for piece in self.pieces for parameter in piece.parameters}


@dataclass(frozen=True)
class PartsList:
    """A kit and the pieces of all designs that are built from it.

    states : by design, the built states by role: at which angles lamellas cross. Empty: the scenes'
        initial states stand in.
    """

    kit: Kit
    designs: tuple[DesignPieces, ...]
    states: tuple[Mapping[str, State], ...] = ()

    def __repr__(self) -> str:
        names = ", ".join(placed.design.name for placed in self.designs)
        return f"<PartsList of {self.kit!r} for {names}>"

    @cached_property
    def labels(self) -> dict[str, tuple[str, ...]]:
        """kind -> labels of its parts."""
        stems = _stems(self.kit.parts)
        return {
            name: tuple(f"{stems[name]}{k + 1}" for k in range(m))
            for name, m in self.kit.sizes.items()
        }

    @cached_property
    def counts(self) -> dict[str, np.ndarray]:
        """kind -> (n_designs, m) how many pieces of each part every design needs."""
        counts = {
            name: np.zeros((len(self.designs), m), dtype=int) for name, m in self.kit.sizes.items()
        }
        for row, design in enumerate(self.designs):
            for piece in design.pieces:
                counts[piece.kind][row, piece.part] += 1
        return counts

    def label(self, piece: Piece) -> str:
        """The label of the part that a piece is of."""
        return self.labels[piece.kind][piece.part]

    def needed(
        self, names: Iterable[str] | None = None, *, together: bool = False
    ) -> dict[str, np.ndarray]:
        """kind -> (m,) pieces of each part for some designs (default: all).

        together : for all of these standing at the same time; otherwise for one after the other,
            which is as many as the neediest design uses
        Raises InputError for a name that isn't there.
        """
        rows = self._rows(names)
        return {
            kind: counts[rows].sum(axis=0) if together else counts[rows].max(axis=0, initial=0)
            for kind, counts in self.counts.items()
        }

    def named(self, name: str) -> DesignPieces:
        """The pieces of the design of that name. Raises InputError for a name that isn't there."""
        return self.designs[self.row_of(name)]

    def row_of(self, name: str) -> int:
        """The design's place among the designs. Raises InputError for a name that isn't there."""
        return self._rows([name])[0]

    def _rows(self, names: Iterable[str] | None) -> list[int]:
        known = [design.design.name for design in self.designs]
        wanted = known if names is None else list(names)
        for name in wanted:
            if name not in known:
                raise InputError(
                    f"no such design (there are {', '.join(known)})", field="designs", value=name
                )
        return [known.index(name) for name in wanted]


def parts_list(
    kit: Kit,
    assignment: Assignment,
    designs: Sequence[Design],
    elements: Sequence[np.ndarray] | None = None,
) -> PartsList:
    """The pieces of designs that an assignment builds from a kit.

    elements : the designs' parameters, for parts that realise intervals; default: the parts' own
        values

    Raises InputError when the assignment isn't of these designs.
    """
    sizes = [len(group.indices) for design in designs for group in design.groups]
    if sizes != [len(part) for part in assignment.part]:
        raise InputError("the assignment is not of these designs", field="assignment")
    if elements is None:
        q = assignment.matrix(kit) @ kit.vector
        elements = np.split(q, np.cumsum([len(design.parameters) for design in designs])[:-1])
    found, group_number = [], 0
    for design, values in zip(designs, elements):
        pieces: list[Piece] = []
        for group in design.groups:
            kind, chosen = part_kind(group.kind), slice(group_number, group_number + 1)
            pieces += _pieces(
                kind,
                group.indices,
                assignment.part[chosen][0],
                assignment.variant[chosen][0],
                values,
                len(pieces) + 1,
            )
            group_number += 1
        found.append(DesignPieces(design, tuple(pieces)))
    return PartsList(kit, tuple(found))


def parts_list_of(result: KitResult) -> PartsList:
    """The pieces of a kit optimisation's final designs, in the states that they are built in.

    result : of a search, or read from a finished run's folder

    The deployed states lie where their joints fit the target best. The input design's states stand
    in where no equilibrium of the assigned design was found.
    """
    check_kind("result", result, KitResult, "see optimize_kit and load_run")
    found = [
        outcome if isinstance(outcome, Evaluation) else reference
        for outcome, reference in zip(result.stages["assigned"].designs, result.references)
    ]
    q = [
        each.q if isinstance(each, Evaluation) else design.parameters
        for design, each in zip(result.designs, found)
    ]
    realised = result.assignment.realise(result.kit, np.concatenate(q))
    offsets = np.cumsum([0, *(len(one) for one in q)])
    parts = parts_list(
        result.kit, result.assignment, result.designs, np.split(realised, offsets[1:-1])
    )
    states = []
    for design, each in zip(result.designs, found):
        of_roles = {role: eq.state for role, eq in each.equilibria.items()}
        role = design.fitted_role.name
        joints = of_roles[role].positions[design.joints]
        fit = (
            each.fit
            if isinstance(each, Evaluation)
            else TargetFitting(each.target).minimum_zone(joints)
        )
        of_roles[role] = of_roles[role].transformed(
            fit.placement.rotation, fit.placement.translation
        )
        states.append(of_roles)
    return replace(parts, states=tuple(states))


def _pieces(
    kind: PartKind,
    indices: np.ndarray,
    parts: np.ndarray,
    chosen: np.ndarray,
    q: np.ndarray,
    first: int,
) -> list[Piece]:
    """The pieces of one group of elements."""
    variants = kind.variants_of(indices.shape[1])
    # (n_v, k_e): the one part parameter of each element's
    columns = np.abs(variants.matrices).argmax(axis=2)
    return [
        Piece(
            first + n,
            kind.name,
            int(part),
            variants.names[variant],
            tuple(map(int, row)),
            tuple(map(int, columns[variant])),
            tuple(map(float, q[row])),
        )
        for n, (row, part, variant) in enumerate(zip(indices, parts, chosen))
    ]


def _stems(kinds: Mapping[str, object]) -> dict[str, str]:
    """Initials of the kinds, as many letters as tell them apart."""
    for n in range(1, 1 + max(map(len, kinds))):
        stems = {name: name[:n].upper() for name in kinds}
        if len(set(stems.values())) == len(stems):
            return stems
    return {name: name.upper() + "-" for name in kinds}

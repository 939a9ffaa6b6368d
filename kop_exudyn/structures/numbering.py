"""Parameters and elements of straightened curves: the lengths of straight pieces and the angles of
their corners.

They are numbered curve by curve: for each span the lengths from joint to corner and from corner to
joint, then the free ends, then the corner angles. A straight piece runs from corner to corner
through its joint, so a linear element is the two lengths before and after a joint, in the direction
of the curve; at an end without free end the one there is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..geometry.network import Strand
from ..kit.groups import ElementGroup

_SHORTEST = 0.1  # of the median length: shorter pieces are no sensible parts


@dataclass(frozen=True)
class StrandNumbers:
    """Where the parameters of one strand stand in the design's vector q.

    before, after (n_spans,) : lengths from joint to corner, and from corner to joint
    tips : lengths of the free ends before the first and after the last joint, None where there is
        none
    corners (n_spans,) : corner angles
    """

    before: np.ndarray
    after: np.ndarray
    tips: tuple[int | None, int | None]
    corners: np.ndarray

    def around_joints(self, closed: bool) -> list[list[int]]:
        """The one or two lengths around each joint; a loop's first joint comes last."""
        if closed:
            return np.stack([self.after, np.roll(self.before, -1)], axis=1).tolist()
        arriving, leaving = (
            [self.tips[0], *self.after.tolist()],
            [*self.before.tolist(), self.tips[1]],
        )
        return [[n for n in pair if n is not None] for pair in zip(arriving, leaving)]


@dataclass(frozen=True)
class Numbering:
    """parameters (nq,) q; is_length (nq,) bool, else a corner's angle; groups: the elements;
    strands: one a curve."""

    parameters: np.ndarray
    is_length: np.ndarray
    groups: list[ElementGroup]
    strands: tuple[StrandNumbers, ...]

    def replaced(self, values: Mapping[str, Sequence[float]], field: str) -> Numbering:
        """The same pieces with other lengths and corner angles.

        values : "lengths", in the unit of the design, and "angles", rad: in the order of q
        field : that errors name

        Raises InputError for other numbers of values, and for lengths that aren't positive.
        """
        parameters = self.parameters.copy()
        for name, which in (("lengths", self.is_length), ("angles", ~self.is_length)):
            given = np.array(values[name], float)
            if given.shape != (int(which.sum()),):
                raise InputError(
                    f"the straightened curves have {which.sum()} {name}",
                    field=f"{field}.{name}",
                    value=f"{given.size} numbers",
                )
            parameters[which] = given
        shortest = float(parameters[self.is_length].min(initial=np.inf))
        if shortest <= 0:
            raise InputError("must be positive", field=f"{field}.lengths", value=shortest)
        return replace(self, parameters=parameters)

    def split(self, parameters: np.ndarray, digits: int | None = None) -> dict[str, list[float]]:
        """Values for `replaced`: of parameters (nq,), rounded to so many decimals, or as they
        are."""
        rounded = parameters if digits is None else np.round(parameters, digits)
        return {
            "lengths": rounded[self.is_length].tolist(),
            "angles": rounded[~self.is_length].tolist(),
        }

    def bounds(self, largest_corner: float) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (nq,), for corners up to an angle (rad); no shorter length than
        there is already."""
        shortest = _SHORTEST * float(np.median(self.parameters[self.is_length]))
        return (
            np.where(self.is_length, np.minimum(shortest, self.parameters), -largest_corner),
            np.where(self.is_length, np.inf, largest_corner),
        )


def rescaled_values(
    values: Mapping[str, Sequence[float]], factor: float
) -> dict[str, Sequence[float]]:
    """Values for `Numbering.replaced` of a design at another size: lengths times a factor."""
    return {**values, "lengths": [factor * length for length in values["lengths"]]}


def number_pieces(
    strands: Sequence[Strand], lengths: Sequence[np.ndarray], corners: Sequence[np.ndarray]
) -> Numbering:
    """Number the lengths (n_spans, 2) and corner angles (n_spans,) of straightened strands, and
    their free ends."""
    values: list[np.ndarray] = []
    is_length: list[np.ndarray] = []
    numbers: list[StrandNumbers] = []
    first = 0
    for strand, halves, angles in zip(strands, lengths, corners):
        tips = [length for length in (strand.head, strand.tail) if length]
        values += [halves.ravel(), np.array(tips), angles]
        at_tips = first + halves.size
        at_corners = at_tips + len(tips)
        is_length += [np.ones(at_corners - first, bool), np.zeros(len(angles), bool)]
        numbers.append(
            StrandNumbers(
                np.arange(first, at_tips, 2),
                np.arange(first + 1, at_tips, 2),
                (at_tips if strand.head else None, at_corners - 1 if strand.tail else None),
                np.arange(at_corners, at_corners + len(angles)),
            )
        )
        first = at_corners + len(angles)
    return Numbering(
        np.concatenate(values), np.concatenate(is_length), _groups(strands, numbers), tuple(numbers)
    )


def _groups(strands: Sequence[Strand], numbers: Sequence[StrandNumbers]) -> list[ElementGroup]:
    """Whole pieces, pieces of one length, corners: those groups that aren't empty."""
    pieces = [
        piece for strand, own in zip(strands, numbers) for piece in own.around_joints(strand.closed)
    ]
    by_size = {size: [piece for piece in pieces if len(piece) == size] for size in (2, 1)}
    groups = [ElementGroup("linear", np.array(rows)) for rows in by_size.values() if rows]
    corners = np.concatenate([own.corners for own in numbers])
    return groups + ([ElementGroup("angular", corners[:, None])] if len(corners) else [])

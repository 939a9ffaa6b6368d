"""Kinds of parts, and how a part realises an element.

A kind is one module in this folder that registers a `PartKind`; nothing else has to change. All
that the clustering, the assignment and the projection need is linear: an element of parameters q
that part p realises in variant v should be q = V_v p with entries 0, 1 and -1 in V_v. Kinds that
realise an interval instead of a value add a reach W_v >= 0: then every q in [V_v p, (V_v + W_v) p]
is realised, and the distance is that to this box.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError, did_you_mean
from ..plugins import Registry

Bounds = Mapping[str, tuple]  # kind -> (lower, upper), each a number or an array (k_p,)


@dataclass(frozen=True)
class Variants:
    """The ways in which one part can be built in as an element of k_e parameters.

    names : n_v names
    matrices : (n_v, k_e, k_p) V, entries 0, 1 or -1
    reach : (n_v, k_e, k_p) W >= 0, or None where a part realises exactly one element in each
        variant
    """

    names: tuple[str, ...]
    matrices: np.ndarray
    reach: np.ndarray | None = None

    @classmethod
    def of(
        cls, names: tuple[str, ...], matrices: Sequence, reach: Sequence | None = None
    ) -> Variants:
        """The same from nested lists."""
        return cls(
            names, np.array(matrices, float), None if reach is None else np.array(reach, float)
        )

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrices", np.asarray(self.matrices, dtype=float))
        if self.reach is not None:
            object.__setattr__(self, "reach", np.asarray(self.reach, dtype=float))
        products = np.einsum("vek,vel->vkl", self.matrices, self.matrices)
        if not np.array_equal(products, products * np.eye(products.shape[1])):
            raise ValueError(
                "the parts' least-squares problem must be diagonal: one part parameter an element's"
            )

    def residuals(self, elements: np.ndarray, parts: np.ndarray) -> np.ndarray:
        """(n, m, n_v, k_e): elements (n, k_e) minus the nearest that each of the parts (m, k_p)
        realises."""
        nearest = np.einsum("vek,mk->mve", self.matrices, parts)
        difference = elements[:, None, None, :] - nearest
        if self.reach is None:
            return difference
        width = np.einsum("vek,mk->mve", self.reach, parts)
        return difference - np.clip(difference, 0, width)

    def contact(
        self, elements: np.ndarray, variant: np.ndarray, parts: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The linear maps that the elements (n, k_e) are compared with, in variant (n,) of the
        parts (n, k_p).

        Returns A (n, k_e, k_p) and active (n, k_e): the residual is q - A p where active, else
        zero.
        """
        rows = self.matrices[variant]
        if self.reach is None:
            return rows, np.ones(elements.shape, dtype=bool)
        reach = self.reach[variant]
        difference = elements - np.einsum("nek,nk->ne", rows, parts)
        width = np.einsum("nek,nk->ne", reach, parts)
        beyond = difference > width
        return rows + np.where(beyond[:, :, None], reach, 0.0), beyond | (difference < 0)

    def lift(self, elements: np.ndarray, near: np.ndarray | None = None) -> np.ndarray:
        """(n, k_p) parts that realise the elements (n, k_e) exactly as they are (in the first
        variant).

        What an element leaves open (the other side of an end element's part) is taken from the
        parts `near` (n, k_p), without them from the element's other variants.
        """
        first = np.linalg.pinv(self.matrices[0])
        if near is None:
            near = elements @ np.linalg.pinv(self.matrices.mean(axis=0)).T
        return near + (elements - near @ self.matrices[0].T) @ first.T


@dataclass(frozen=True)
class PartKind:
    """One kind of parts.

    name : as in `ElementGroup.kind`
    parameter_names : names of the k_p part parameters
    variants : k_e -> Variants, for each number of parameters that elements of this kind may have
    canonical : parts (m, k_p) -> the same parts in their standard form
    lower, upper : (k_p,) natural bounds
    angular : whether the parameters are angles (scale 1) or lengths (scale: the inputs' median)
    penalty : (k_p,) weights of 1/2 (p / scale)^2, averaged over the kind's parts, in the projection
        energy
    limits : (r, k_p) A: every part has A p <= 0. A row has one positive entry, and that in a
        parameter which may be lowered to 0
    serves : another kind whose elements these parts are made for as well, where a kit has none of
        that kind
    """

    name: str
    parameter_names: tuple[str, ...]
    variants: Mapping[int, Variants]
    canonical: Callable[[np.ndarray], np.ndarray]
    lower: np.ndarray
    upper: np.ndarray
    angular: bool = False
    penalty: np.ndarray | None = None
    limits: np.ndarray | None = None
    serves: str | None = None

    @property
    def n_parameters(self) -> int:
        return len(self.parameter_names)

    def variants_of(self, n_parameters: int) -> Variants:
        """Variants for elements of that many parameters; InputError where this kind has no such
        elements."""
        if n_parameters not in self.variants:
            known = ", ".join(map(str, sorted(self.variants)))
            raise InputError(
                f"{self.name} elements have {known} parameters",
                field="elements",
                value=n_parameters,
            )
        return self.variants[n_parameters]

    @property
    def realises_intervals(self) -> bool:
        """Whether an element of such a part may have more than one value."""
        return any(variants.reach is not None for variants in self.variants.values())

    def limited(self, parts: np.ndarray) -> np.ndarray:
        """(m, k_p) parts of which no more is taken than their limits allow."""
        found = np.array(parts, dtype=float)
        for row in () if self.limits is None else self.limits:
            at = int(row.argmax())
            most = -(found @ row - found[:, at] * row[at]) / row[at]
            found[:, at] = np.minimum(found[:, at], np.maximum(most, 0.0))
        return found

    def scale(self, values: np.ndarray) -> float:
        """The length that makes this kind's distances dimensionless: median of the input elements'
        parameters."""
        return 1.0 if self.angular else float(np.median(np.abs(values)))

    def bounds(self, bounds: Bounds | None = None) -> tuple[np.ndarray, np.ndarray]:
        """(k_p,), (k_p,): the natural bounds, narrowed by the user's; InputError when nothing lies
        between them."""
        lower, upper = np.array(self.lower, dtype=float), np.array(self.upper, dtype=float)
        if bounds and self.name in bounds:
            try:
                least, most = (
                    np.broadcast_to(np.asarray(b, dtype=float), lower.shape)
                    for b in bounds[self.name]
                )
            except (TypeError, ValueError):
                raise InputError(
                    f"expected a lower and an upper bound, numbers or {len(lower)} of them each",
                    field=f"bounds.{self.name}",
                    value=bounds[self.name],
                ) from None
            lower, upper = np.maximum(lower, least), np.minimum(upper, most)
        if not np.all(lower <= upper):
            raise InputError(
                "no part lies within these bounds",
                field=f"bounds.{self.name}",
                value=(lower.tolist(), upper.tolist()),
            )
        return lower, upper


KINDS: Registry[PartKind] = Registry(__package__)


def register_kind(kind: PartKind) -> PartKind:
    """Make a kind of parts known under its name."""
    KINDS.add(kind.name, kind)
    return kind


def kind_names() -> list[str]:
    """Names of all kinds, sorted."""
    return KINDS.names()


def part_kind(name: str) -> PartKind:
    """The kind of that name; InputError when there is none."""
    kind = KINDS.get(name)
    if kind is None:
        raise InputError(
            f"unknown kind of parts ({did_you_mean(name, kind_names())}"
            f"known: {', '.join(kind_names())})",
            field="parts",
            value=name,
        )
    return kind


def has_joint(kind: PartKind) -> bool:
    """Whether a kind's parts are beams with a joint between two sides."""
    return kind.parameter_names[:2] == ("l1", "l2")

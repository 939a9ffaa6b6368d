"""Cluster elements into parts: k-means over (part, variant), started by D^2 sampling (k-means++),
and improved by moving parts from where they are missed least to where they gain most.

Arthur and Vassilvitskii, "k-means++: the advantages of careful seeding" (SODA 2007); Franti and
Kivijarvi, "Randomised local search algorithm for the clustering problem" (Pattern Analysis and
Applications 3, 2000), whose swaps are here tried in the order of what they promise. Distances are
those of an element to the best variant of a part. End elements take part in the clustering and use
one side of a linear part. Kinds of one parameter are clustered exactly (see intervals.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Parameters
from ..checks import check_kind, check_whole
from ..errors import InputError
from .assign import to_assignment
from .elements import KindElements, Labels, Penalties, collect
from .groups import ElementGroup, check_groups
from .intervals import optimal_centres
from .kinds import Bounds, part_kind
from .parts import Assignment, Kit

_MAX_ITERATIONS = 300
_EQUAL = 1e-10
_GAIN = 1e-9  # relative; a swap that gains less might be undone by the next one


@dataclass(frozen=True)
class Clustering:
    """A kit, the nearest assignment to it, and by kind the mean of half the squared relative
    distances."""

    kit: Kit
    assignment: Assignment
    energy: dict[str, float]


def cluster(
    groups: Sequence[ElementGroup],
    q: Parameters,
    parts: Mapping[str, int],
    *,
    bounds: Bounds | None = None,
    restarts: int = 20,
    seed: int = 0,
    penalties: Penalties | None = None,
) -> Clustering:
    """The best kit of several seeded k-means runs, improved by swaps.

    groups : the elements
    q : (n_q,) parameters that the groups index; lengths in the designs' unit, angles in rad
    parts : kind -> number of parts
    bounds : kind -> (lower, upper) of the parts' parameters, besides the natural ones
    restarts : runs from different parts, one at least
    seed : of these parts; the same one gives the same kit
    penalties : kind -> weights of the parts' own energy, for kinds such as "slit"

    Parts come in canonical form and sorted; where there are fewer distinct elements than parts,
    parts repeat. Raises InputError for more parts than elements, kinds without a number of parts or
    without elements, empty bounds.
    """
    check_whole("restarts", restarts, least=1)
    check_whole("seed", seed)
    check_kind("parts", parts, Mapping, "kind of part -> number of parts")
    check_groups(groups, q)
    elements = collect(groups, q, penalties=penalties)
    rounded = collect(groups, _rounded(groups, q), penalties=penalties)
    _check_request(elements, parts)
    for name in bounds or ():
        part_kind(name)  # a misspelt kind would leave its parts unbounded
    found, labels, energy = {}, {}, {}
    for name, e in elements.items():
        limits, near = e.kind.bounds(bounds), rounded[name]
        best = _best_found(near, parts[name], limits, restarts, seed)
        if e.exact:
            best = best_parts(e, best, near.nearest(best), *limits)
        canonical = e.kind.canonical(best)
        found[name] = canonical[np.lexsort(canonical.T[::-1])]
        labels[name] = _measured(e, found[name], near.nearest(found[name]))
        energy[name] = e.energy(found[name], labels[name])
    return Clustering(Kit(found), to_assignment(groups, len(q), elements, labels), energy)


def _rounded(groups: Sequence[ElementGroup], q: np.ndarray) -> np.ndarray:
    """Parameters q (n_q,) by which elements and parts are compared: to 1e-10 of the largest of
    their kind. Symmetric designs have equal elements, of which rounding would choose, and choose
    others when the design is moved or turned."""
    found = np.array(q, float)
    for kind in {group.kind for group in groups}:
        own = np.concatenate([g.indices.ravel() for g in groups if g.kind == kind])
        largest = np.abs(found[own]).max(initial=0.0)
        if np.isfinite(largest) and largest > 0:
            step = 2.0 ** np.floor(np.log2(_EQUAL * largest))
            found[own] = np.round(found[own] / step) * step
    return found


def _best_found(
    elements: KindElements,
    m: int,
    limits: tuple[np.ndarray, np.ndarray],
    restarts: int,
    seed: int,
) -> np.ndarray:
    """(m, k_p) parts: optimal ones of one parameter, others by restarts and swaps."""
    numbers = elements.numbers
    if numbers is not None:
        return optimal_centres(numbers, m, float(limits[0][0]), float(limits[1][0]))[0][:, None]
    runs = [_run(elements, m, limits, np.random.default_rng([seed, k])) for k in range(restarts)]
    best = min(runs, key=lambda run: elements.energy(*run))
    return swapped(elements, *best, limits)[0]


def swapped(
    elements: KindElements,
    parts: np.ndarray,
    labels: Labels,
    limits: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, Labels]:
    """Parts (m, k_p) and labels that no swap improves any more.

    A swap gives up one part, whose elements go to their second nearest one, for another one at the
    worst served element of some part. The 2 m that promise most are tried, each followed by
    `lloyd`, and the first that lowers the energy is kept.
    """
    m, rows = len(parts), np.arange(elements.n)
    energy = elements.energy(parts, labels)
    improved = m > 1
    while improved:
        improved = False
        others = elements.costs(parts)[0]
        others[rows, labels.part] = np.inf
        missed = np.bincount(labels.part, others.min(axis=1) - labels.squared, minlength=m)
        spread = np.bincount(labels.part, labels.squared, minlength=m)
        promise = missed[:, None] - 0.5 * spread[None]
        np.fill_diagonal(promise, np.inf)
        for pair in np.argsort(promise, axis=None, kind="stable")[: 2 * m]:
            given, split = divmod(int(pair), m)
            own = np.flatnonzero(labels.part == split)
            if given == split or not len(own):
                continue
            worst = int(own[labels.squared[own].argmax()])
            trial = parts.copy()
            trial[given] = np.clip(elements.lift(worst, parts[split]), *limits)
            found = lloyd(elements, trial, *limits)
            value = elements.energy(*found)
            if value < energy * (1 - _GAIN):
                (parts, labels), energy, improved = found, value, True
                break
    return parts, labels


def lloyd(
    elements: KindElements, parts: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, Labels]:
    """Alternate nearest labels and best parts from parts (m, k_p) until neither changes.

    Returns parts that are best for the labels, and the labels. The energy never increases.
    """
    parts = np.clip(parts, lower, upper)
    labels = elements.nearest(parts)
    energy = elements.energy(parts, labels)
    for _ in range(_MAX_ITERATIONS):
        better = best_parts(elements, parts, labels, lower, upper)
        moved, new_labels = _repair(elements, better, elements.nearest(better), lower, upper)
        new_energy = elements.energy(moved, new_labels)
        still = elements.exact or np.abs(moved - parts).max() <= 1e-13 * elements.scale
        settled = still and new_labels.same(labels)
        if settled or new_energy >= energy:
            # Without a decrease the labels differ by ties or round-off only: the parts must fit the
            # labels returned.
            return better, _measured(elements, better, labels)
        parts, labels, energy = moved, new_labels, new_energy
    return parts, labels


def best_parts(
    elements: KindElements, parts: np.ndarray, labels: Labels, lower: np.ndarray, upper: np.ndarray
) -> np.ndarray:
    """(m, k_p) least-squares parts for these labels; parameters that no element uses stay as they
    are in `parts`.

    With interval parts the energy is only piecewise quadratic: then one safeguarded Newton step
    towards them.
    """
    normal, right = elements.normal_equations(parts, labels)
    if elements.exact:
        diagonal = np.einsum("mkk->mk", normal)
        used = diagonal > 0
        return np.clip(np.where(used, right / np.where(used, diagonal, 1.0), parts), lower, upper)
    return _newton_step(elements, parts, labels, normal, right, (lower, upper))


def _newton_step(
    elements: KindElements,
    parts: np.ndarray,
    labels: Labels,
    normal: np.ndarray,
    right: np.ndarray,
    limits: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Minimise the present quadratic piece within the bounds, halving the step while the energy
    rises."""
    gradient = np.einsum("mkl,ml->mk", normal, parts) - right
    free = ~((parts <= limits[0]) & (gradient > 0) | (parts >= limits[1]) & (gradient < 0))
    goal = parts
    for _ in range(parts.shape[1]):  # each round fixes the parameters that run into a bound
        held = np.where(free, 0.0, goal - parts)
        rhs = np.where(free, -(gradient + np.einsum("mkl,ml->mk", normal, held)), 0.0)
        step = (
            np.einsum(
                "mkl,ml->mk", np.linalg.pinv(normal * free[:, :, None] * free[:, None, :]), rhs
            )
            + held
        )
        goal = np.clip(parts + step, *limits)
        free &= goal == parts + step
    before = elements.energy(parts, _measured(elements, parts, labels))
    for halving in range(30):
        trial = parts + 0.5**halving * (goal - parts)
        if elements.energy(trial, _measured(elements, trial, labels)) <= before:
            return trial
    return parts


def _measured(elements: KindElements, parts: np.ndarray, labels: Labels) -> Labels:
    """The same labels with their distances to other parts."""
    squared = np.empty(elements.n)
    for block, span in zip(elements.blocks, elements.spans):
        rows, active = block.contact(parts, labels, span)
        residual = block.values - np.einsum("nek,nk->ne", rows, parts[labels.part[span]])
        squared[span] = np.sum(np.where(active, residual, 0.0) ** 2, axis=1)
    return replace(labels, squared=squared)


def _run(
    elements: KindElements, m: int, limits: tuple[np.ndarray, np.ndarray], rng: np.random.Generator
) -> tuple[np.ndarray, Labels]:
    return lloyd(elements, _sample_parts(elements, m, limits, rng), *limits)


def _sample_parts(
    elements: KindElements, m: int, limits: tuple[np.ndarray, np.ndarray], rng: np.random.Generator
) -> np.ndarray:
    """(m, k_p) k-means++ start: each next part at an element drawn with probability ~ its squared
    distance so far."""
    first = int(rng.integers(len(elements.blocks[0].values)))
    parts = [np.clip(elements.lift(first), *limits)]
    squared, owner = elements.nearest(parts[0][None]).squared, np.zeros(elements.n, dtype=int)
    while len(parts) < m:
        total = squared.sum()
        # all distinct elements have their part: repeat parts
        if squared.max() <= (1e-12 * elements.scale) ** 2:
            parts.append(parts[len(parts) % len(np.unique(owner))])
            continue
        chosen = int(rng.choice(elements.n, p=squared / total))
        parts.append(np.clip(elements.lift(chosen, parts[owner[chosen]]), *limits))
        distance = elements.nearest(parts[-1][None]).squared
        owner = np.where(distance < squared, len(parts) - 1, owner)
        squared = np.minimum(distance, squared)
    return np.array(parts)


def _repair(
    elements: KindElements, parts: np.ndarray, labels: Labels, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, Labels]:
    """Move parts that serve no element to the worst served one, as long as that helps."""
    for _ in range(len(parts)):
        empty = np.flatnonzero(np.bincount(labels.part, minlength=len(parts)) == 0)
        worst = int(labels.squared.argmax())
        if len(empty) == 0 or labels.squared[worst] <= (1e-12 * elements.scale) ** 2:
            break
        moved = parts.copy()
        moved[empty[0]] = np.clip(elements.lift(worst, parts[labels.part[worst]]), lower, upper)
        new_labels = elements.nearest(moved)
        if elements.energy(moved, new_labels) >= elements.energy(parts, labels):
            break
        parts, labels = moved, new_labels
    return parts, labels


def _check_request(elements: Mapping[str, KindElements], parts: Mapping[str, int]) -> None:
    for name, count in parts.items():
        part_kind(name)
        if name not in elements:
            raise InputError(
                "the designs have no elements of this kind "
                f"(theirs are {', '.join(sorted(elements))})",
                field=f"parts.{name}",
                value=count,
            )
        if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or count < 1:
            raise InputError(
                "expected a whole number of parts, at least 1", field=f"parts.{name}", value=count
            )
        if count > elements[name].n:
            raise InputError(
                f"more parts than elements ({elements[name].n})", field=f"parts.{name}", value=count
            )
    for name in elements:
        if name not in parts:
            raise InputError(
                "the designs have elements of this kind: say how many parts", field=f"parts.{name}"
            )

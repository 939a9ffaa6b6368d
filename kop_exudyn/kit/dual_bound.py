"""A proven lower bound on the energy of every clustering, from prices of the elements.

With elements' prices y and the earnings e(p) of a part at these prices (see pricing.py), every
clustering of m parts costs at least

    D(y) = sum_j y_j - m max_p e(p),

the Lagrangian dual of clustering as set partitioning, where each element is served once by m
parts: du Merle, Hansen, Jaumard and Mladenovic, "An interior point algorithm for minimum
sum-of-squares clustering" (SIAM J. Scientific Computing 21, 2000); Aloise, Hansen and Liberti, "An
improved column generation algorithm for minimum sum-of-squares clustering" (Mathematical
Programming 131, 2012). Any prices give a bound; good ones are found by a proximal bundle method
(Kiwiel, "Proximity control in bundle methods for convex nondifferentiable minimization",
Mathematical Programming 46, 1990), whose cuts are parts with the elements that they serve.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from ..sqp.qp import QP, QPOptions, QPSolver
from .pricing import Pricing

_CUTS = 250  # kept from step to step, those first that the last master problem used
_NEW_CUTS = 80  # a step, at most
_GOOD = 0.5  # of the largest earnings; parts that earn less give no cut
_FIRST_SPREADS = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0)  # of prices, over the mean cost of their cluster
_MASTER = QPOptions(accept=1e-4, eps=1e-7)  # prices need no more digits: the bound holds for any


@dataclass(frozen=True)
class DualBound:
    """What the bundle method found.

    bound : no clustering has a smaller sum of squared distances, in units of the scale's square
    parts : (N, k_p) those of the cuts that the last master problem used, in units of the scale
    steps : of the bundle method
    """

    bound: float
    parts: np.ndarray
    steps: int


@dataclass
class _Cuts:
    """Parts with the rows that they serve (N, n), what these cost (N,), and multipliers (N,)."""

    parts: np.ndarray
    served: np.ndarray
    cost: np.ndarray
    multipliers: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.multipliers = np.ones(len(self.cost))

    def add(self, other: _Cuts, slack_at: np.ndarray) -> None:
        """Take in other cuts; too many are sorted out by use, then by slack at weighted prices."""
        used = np.append(self.multipliers, np.ones(len(other.cost)))
        self.parts = np.concatenate([self.parts, other.parts])
        self.served = np.concatenate([self.served, other.served])
        self.cost = np.append(self.cost, other.cost)
        if len(self.cost) > _CUTS:
            earned = self.served @ slack_at - self.cost
            keep = np.lexsort((-earned, used <= 1e-6))[:_CUTS]
            self.parts, self.served, self.cost = (
                self.parts[keep], self.served[keep], self.cost[keep],
            )  # fmt: skip
            used = used[keep]
        self.multipliers = used


def lower_bound(
    pricing: Pricing, parts: np.ndarray, *, gap: float = 1e-2, most_steps: int = 60
) -> DualBound:
    """The best bound found for clusterings of as many parts as given.

    parts : (m, k_p) of a good clustering, in units of the scale
    gap : relative to that clustering's cost; ends when the bound is that close to it, or to what
        the cuts still promise
    most_steps : ends then at the latest. The steps don't look at the clock, so the bound is
        the same on a busy machine
    """
    m, weights = len(parts), pricing.weights
    squared = pricing.squared(parts)
    owner, own = squared.argmin(axis=1), squared.min(axis=1)
    cost = float(weights @ own + pricing.own_cost(parts).sum())
    if cost <= 1e-20:
        return DualBound(0.0, parts, 0)
    prices = _first_prices(pricing, parts, owner, own)
    centre, best, promised = prices, -np.inf, np.inf
    reach, tolerance = 0.5 * cost / weights.sum(), 1e-2
    cuts = _Cuts(parts[:0], np.empty((0, len(own)), dtype=bool), np.empty(0))
    step = 0
    while True:
        found, most = _priced(pricing, prices, parts, cuts, tolerance)
        value = float(weights @ prices) - m * most
        if step and value - best > 0.3 * (promised - best):
            reach *= 1.5
        elif step and best - value > promised - best:
            reach *= 0.6
        if value > best:
            best, centre = value, prices
        cuts.add(_cuts_of(pricing, prices, found, not len(cuts.cost)), weights * centre)
        prices = _master(cuts, weights, centre, reach, m)
        promised = float(weights @ prices) - m * float(
            (cuts.served @ (weights * prices) - cuts.cost).max()
        )
        step += 1
        done = min(cost, promised) - best <= gap * cost
        if done or step == most_steps:
            break
        tolerance = min(tolerance, max(0.2 * (promised - best) / cost, 0.1 * gap))
    rounding = 1e-9 * cost  # of sums in double precision
    bound = max(0.0, np.sqrt(max(best - rounding, 0.0)) - pricing.displacement) ** 2
    return DualBound(min(bound, cost), cuts.parts[cuts.multipliers > 1e-6], step)


def _first_prices(
    pricing: Pricing, parts: np.ndarray, owner: np.ndarray, own: np.ndarray
) -> np.ndarray:
    """(n,) prices in proportion to the mean cost in an element's cluster, the best of several."""
    m, weights = len(parts), pricing.weights
    totals = np.bincount(owner, weights * own, minlength=m)
    means = totals / np.maximum(np.bincount(owner, weights, minlength=m), 1)
    base = np.maximum(means[owner], 1e-3 * means.max())

    def value(spread: float) -> float:
        earned = pricing.improved(spread * base, parts)[1].max()
        return float(weights @ base) * spread - m * float(earned)

    return max(_FIRST_SPREADS, key=value) * base


def _priced(
    pricing: Pricing, prices: np.ndarray, parts: np.ndarray, cuts: _Cuts, tolerance: float
) -> tuple[np.ndarray, float]:
    """Parts that earn much at these prices, and the bound on what any part earns."""
    used = cuts.parts[cuts.multipliers > 1e-6]
    known, earned = pricing.improved(prices, np.concatenate([parts, used]), 3)
    most, good = pricing.most_earned(prices, float(earned.max()), tolerance)
    order = np.argsort(-pricing.earnings(prices, good), kind="stable")[:200]
    better, _ = pricing.improved(prices, good[order], 2)
    return np.concatenate([parts, known, better]), most


def _cuts_of(pricing: Pricing, prices: np.ndarray, parts: np.ndarray, needed: bool) -> _Cuts:
    """The cuts of the parts that earn most, one for each set of served rows; where they are needed,
    at least one."""
    earned = pricing.earnings(prices, parts)
    order = np.argsort(-earned, kind="stable")
    good = earned[order] > _GOOD * earned.max()
    # there has to be a cut, also where no part earns anything, as bounds keep all of them far away
    order = order[good] if good.any() or not needed else order[:1]
    squared = pricing.squared(parts[order])
    served = prices[None] > squared.T
    first = np.sort(np.unique(served, axis=0, return_index=True)[1])[:_NEW_CUTS]
    chosen = parts[order][first]
    cost = (served[first] * squared.T[first]) @ pricing.weights + pricing.own_cost(chosen)
    return _Cuts(chosen, served[first], cost)


def _master(
    cuts: _Cuts, weights: np.ndarray, centre: np.ndarray, reach: float, m: int
) -> np.ndarray:
    """(n,) prices that maximise what the cuts promise, less the weighted squared distance to the
    centre over twice the reach; by its dual, a quadratic programme over the cuts' multipliers."""
    weighted = cuts.served * weights
    slack = cuts.cost - weighted @ centre
    hessian = reach * (weighted @ cuts.served.T.astype(float))
    gradient = slack - reach * weighted.sum(axis=1)
    size = max(float(np.abs(gradient).max()), np.finfo(float).tiny)
    n = len(gradient)
    one = np.array([float(m)])
    solution = QPSolver(_MASTER).solve(
        QP(
            sp.csc_matrix(0.5 * (hessian + hessian.T) / size),
            gradient / size,
            sp.csr_matrix(np.ones((1, n))),
            one,
            one,
            np.zeros(n),
            np.full(n, np.inf),
        )
    )
    cuts.multipliers = np.maximum(solution.x, 0.0)
    return centre + reach * (1.0 - cuts.served.T @ cuts.multipliers)

"""Second-order jets: a function of two variables with its exact first and second derivatives,
carried through formulas.

A surface x(u, v) is written once, as its textbook formula; tangents and curvatures follow without
differences.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Jet:
    """value (n,), gradient (n, 2), hessian (n, 2, 2) in (u, v)."""

    value: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray

    __array_ufunc__ = None  # numpy arrays leave mixed arithmetic to the jet

    def __add__(self, other: Jet | float) -> Jet:
        if isinstance(other, Jet):
            return Jet(
                self.value + other.value,
                self.gradient + other.gradient,
                self.hessian + other.hessian,
            )
        return Jet(self.value + other, self.gradient, self.hessian)

    def __mul__(self, other: Jet | float) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, self.gradient * other, self.hessian * other)
        mixed = self.gradient[:, :, None] * other.gradient[:, None, :]
        return Jet(
            self.value * other.value,
            self.value[:, None] * other.gradient + other.value[:, None] * self.gradient,
            self.value[:, None, None] * other.hessian
            + other.value[:, None, None] * self.hessian
            + mixed
            + np.swapaxes(mixed, 1, 2),
        )

    def __neg__(self) -> Jet:
        return self * -1.0

    def __sub__(self, other: Jet | float) -> Jet:
        return self + -other

    def __rsub__(self, other: float) -> Jet:
        return -self + other

    def __truediv__(self, other: Jet | float) -> Jet:
        return self * other**-1 if isinstance(other, Jet) else self * (1.0 / other)

    def __rtruediv__(self, other: float) -> Jet:
        return self**-1 * other

    def __pow__(self, power: int) -> Jet:
        """Integer powers; the zeroth is 1, also at 0."""
        x, k = self.value, int(power)
        return self.compose(
            x ** float(k),
            k * x ** float(k - 1) if k else 0 * x,
            k * (k - 1) * x ** float(k - 2) if k not in (0, 1) else 0 * x,
        )

    __radd__, __rmul__ = __add__, __mul__

    def compose(self, f: np.ndarray, first: np.ndarray, second: np.ndarray) -> Jet:
        """The jet of f(self), given f and its derivatives (n,) at this jet's values."""
        g = self.gradient
        return Jet(
            f,
            first[:, None] * g,
            first[:, None, None] * self.hessian
            + second[:, None, None] * (g[:, :, None] * g[:, None, :]),
        )


def variables(uv: np.ndarray) -> tuple[Jet, Jet]:
    """The jets of u and v themselves at points (n, 2)."""
    n = len(uv)
    zero = np.zeros((n, 2, 2))
    u, v = (Jet(uv[:, k].astype(float), np.tile(np.eye(2)[k], (n, 1)), zero) for k in range(2))
    return u, v


def constant(value: float, like: Jet) -> Jet:
    """A jet without derivatives."""
    return like * 0.0 + value


def _function(f: Callable, first: Callable, second: Callable) -> Callable[[Jet], Jet]:
    return lambda x: x.compose(f(x.value), first(x.value), second(x.value))


sin = _function(np.sin, np.cos, lambda x: -np.sin(x))
cos = _function(np.cos, lambda x: -np.sin(x), lambda x: -np.cos(x))
exp = _function(np.exp, np.exp, np.exp)
log = _function(np.log, lambda x: 1 / x, lambda x: -1 / x**2)
sinh = _function(np.sinh, np.cosh, np.sinh)
cosh = _function(np.cosh, np.sinh, np.cosh)
tanh = _function(np.tanh, lambda x: np.cosh(x) ** -2, lambda x: -2 * np.tanh(x) * np.cosh(x) ** -2)

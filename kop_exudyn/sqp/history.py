"""What the SQP solver did: a record for each accepted step, and the state from which it can go
on."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field

import numpy as np

from ..errors import InputError


@dataclass(frozen=True)
class StepRecord:
    """One accepted step.

    step : its number, from 1
    value : objective after it
    gradient_norm : projected gradient before it, in scaled variables
    predicted, actual : reduction of the objective by the model and in truth
    damping : multiple of diag(1/scale^2) that the trust region added to the Hessian
    radius : trust radius that the step was taken with; length : of the step; both in scaled
        variables
    trials, failures : points evaluated for this step, and those of them that could not be simulated
    active : bounds and constraints that push
    convexified : whether the model Hessian was indefinite and had to be modified
    solver : the QP solver used
    excess : the largest by which a nonlinear bound is exceeded after the step
    penalty : weight of the bounds' excess in the reductions
    seconds : wall time by phase, of ``derivatives``, ``qp`` and ``evaluate``
    """

    step: int
    value: float
    gradient_norm: float
    predicted: float
    actual: float
    damping: float
    radius: float
    length: float
    trials: int
    failures: int
    active: int
    convexified: bool
    solver: str
    seconds: dict[str, float]
    excess: float = 0.0
    penalty: float = 0.0


@dataclass(frozen=True)
class SQPState:
    """All that a run needs to go on exactly as if it had not been interrupted; plain arrays and
    numbers.

    x : (n,) last accepted point;  radius : trust radius;  step : accepted steps so far
    gradient_scale : projected gradient at the start, which tolerances refer to
    y, z : multipliers of the last QP, its next warm start
    penalty : that a nonlinear bound's excess is weighted with;  pressure : (k,) multipliers of
        these bounds
    quasi_newton : arrays of BlockBFGS, empty with exact Hessians
    """

    x: np.ndarray
    radius: float
    step: int = 0
    evaluations: int = 0
    failures: int = 0
    gradient_scale: float = 0.0
    y: np.ndarray = field(default_factory=lambda: np.zeros(0))
    z: np.ndarray = field(default_factory=lambda: np.zeros(0))
    penalty: float = 0.0
    pressure: np.ndarray = field(default_factory=lambda: np.zeros(0))
    quasi_newton: dict[str, np.ndarray] = field(default_factory=dict)
    history: tuple[StepRecord, ...] = ()

    def to_arrays(self) -> dict[str, np.ndarray]:
        """For ``numpy.savez``; no pickling needed."""
        numbers = np.array(
            [
                self.radius,
                self.step,
                self.evaluations,
                self.failures,
                self.gradient_scale,
                self.penalty,
            ]
        )
        arrays = {
            "x": self.x,
            "numbers": numbers,
            "y": self.y,
            "z": self.z,
            "pressure": self.pressure,
        }
        arrays["history"] = np.array(json.dumps([asdict(record) for record in self.history]))
        return arrays | {f"quasi_newton.{name}": value for name, value in self.quasi_newton.items()}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> SQPState:
        """The state that ``to_arrays`` came from, bit for bit. Raises InputError for arrays of
        something else."""
        try:
            return cls._from_arrays(arrays)
        except InputError as error:
            raise InputError(error.message, field=f"sqp/{error.field}") from None
        # ValueError: also that of the JSON reader
        except (KeyError, TypeError, ValueError, RecursionError, AttributeError) as error:
            raise InputError(
                f"not the state of an optimisation ({type(error).__name__})", field="sqp"
            ) from None

    @classmethod
    def _from_arrays(cls, arrays: dict[str, np.ndarray]) -> SQPState:
        numbers = _numbers(arrays, "numbers", 6)
        radius, step, evaluations, failures, gradient_scale, penalty = numbers.tolist()
        # a radius without limit is infinite
        counts = numbers[1:4]
        if not (radius > 0 and (numbers >= 0).all() and np.isfinite(counts).all()):
            raise ValueError("radii and counts can't be negative")
        quasi_newton = {
            name.removeprefix("quasi_newton."): np.array(arrays[name])
            for name in arrays
            if name.startswith("quasi_newton.")
        }
        for name, array in quasi_newton.items():
            if array.dtype.kind not in "bfiu" or not np.isfinite(array).all():
                raise InputError("expected finite numbers", field=f"quasi_newton.{name}")
        history = arrays["history"]
        if history.dtype.kind != "U" or history.shape:
            raise ValueError("the history isn't a text")
        records = tuple(StepRecord(**record) for record in json.loads(str(history)))
        if len(records) != step:
            raise ValueError(f"{len(records)} records of {step:g} steps")
        return cls(
            _finite(arrays, "x"),
            float(radius),
            int(step),
            int(evaluations),
            int(failures),
            float(gradient_scale),
            _finite(arrays, "y"),
            _finite(arrays, "z"),
            float(penalty),
            _finite(arrays, "pressure"),
            quasi_newton,
            records,
        )


def _numbers(arrays: dict[str, np.ndarray], name: str, count: int | None = None) -> np.ndarray:
    """(count,) one of the arrays, as floats. Raises InputError for another kind or shape."""
    array = np.asarray(arrays[name])
    if array.dtype.kind not in "fiu" or array.ndim != 1 or count not in (None, len(array)):
        raise InputError(
            f"expected numbers in one row, got {array.dtype} of {array.shape}", field=name
        )
    return np.array(array, float)


def _finite(arrays: dict[str, np.ndarray], name: str) -> np.ndarray:
    array = _numbers(arrays, name)
    if not np.isfinite(array).all():
        raise InputError("contains numbers that are not finite", field=name)
    return array

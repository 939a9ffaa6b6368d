"""Weights of the objective's terms, by the terms' names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real

from ..checks import check_positive
from ..errors import InputError
from ..structures.base import Design
from .terms.base import term_class


@dataclass(frozen=True)
class Weights:
    """Weights of the objective's terms; a term of weight zero is not computed.

    fit : beta, on T / l0^2
    energy : gamma, on E / E0
    share : of the target positions in T; the rest is closest points
    level : share of the size beyond which distances from the target count with their fourth power,
        see `TargetFitting`; None: never
    others : (name, weight) of other terms, see the modules of `terms/`; `Weights.of` takes all by
        name

    Raises InputError for unknown terms, and for weights that are negative or not finite.
    """

    fit: float = 1e4
    energy: float = 0.02
    share: float = 0.1
    level: float | None = None
    others: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        if self.level is not None:
            check_positive("weights.level", self.level)
        for name, weight in self.of_terms().items():
            term_class(name)
            known = isinstance(weight, Real) and not isinstance(weight, bool)
            if not (known and 0 <= weight < float("inf")):
                raise InputError(
                    "a weight is a finite number, not negative",
                    field=f"weights.{name}",
                    value=weight,
                )
        if not (isinstance(self.share, Real) and 0 <= self.share <= 1):
            raise InputError("must lie in [0, 1]", field="weights.share", value=self.share)

    @classmethod
    def of(cls, values: Mapping[str, float]) -> Weights:
        """Weights by the names of the terms (and "share"); those not given have their defaults."""
        own = {name: values[name] for name in ("fit", "energy", "share", "level") if name in values}
        return cls(
            **own,
            others=tuple(
                sorted((name, weight) for name, weight in values.items() if name not in own)
            ),
        )

    @classmethod
    def suiting(
        cls, designs: Sequence[Design], values: Mapping[str, float] | None = None
    ) -> Weights:
        """Weights of fit and stress that suit the designs' class (see `Design.fit_weight`,
        `Design.stress_weight`), unless values say else."""
        own = {"fit": max(design.fit_weight for design in designs)}
        if stress := max(design.stress_weight for design in designs):
            own["stress"] = stress
        return cls.of({**own, **(values or {})})

    def of_terms(self) -> dict[str, float]:
        """Weights by the terms' names."""
        return {"fit": self.fit, "energy": self.energy, **dict(self.others)}

    def to_dict(self) -> dict[str, float]:
        """What `of` takes."""
        felt = {} if self.level is None else {"level": self.level}
        own = {"fit": self.fit, "energy": self.energy, "share": self.share}
        return {**own, **felt, **dict(self.others)}

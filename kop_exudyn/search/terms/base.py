"""What a term of a design's objective offers: its value in a state, and its derivatives there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, TypeVar

import numpy as np

from ...equilibrium.equilibria import Equilibrium
from ...equilibrium.sensitivities import Sensitivities
from ...errors import InputError, did_you_mean
from ...plugins import Registry
from ...structures.base import Design, Role, Target
from ...structures.fitting import FitResult


@dataclass(frozen=True)
class Reference:
    """What a design is compared with, from its input parameters.

    target : the shape to keep
    energy : E0, the input design's elastic energy in the fitted state
    equilibria : of the input design, by role
    """

    target: Target
    energy: float
    equilibria: Mapping[str, Equilibrium]


class Term(ABC):
    """One term of one design's objective: a sum over the states (roles) that it looks at, of values
    without units.

    name : under which weights and files know it
    design : whose term it is
    reference : what the design is compared with

    Raises InputError when the term can't be judged for this design, which then needs the weight 0.
    """

    name: ClassVar[str]

    def __init__(self, design: Design, reference: Reference):
        self.design, self.reference = design, reference

    def sees(self, role: Role) -> bool:
        """Whether the term looks at the states of this role; default: at all."""
        return True

    def label(self, role: Role) -> str:
        """What histories and results call the term's share of this role."""
        return f"{self.name} {role.name}"

    @abstractmethod
    def value(self, role: Role, equilibrium: Equilibrium, fit: FitResult) -> float:
        """The term in one state.

        role : of the state
        equilibrium : the state, with its parameters
        fit : of its joints to the target, which is of the fitted role
        """

    @abstractmethod
    def gradient(self, role: Role, sensitivities: Sensitivities, fit: FitResult) -> np.ndarray:
        """(nq,) its exact derivative in the parameters, by the adjoint method.

        role : of the state
        sensitivities : of the state, with its equilibrium
        fit : as of `value`
        """

    @abstractmethod
    def model(
        self, role: Role, sensitivities: Sensitivities, fit: FitResult
    ) -> tuple[np.ndarray, np.ndarray]:
        """Its gradient (nq,) and Hessian (nq, nq), or a positive semidefinite model of that
        (Gauss-Newton).

        role, sensitivities, fit : as of `gradient`
        """


_RESERVED = ("share", "level")  # weights that belong to no term


def _is_ours(term: type[Term] | None) -> bool:
    return term is not None and term.__module__.startswith(__package__.split(".")[0] + ".")


TERMS: Registry[type[Term]] = Registry(__package__)
_Term = TypeVar("_Term", bound=type[Term])


def register_term(term: _Term) -> _Term:
    """Make a term known under its name; decorates the class.

    Raises InputError for a class without a name of its own or without all of the methods.
    """
    name, missing = getattr(term, "name", None), sorted(getattr(term, "__abstractmethods__", ()))
    if not isinstance(name, str) or not name:
        raise InputError("a term needs a name", field=f"{term.__name__}.name", value=name)
    if missing:
        raise InputError(f"lacks the methods {', '.join(missing)}", field=term.__name__)
    if not _is_ours(term) and (name in _RESERVED or _is_ours(TERMS.get(name))):
        raise InputError(
            "is a name of this package: choose another", field=f"{term.__name__}.name", value=name
        )
    TERMS.add(name, term)
    return term


def term_names() -> list[str]:
    """Names of all terms: those that every objective has first, then the others, sorted."""
    first = ["fit", "energy"]
    return first + [name for name in TERMS.names() if name not in first]


def term_class(name: str) -> type[Term]:
    """The term of that name; InputError when there is none."""
    term = TERMS.get(name)
    if term is None:
        raise InputError(
            f"unknown term of the objective ({did_you_mean(name, term_names())}"
            f"known: {', '.join(term_names())})",
            field="weights",
            value=name,
        )
    return term

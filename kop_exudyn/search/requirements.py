"""What every design of a kit has to meet, whatever it costs in fidelity."""

from __future__ import annotations

from dataclasses import dataclass

from ..checks import check_flag, check_not_negative, check_positive, check_whole


@dataclass(frozen=True)
class Requirements:
    """What makes a design buildable; each can be switched off, to see what it costs.

    opening : every design opens by itself: the state that is judged is the one that its assembly
        leads to along the way of `Design.stations`, without a snap
    stress : the equivalent stress stays below the elastic limit in all states that a builder sees
    loads : every load case of a design's file is carried: deflections keep to their limit, and
        stress to its own under the factored loads, without giving way
    safety : factor by which the elastic limit is divided
    samples : sets of errors of the workshop that every result of the search is tried with: one that
        makes a design snap into another shape counts like a design that does not open. 0: none
    length, angle : standard deviations of these errors, in the designs' unit and rad; None: the
        usual ones, see `usual_tolerance`
    margin : factor by which the errors are larger than that, so that few sets tell what many would
    seed : of the sets
    penalty : weight of a bound's excess (utilisation beyond 1), as a share of the fit's weight:
        at first 1 % of excess counts as much as a deviation of 1 % of the size at every joint

    Raises InputError.
    """

    opening: bool = True
    stress: bool = True
    loads: bool = True
    safety: float = 1.0
    samples: int = 10
    length: float | None = None
    angle: float | None = None
    margin: float = 1.5
    seed: int = 0
    penalty: float = 0.01

    def __post_init__(self) -> None:
        for name in ("opening", "stress", "loads"):
            check_flag(name, getattr(self, name))
        for name in ("samples", "seed"):
            check_whole(name, getattr(self, name))
        for name in ("length", "angle"):
            if getattr(self, name) is not None:
                check_not_negative(name, getattr(self, name))
        for name in ("safety", "margin", "penalty"):
            check_positive(name, getattr(self, name))

    @classmethod
    def none(cls) -> Requirements:
        """Nothing is required: the baselines are made so."""
        return cls(opening=False, stress=False, loads=False, samples=0)

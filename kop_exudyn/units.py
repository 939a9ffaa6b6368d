"""Units of length and force: what a file's numbers mean, and how numbers are shown with them.

Designs are computed in the units of their files; nothing is converted behind their backs. A design
that names its units ("units": {"length": "mm", "force": "N"}) has every number shown with them, and
gravity follows: the mass unit is the one in which force = mass length / s^2. A design that names
none has its numbers shown in "units of length" and "units of force".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .errors import InputError, did_you_mean

# metres and newtons of one unit
LENGTHS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "ft": 0.3048}
FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605, "kip": 4448.2216152605}
_WRITTEN_OUT = 1e7  # larger numbers are shown with a power of ten
STANDARD_GRAVITY = 9.80665  # m / s^2 (CGPM 1901)

_STRESS_NAMES = {("m", "N"): "Pa", ("m", "kN"): "kPa", ("m", "MN"): "MPa", ("mm", "N"): "MPa"}
_ENERGY_NAMES = {("m", "N"): "J", ("m", "kN"): "kJ", ("m", "MN"): "MJ", ("mm", "N"): "mJ"}
_ENERGY_NAMES |= {("mm", "kN"): "J"}
# of mass units in kg, for naming densities
_MASSES = {1.0: "kg", 1e3: "t", 1e-3: "g", 1e6: "kt"}


@dataclass(frozen=True)
class Units:
    """The units of a file's numbers.

    Parameters
    ----------
    length : of `LENGTHS`
    force : of `FORCES`

    Raises InputError for units that aren't known.
    """

    length: str
    force: str = "N"

    def __post_init__(self) -> None:
        for field, value, known in (
            ("length", self.length, LENGTHS),
            ("force", self.force, FORCES),
        ):
            if value not in known:
                raise InputError(
                    f"unknown unit ({did_you_mean(str(value), known)}known: {', '.join(known)})",
                    field=f"units.{field}",
                    value=value,
                )

    @property
    def metres(self) -> float:
        """Metres of one unit of length."""
        return LENGTHS[self.length]

    @property
    def newtons(self) -> float:
        """Newtons of one unit of force."""
        return FORCES[self.force]

    @property
    def gravity(self) -> float:
        """Standard gravity, units of length / s^2."""
        return STANDARD_GRAVITY / self.metres

    @property
    def kilograms(self) -> float:
        """Kilograms of the mass that one unit of force accelerates by one unit of length / s^2."""
        return self.newtons / self.metres

    def density_si(self, density: float) -> float:
        """A density in these units (mass / length^3, see `kilograms`), in kg / m^3."""
        return density * self.kilograms / self.metres**3

    def stress_si(self, stress: float) -> float:
        """A stress or modulus in these units, in Pa."""
        return stress * self.newtons / self.metres**2

    def to_dict(self) -> dict[str, str]:
        """As files have it."""
        return {"length": self.length, "force": self.force}

    def __str__(self) -> str:
        return f"{self.length}, {self.force}"


def units_from_dict(data: Mapping[str, Any] | None) -> Units | None:
    """The units of a file's field "units"; None where it has none. Raises InputError."""
    return None if data is None else Units(data["length"], data.get("force", "N"))


def unit_of(quantity: str, units: Units | None) -> str:
    """The name of a quantity's unit, as it is put after numbers.

    quantity : "length", "area", "force", "stress", "energy", "acceleration", "density" or "angle"
    units : of the numbers, None where they aren't known
    """
    if quantity == "angle":
        return "rad"
    if units is None:
        return _UNNAMED[quantity]
    length, force = units.length, units.force
    names = {
        "length": length,
        "area": f"{length}²",
        "force": force,
        "stress": _STRESS_NAMES.get((length, force), f"{force}/{length}²"),
        "energy": _ENERGY_NAMES.get((length, force), f"{force} {length}"),
        "acceleration": f"{length}/s²",
        "density": f"{_mass_name(units)}/{length}³",
    }
    return names[quantity]


_UNNAMED = {
    "length": "units of length",
    "area": "(units of length)²",
    "force": "units of force",
    "stress": "units of force / length²",
    "energy": "units of force × length",
    "acceleration": "units of length / s²",
    "density": "units of mass / length³",
}


def plain_number(value: float, digits: int = 4) -> str:
    """A number as people write it: to so many significant digits, but without powers of ten as
    long as it has no more than seven digits before its point.

    digits : significant ones; "2420" and "13350" are of three and four
    """
    text = f"{value:.{digits}g}"
    if "e+" not in text or abs(float(text)) >= _WRITTEN_OUT:
        return text
    return f"{float(text):.0f}"


def with_unit(value: float, quantity: str, units: Units | None, digits: int = 4) -> str:
    """A number with its unit, as "12.3 MPa".

    digits : significant ones that are shown
    """
    return f"{plain_number(value, digits)} {unit_of(quantity, units)}"


def in_millimetres(value: float, units: Units | None, digits: int = 3) -> str:
    """A length as a workshop says it: in mm where the unit is known.

    digits : significant ones that are shown
    """
    if units is None:
        return with_unit(value, "length", units, digits)
    return f"{plain_number(1000 * units.metres * value, digits)} mm"


def common_units(named: Mapping[str, Units | None], what: str = "designs") -> Units | None:
    """The units that several files share; None where none of them names any.

    named : what each file is called -> its units

    Raises InputError where two of them differ: their lengths can't be compared then.
    """
    given = {name: units for name, units in named.items() if units is not None}
    if not given:
        return None
    first, units = next(iter(given.items()))
    for name, other in given.items():
        if other != units:
            raise InputError(
                f"{what} that go together need the same units: {first} in {units}, {name} in "
                f"{other} (kop import FILE --unit {units.length} --force-unit {units.force} --out "
                "NEW writes a design in these)",
                field="units",
            )
    return units


def unnamed_units(named: Mapping[str, Units | None]) -> str | None:
    """A sentence about files that name no units, beside others that do; None where there are none:
    their numbers are then taken for the same units.

    named : what each file is called -> its units
    """
    without = [name for name, units in named.items() if units is None]
    given = [units for units in named.values() if units is not None]
    if not without or not given:
        return None
    names = ", ".join(without)
    verb = "name" if len(without) > 1 or names.endswith("designs") else "names"
    return f"{names} {verb} no units: taken for {given[0]}, as the rest is in"


def _mass_name(units: Units) -> str:
    for kilograms, name in _MASSES.items():
        if abs(units.kilograms / kilograms - 1) < 1e-9:
            return name
    return f"({units.force} s²/{units.length})"

"""Derivatives of sections against sections that are a little larger."""

import numpy as np
import pytest

from kop_exudyn.rods.section_slopes import dimensions, section_slopes, stiffness_slopes
from kop_exudyn.rods.sections import Material, circle, drilled, general, half_lapped, rectangle

WOOD = Material(1.1e10, 0.3)
MAKERS = {
    "upright": (lambda width, height: rectangle(width, height), (0.015, 0.12)),
    "flat": (lambda width, height: rectangle(width, height), (0.03, 0.004)),
    "half-lapped": (lambda width, height: half_lapped(rectangle(width, height)), (0.015, 0.12)),
    "drilled": (lambda width, height: drilled(rectangle(width, height), 0.005), (0.03, 0.004)),
    "round": (lambda radius: circle(radius), (0.01,)),
    "general": (lambda *four: general(*four), (1e-3, 2e-7, 1e-8, 3e-8)),
}
NUMBERS = ("area", "inertia_y", "inertia_z", "torsion", "torsion_modulus", "outline", "centre")


def taylor(value, slope, steps=(1e-2, 5e-3, 2.5e-3)):
    """Order at which the remainder of a first-order prediction falls; inf where it is exact."""
    size = np.abs(value(0.0)).max()
    left = [np.abs(value(h) - value(0.0) - h * slope).max() / size for h in steps]
    return np.inf if max(left) < 1e-13 else float(np.polyfit(np.log(steps), np.log(left), 1)[0])


@pytest.mark.parametrize("name", MAKERS)
def test_slopes_are_exact(name):
    make, given = MAKERS[name]
    section = make(*given)
    assert list(dimensions(section).values()) == pytest.approx(list(given))
    slopes = section_slopes(section)
    assert list(slopes) == list(dimensions(section))
    for place, (dimension, slope) in enumerate(slopes.items()):

        def at(h, place=place):
            return make(*(v * (1 + h) if k == place else v for k, v in enumerate(given)))

        pairs = [(lambda s: s, slope)] + ([(lambda s: s.cut, slope.cut)] if section.cut else [])
        for of, found in pairs:
            for number in NUMBERS:
                if name == "general" and number in ("outline", "torsion_modulus"):
                    continue  # these stay

                def value(h, of=of, number=number, at=at):
                    return np.asarray(getattr(of(at(h)), number), float)

                own = given[place] * np.asarray(getattr(found, number), float)
                if np.abs(value(0.0)).max() > 0:
                    assert taylor(value, own) > 1.9, (dimension, number)
                    # the control: a slope that is off is seen
                    off = own + 0.2 * np.abs(value(0.0)).max()
                    assert taylor(value, off) < 1.3, (dimension, number)
        stiffness = stiffness_slopes(section, WOOD)[dimension] * given[place]
        assert taylor(lambda h, at=at: at(h).stiffness(WOOD), stiffness) > 1.9


def test_slopes_in_the_material():
    section = rectangle(0.03, 0.004)
    slopes = stiffness_slopes(section, WOOD)

    def young(h):
        return section.stiffness(Material(WOOD.young * (1 + h), WOOD.poisson))

    def poisson(h):
        return section.stiffness(Material(WOOD.young, WOOD.poisson + h))

    assert taylor(young, WOOD.young * slopes["young"]) == np.inf
    assert taylor(poisson, slopes["poisson"]) > 1.9
    assert taylor(poisson, 1.2 * slopes["poisson"]) < 1.3

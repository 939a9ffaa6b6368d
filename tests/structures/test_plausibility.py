"""Numbers in the wrong unit are questioned; those of the models aren't."""

import numpy as np
import pytest

from kop_exudyn.io.designs import load_design
from kop_exudyn.rods.sections import Material
from kop_exudyn.structures.plausibility import design_doubts, material_doubts, section_doubt
from kop_exudyn.units import Units

SPANS = np.array([0.2, 0.25, 0.3])


@pytest.mark.parametrize(
    "sides, words",
    [
        ((0.03, 0.004), None),
        ((30.0, 4.0), "30 x 4 m is thick beside spans of 0.25 m"),
        ((3e-5, 4e-6), "very thin"),
    ],
)
def test_sections_beside_spans(sides, words):
    doubt = section_doubt(sides, SPANS, Units("m"))
    assert doubt is None if words is None else words in doubt


@pytest.mark.parametrize(
    "units, young, density, doubts",
    [
        (Units("m", "N"), 2.1e9, 900.0, 0),
        (Units("mm", "N"), 2100.0, 9e-10, 0),
        (Units("mm", "N"), 2.1e9, 900.0, 2),  # of metres
        (Units("m", "N"), 2100.0, 9e-10, 2),  # of millimetres
        (Units("m", "kN"), 2.1e6, 0.9, 0),
        (None, 1.0, 1.0, 0),
    ],
)
def test_materials(units, young, density, doubts):
    assert len(material_doubts([Material(young, 0.3, density)], units)) == doubts


def test_what_was_meant_is_said():
    """Numbers of metres in a design of millimetres: what they would be there."""
    material = Material(1.1e10, 0.3, 450.0, elastic_limit=2.4e7)
    words = material_doubts([material], Units("mm", "N"))
    assert "1.1e+10 Pa would be 11000" in words[0]
    assert "450 kg/m³ would be 4.5e-10" in words[-1]
    mixed = material_doubts([Material(11000.0, 0.3, elastic_limit=2.4e7)], Units("mm", "N"))
    assert len(mixed) == 1 and "2180 times Young's modulus" in mixed[0]


@pytest.mark.parametrize("name", ["small/01_sinh", "grids/01_dome", "umbrellas/dome"])
def test_the_models_are_not_questioned(name, repository):
    assert design_doubts(load_design(repository / "models" / f"{name}.json")) == []

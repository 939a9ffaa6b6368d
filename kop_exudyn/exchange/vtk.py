"""States as VTU for ParaView and meshio: every rod element with its part, strains, stress
resultants and utilisation, every point with its deviation.

Arrays are named with their unit, as "deviation [mm]", which ParaView writes at its colour bars. The
unit of the coordinates is in the name of a field array, "metres_per_mm", as VTU has no place for
it.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..files.files import write_bytes
from ..scene.scene import Scene
from ..structures.strength import Strength
from ..units import Units, unit_of
from .states import DesignState

_RESULTANTS = ("N", "Qy", "Qz", "Mt", "My", "Mz")
_STRAINS = ("stretch", "shear_y", "shear_z", "twist", "curvature_y", "curvature_z")
_QUANTITIES = {
    "rest_length": "length",
    "deviation": "length",
    **dict.fromkeys(("twist", "curvature_y", "curvature_z"), "curvature"),
    **dict.fromkeys(("N", "Qy", "Qz"), "force"),
    **dict.fromkeys(("Mt", "My", "Mz"), "moment"),
    **dict.fromkeys(
        ("axial_stress", "normal_stress", "shear_stress", "equivalent_stress"), "stress"
    ),
}


def element_fields(
    scene: Scene, equilibrium: Equilibrium, strength: Strength | None = None
) -> dict[str, np.ndarray]:
    """Name -> (E,) values of every rod element: rod piece, rest length, strains, stress resultants,
    stresses.

    Strains are against the element's own rest shape, per rest length; local axes as in
    `rods.sections`.
    """
    fields = {"rod": chain_of_element(scene), "rest_length": scene.rest_lengths(equilibrium.q)}
    strain = equilibrium.stress / scene.stiffness
    fields |= dict(zip(_STRAINS, strain.T)) | dict(zip(_RESULTANTS, equilibrium.stress.T))
    if strength is not None:
        fields |= {
            "axial_stress": strength.axial,
            "normal_stress": strength.normal,
            "shear_stress": strength.shear,
            "equivalent_stress": strength.equivalent,
            "utilisation": strength.utilisation,
        }
    return fields


def chain_of_element(scene: Scene) -> np.ndarray:
    """(E,) the rod piece that every element belongs to, -1 without one."""
    found = np.full(len(scene.elements), -1)
    for number, piece in enumerate(scene.chains):
        found[piece.elements] = number
    return found


def state_fields(state: DesignState) -> dict[str, np.ndarray]:
    """`element_fields`, and of every rod element its element's number (0 without one) and its
    largest deviation."""
    rods = chain_of_element(state.scene)
    fields = element_fields(state.scene, state.equilibrium, state.strength)
    deviations = state.deviations[state.scene.elements]
    return fields | {
        "element": np.where(rods < 0, 0, state.elements[rods]),
        "deviation": deviations.max(axis=1),
    }


def part_numbers(state: DesignState, labels: tuple[str, ...]) -> np.ndarray:
    """(E,) place of every rod element's part among labels, from 1; 0 without a part."""
    numbers = np.array([labels.index(part) + 1 if part in labels else 0 for part in state.parts])
    rods = chain_of_element(state.scene)
    return np.where(rods < 0, 0, numbers[rods])


def vtu_mesh(state: DesignState, labels: tuple[str, ...] = ()) -> Any:
    """The state as a `meshio.Mesh` of line cells.

    labels : of the kit's parts; the field "part" has their places in it, from 1
    """
    import meshio

    axes = {
        name: state.axes[:, :, k] for k, name in enumerate(("tangent", "section_y", "section_z"))
    }
    fields = state_fields(state) | ({"part": part_numbers(state, labels)} if labels else {})
    return meshio.Mesh(
        state.points,
        [("line", state.scene.elements)],
        point_data=axes | {"deviation": state.deviations},
        cell_data={name: [values] for name, values in fields.items()},
    )


def write_vtu(
    path: str | Path,
    state: DesignState,
    labels: tuple[str, ...] = (),
    *,
    overwrite: bool = False,
) -> Path:
    """Write a state, its arrays named with their units where the design names any. Raises
    InputError when the file exists or can't be written."""
    mesh, units = vtu_mesh(state, labels), state.design.units
    mesh.point_data = {with_its_unit(k, units): v for k, v in mesh.point_data.items()}
    mesh.cell_data = {with_its_unit(k, units): v for k, v in mesh.cell_data.items()}
    with tempfile.TemporaryDirectory() as folder:
        temporary = Path(folder) / "state.vtu"
        mesh.write(temporary)
        content = temporary.read_bytes()
    if units is not None:
        begin = b"<UnstructuredGrid>"
        content = content.replace(begin, begin + _field_data(units), 1)
    return write_bytes(path, content, overwrite=overwrite)


def with_its_unit(name: str, units: Units | None) -> str:
    """The name of a field of a state with its unit, as "My [N mm]"; alone where it has none."""
    quantity = _QUANTITIES.get(name)
    if quantity is None or units is None:
        return name
    own = {"curvature": f"1/{units.length}", "moment": f"{units.force} {units.length}"}
    unit = own.get(quantity) or unit_of(quantity, units)
    return f"{name} [{unit.replace('²', '^2')}]"


def _field_data(units: Units) -> bytes:
    """Arrays of one number each whose names say the units of length and force: meshio reads numbers
    only there."""
    values = {
        f"metres_per_{units.length}": units.metres,
        f"newtons_per_{units.force}": units.newtons,
    }
    arrays = "".join(
        f'<DataArray type="Float64" Name="{name}" NumberOfTuples="1" format="ascii">{value!r}'
        "</DataArray>"
        for name, value in values.items()
    )
    return f"<FieldData>{arrays}</FieldData>".encode()

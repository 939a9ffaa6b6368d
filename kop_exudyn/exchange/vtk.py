"""States with strains, stress resultants and utilisation of every rod element, as VTU for ParaView
and meshio."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from ..equilibrium.equilibria import Equilibrium
from ..files.files import write_text
from ..scene.scene import Scene
from ..structures.strength import Strength

_LINE = 3  # VTK's cell type
_RESULTANTS = ("N", "Qy", "Qz", "Mt", "My", "Mz")
_STRAINS = ("stretch", "shear_y", "shear_z", "twist", "curvature_y", "curvature_z")


def element_fields(
    scene: Scene, equilibrium: Equilibrium, strength: Strength | None = None
) -> dict[str, np.ndarray]:
    """Name -> (E,) values of every rod element: rod piece, rest length, strains, stress resultants,
    stresses.

    Strains are against the element's own rest shape, per rest length; local axes as in
    `rods.sections`.
    """
    chain = np.full(len(scene.elements), -1)
    for number, piece in enumerate(scene.chains):
        chain[piece.elements] = number
    fields = {"rod": chain, "rest_length": scene.rest_lengths(equilibrium.q)}
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


def vtu_text(scene: Scene, equilibrium: Equilibrium, fields: Mapping[str, np.ndarray]) -> str:
    """The scene's rods as line cells, with fields (E,) on them and the nodes' axes as vectors on
    the points."""
    x, R = scene.node_poses(equilibrium.state)
    n, m = len(x), len(scene.elements)
    axes = {name: R[:, :, k] for k, name in enumerate(("tangent", "section_y", "section_z"))}
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">',
            "<UnstructuredGrid>",
            f'<Piece NumberOfPoints="{n}" NumberOfCells="{m}">',
            "<Points>",
            _array("Points", x),
            "</Points>",
            "<Cells>",
            _array("connectivity", scene.elements.ravel()),
            _array("offsets", 2 * np.arange(1, m + 1)),
            _array("types", np.full(m, _LINE), "UInt8"),
            "</Cells>",
            "<PointData>",
            *(_array(name, values) for name, values in axes.items()),
            "</PointData>",
            "<CellData>",
            *(_array(name, values) for name, values in fields.items()),
            "</CellData>",
            "</Piece>",
            "</UnstructuredGrid>",
            "</VTKFile>",
            "",
        ]
    )


def write_vtu(
    path: str | Path,
    scene: Scene,
    equilibrium: Equilibrium,
    fields: Mapping[str, np.ndarray],
    *,
    overwrite: bool = False,
) -> Path:
    """Write a state. Raises InputError when the file exists or can't be written."""
    return write_text(path, vtu_text(scene, equilibrium, fields), overwrite=overwrite)


def _array(name: str, values: np.ndarray, kind: str | None = None) -> str:
    values = np.asarray(values)
    integer = values.dtype.kind in "iu"
    components = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    numbers = " ".join(
        map(repr, values.ravel().tolist() if integer else values.astype(float).ravel().tolist())
    )
    return (
        f'<DataArray type="{kind or ("Int64" if integer else "Float64")}" '
        f"Name={quoteattr(name)}{components} "
        f'format="ascii">{numbers}</DataArray>'
    )

"""States for COMPAS (version 2): a graph and a mesh of each, as JSON. Needs compas, which comes
with the extra "compas".

The file has a dictionary: "graph", whose nodes are joints, corners and ends and whose edges are rod
pieces with their part, element, deviation and utilisation; "mesh", the rods as solids, whose faces
know their rod; "target", the target surface, where there is one; and "units".
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files.files import write_text
from .meshes import sweep
from .states import DesignState


def compas_data(state: DesignState) -> dict[str, Any]:
    """The state as COMPAS objects by name. Raises InputError without compas."""
    load_compas()
    from compas.datastructures import Mesh

    swept = sweep(state.scene, state.equilibrium.state)
    mesh = Mesh.from_vertices_and_faces(state.placed(swept.vertices).tolist(), swept.faces.tolist())
    mesh.name = f"{state.design.name} {state.name}"
    rods = swept.chains[swept.faces[:, 0]].tolist()
    known = [state.of_rod(chain) for chain in range(len(state.parts))]
    for face, rod in enumerate(rods):
        mesh.face_attributes(face, ("rod", "part"), (rod, known[rod]["part"]))
    found: dict[str, Any] = {"graph": _graph(state), "mesh": mesh}
    if state.surface is not None:
        vertices, faces = state.surface
        found["target"] = Mesh.from_vertices_and_faces(vertices.tolist(), faces.tolist())
    units = state.design.units
    return found | {"units": None if units is None else units.to_dict()}


def write_compas(path: str | Path, state: DesignState, *, overwrite: bool = False) -> Path:
    """Write a state. Raises InputError when the file exists or can't be written, or without
    compas."""
    compas = load_compas()
    return write_text(path, compas.data.json_dumps(compas_data(state)), overwrite=overwrite)


def load_compas() -> Any:
    """The library. Raises InputError without it, or with its version 1."""
    try:
        import compas
        import compas.data
    except ImportError:
        raise InputError(
            "COMPAS files need compas: pip install 'kop_exudyn[compas]'",
            field="format",
            value="compas",
        ) from None
    if int(compas.__version__.split(".")[0]) < 2:
        raise InputError(
            "needs compas 2: pip install --upgrade compas", field="compas", value=compas.__version__
        )
    return compas


def _graph(state: DesignState) -> Any:
    """Joints, corners and ends, and the rod pieces between them."""
    from compas.datastructures import Graph

    graph = Graph(name=f"{state.design.name} {state.name}")
    joints = {int(body): number for number, body in enumerate(state.design.joints, 1)}
    places = state.placed(state.equilibrium.state.positions)
    ends = np.array([state.scene.node_body[c.nodes[[0, -1]]] for c in state.scene.chains], int)
    for body in np.unique(ends).tolist():
        x, y, z = places[body].tolist()
        graph.add_node(body, x=x, y=y, z=z, joint=joints.get(body))
    for chain, (first, last) in enumerate(ends.tolist()):
        graph.add_edge(first, last, rod=chain, **state.of_rod(chain))
    return graph

"""The assembly of rods by the kernels in compiled/sources."""

from __future__ import annotations

import ctypes

import numpy as np

from ..compiled.library import address, library
from .assembly import RodAssembly
from .scene import Scene
from .sparsity import Sparsity
from .state import State


class _Rods(ctypes.Structure):
    """`Rods` of compiled/sources/assembly.c."""

    _fields_ = [("n_elements", ctypes.c_int64)] + [
        (name, ctypes.c_void_p)
        for name in (
            "elements",
            "node_body",
            "node_hinge",
            "frame",
            "offset",
            "axes",
            "centres",
            "stiffness",
            "rest_strain",
            "weight",
            "rows",
            "slots",
            "gradient",
            "values",
            "strain",
            "strain_displacement",
            "predicted_stress",
        )
    ]


class CompiledAssembly(RodAssembly):
    """By the kernels in compiled/sources."""

    def __init__(self, scene: Scene, sparsity: Sparsity):
        super().__init__(scene, sparsity)
        kernels = library()
        assert kernels is not None
        self._kernels = kernels
        self._arrays = {
            "elements": np.ascontiguousarray(scene.elements, np.int64),
            "node_body": np.ascontiguousarray(scene.node_body, np.int64),
            "node_hinge": np.ascontiguousarray(scene.node_hinge, np.int64),
            "frame": np.ascontiguousarray(scene.node_frame, float),
            "offset": np.ascontiguousarray(scene.node_offset, float),
            "axes": np.ascontiguousarray(scene.hinge_axis, float),
            "centres": np.ascontiguousarray(scene.hinge_centre, float),
            "stiffness": np.ascontiguousarray(scene.stiffness, float),
            "rest_strain": np.ascontiguousarray(scene.rest_strain, float),
            "rows": np.ascontiguousarray(sparsity.rows, np.int32),
            "slots": np.ascontiguousarray(sparsity.slots, np.int32),
            "gradient": self.gradient,
            "values": self.values,
            "strain": self.strain,
            "strain_displacement": self.strain_displacement,
            "predicted_stress": self.predicted_stress,
        }
        if scene.weight is not None:
            self._arrays["weight"] = np.ascontiguousarray(scene.weight, float)
        rods = _Rods(len(scene.elements))
        for name, array in self._arrays.items():
            setattr(rods, name, address(array, array.dtype.type))
        self._targets = address(self.gradient), address(self.values)
        self._rods = rods  # with its arrays, whose addresses it has
        self._at = ctypes.addressof(rods)

    def assemble(
        self, state: State, lengths: np.ndarray, order: int, mixed: bool
    ) -> tuple[float, float]:
        poses = [
            np.ascontiguousarray(a, float)
            for a in (state.positions, state.rotations, state.angles, lengths)
        ]
        energies = np.empty(2)
        self._kernels.assemble_rods(
            self._at, order, mixed, *[address(a) for a in poses], address(energies)
        )
        return float(energies[0]), float(energies[1])

    def scatter(
        self, rows: np.ndarray, slots: np.ndarray, g: np.ndarray, H: np.ndarray | None
    ) -> None:
        g = np.ascontiguousarray(g, float)
        H = None if H is None else np.ascontiguousarray(H, float)
        self._kernels.scatter_blocks(
            *rows.shape,
            address(rows, np.int32),
            address(slots, np.int32),
            address(g),
            None if H is None else address(H),
            *self._targets,
        )

    def predict_stress(self, lengths: np.ndarray, increment: np.ndarray) -> None:
        self._kernels.predict_stress(
            self._at, address(lengths), address(increment), address(self.predicted_stress)
        )

    def largest_forces(self, lengths: np.ndarray) -> tuple[float, float, float]:
        out = np.empty(3)
        self._kernels.largest_forces(self._at, address(lengths), address(out))
        return float(out[0]), float(out[1]), float(out[2])

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
        self._check_scene(scene, sparsity)
        rods = _Rods(len(scene.elements))
        for name, array in self._arrays.items():
            setattr(rods, name, address(array, array.dtype.type))
        self._targets = address(self.gradient), address(self.values)
        self._rods = rods  # with its arrays, whose addresses it has
        self._at = ctypes.addressof(rods)

    def _check_scene(self, scene: Scene, sparsity: Sparsity) -> None:
        """Raise ValueError unless all arrays are of the sizes, and all numbers in them within the
        bounds, that the kernels rely on."""
        e, n, b, h = len(scene.elements), len(scene.node_body), scene.n_bodies, scene.n_hinges
        self._shapes = ((b, 3), (b, 3, 3), (h,), (e,))
        shapes = {
            "elements": (e, 2),
            "node_body": (n,),
            "node_hinge": (n,),
            "frame": (n, 3, 3),
            "offset": (n, 3),
            "axes": (h, 3),
            "centres": (h, 3),
            "stiffness": (e, 6),
            "rest_strain": (e, 6),
            "weight": (e, 3),
            "rows": (e, 14),
            "slots": (e, 105),
        }
        bounds = {
            "elements": (0, n),
            "node_body": (0, b),
            "node_hinge": (-1, h),
            "rows": (-1, len(self.gradient)),
            "slots": (-1, len(self.values)),
        }
        for name, shape in shapes.items():
            if name in self._arrays and self._arrays[name].shape != shape:
                raise ValueError(f"{name} of shape {self._arrays[name].shape}, expected {shape}")
        for name, (low, end) in bounds.items():
            array = self._arrays[name]
            if array.size and not (array.min() >= low and array.max() < end):
                raise ValueError(f"{name} names what doesn't exist (there are {end})")
        for rows, slots in zip(sparsity.term_rows, sparsity.term_slots):
            if rows.size and not (
                rows.max() < len(self.gradient) and slots.max() < len(self.values)
            ):
                raise ValueError("a term names an unknown that doesn't exist")

    def assemble(
        self, state: State, lengths: np.ndarray, order: int, mixed: bool
    ) -> tuple[float, float]:
        poses = [
            np.ascontiguousarray(a, float)
            for a in (state.positions, state.rotations, state.angles, lengths)
        ]
        energies = np.empty(2)
        at = [address(a, np.float64, shape) for a, shape in zip(poses, self._shapes)]
        self._kernels.assemble_rods(self._at, order, mixed, *at, address(energies))
        return float(energies[0]), float(energies[1])

    def scatter(
        self, rows: np.ndarray, slots: np.ndarray, g: np.ndarray, H: np.ndarray | None
    ) -> None:
        g = np.ascontiguousarray(g, float)
        H = None if H is None else np.ascontiguousarray(H, float)
        m, k = rows.shape
        self._kernels.scatter_blocks(
            m,
            k,
            address(rows, np.int32),
            address(slots, np.int32, (m, k * (k + 1) // 2)),
            address(g, np.float64, (m, k)),
            None if H is None else address(H, np.float64, (m, k, k)),
            *self._targets,
        )

    def predict_stress(self, lengths: np.ndarray, increment: np.ndarray) -> None:
        self._kernels.predict_stress(
            self._at,
            address(lengths, np.float64, self._shapes[-1]),
            address(increment, np.float64, self.gradient.shape),
            address(self.predicted_stress),
        )

    def largest_forces(self, lengths: np.ndarray) -> tuple[float, float, float]:
        out = np.empty(3)
        at = address(lengths, np.float64, self._shapes[-1])
        self._kernels.largest_forces(self._at, at, address(out))
        return float(out[0]), float(out[1]), float(out[2])

"""Assembly of a scene's rods: energy, gradient and Hessian straight into the factorisation's
arrays."""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod

import numpy as np

from ..compiled.library import address, library
from .scene import Scene
from .sparsity import Sparsity
from .state import State

ENERGY, GRADIENT, HESSIAN = 0, 1, 2  # as in compiled/sources/assembly.c


class RodAssembly(ABC):
    """The rods of a scene, assembled into arrays that stay the same.

    gradient (n_kept,), values (n_values,) : of the assembled system, terms included
    strain e (E, 6), strain_displacement (E, 6, 14) : of the state assembled last
    predicted_stress (E, 6) : what a mixed assembly takes the geometric part at
    """

    def __init__(self, scene: Scene, sparsity: Sparsity):
        n = len(scene.elements)
        self.scene, self.sparsity = scene, sparsity
        self.gradient = np.zeros(sparsity.n_free + sparsity.n_driven)
        self.values = np.zeros(sparsity.n_values)
        self.strain = np.zeros((n, 6))
        self.strain_displacement = np.zeros((n, 6, 14))
        self.predicted_stress = np.zeros((n, 6))

    @abstractmethod
    def assemble(
        self, state: State, lengths: np.ndarray, order: int, mixed: bool
    ) -> tuple[float, float]:
        """Add to gradient and values up to the order asked for; returns the elastic energy and the
        dead load's potential.

        lengths : (E,) rest lengths
        mixed : geometric part at the predicted stress, else at the current one
        """

    @abstractmethod
    def scatter(
        self, rows: np.ndarray, slots: np.ndarray, g: np.ndarray, H: np.ndarray | None
    ) -> None:
        """Add a term's block gradients (m, k) and symmetric Hessians (m, k, k; None: only
        gradients), with its rows (m, k) and slots (m, k (k + 1) / 2)."""

    @abstractmethod
    def predict_stress(self, lengths: np.ndarray, increment: np.ndarray) -> None:
        """Set the predicted stress to (K/L) (e + B d), which a linear step d (n_kept,) leads to."""

    @abstractmethod
    def largest_forces(self, lengths: np.ndarray) -> tuple[float, float, float]:
        """Largest force and moment in the elements, and largest K_0 / L; NaN where a strain is."""


def rod_assembly(scene: Scene, sparsity: Sparsity) -> RodAssembly:
    """The rods of a scene, compiled where there are kernels."""
    if library() is None:
        from .assembly_numpy import NumpyAssembly

        return NumpyAssembly(scene, sparsity)
    return CompiledAssembly(scene, sparsity)


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
            address(self.gradient),
            address(self.values),
        )

    def predict_stress(self, lengths: np.ndarray, increment: np.ndarray) -> None:
        self._kernels.predict_stress(
            self._at, address(lengths), address(increment), address(self.predicted_stress)
        )

    def largest_forces(self, lengths: np.ndarray) -> tuple[float, float, float]:
        out = np.empty(3)
        self._kernels.largest_forces(self._at, address(lengths), address(out))
        return float(out[0]), float(out[1]), float(out[2])

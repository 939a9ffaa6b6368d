"""Umbrella meshes with rigid plates against plates of rods: what they save, and how far the
deployed joints move."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from kop_exudyn.compiled.library import library
from kop_exudyn.equilibrium.exudyn_confirm import confirm
from kop_exudyn.equilibrium.newton import refine
from kop_exudyn.errors import InputError
from kop_exudyn.io.designs import load_design
from kop_exudyn.structures.fitting import best_placement
from kop_exudyn.structures.umbrella.bodies import PLATE_MODELS, RIGID, RODS
from kop_exudyn.structures.umbrella.design import Umbrella


def compared_plates(file: Path, runs: int) -> dict[str, Any]:
    """One row a model of the plates of a design, deployed and confirmed by Exudyn.

    Seconds are of processor time, the median of several runs. Joints are compared after the best
    rigid motion, in % of the bounding-box diagonal of those between plates of rods.
    """
    library()  # compiled now, where it has to be
    design = _umbrella(file)
    rows, joints, energies = [], {}, {}
    for model in PLATE_MODELS:
        times: list[float] = []
        for _ in range(runs):
            own = design.with_plates(model)  # anew: a mesh keeps its input's deployment
            own.systems
            begin = process_time()
            equilibrium = own.deploy()["deployed"]
            times.append(process_time() - begin)
        confirmation = confirm(own.scene(), refine(own.systems["deployed"], equilibrium))
        joints[model] = own.report_positions(confirmation.state)
        energies[model] = equilibrium.elastic_energy
        apart = _percent_apart(joints[model], joints[RODS])
        rows.append(
            {
                "design": design.name,
                "plates": model,
                "cells": design.mesh.n_cells,
                "unknowns": own.systems["deployed"].n_unknowns,
                "iterations": equilibrium.iterations,
                "seconds": median(times),
                "moved_max_percent": float(apart.max()),
                "moved_mean_percent": float(apart.mean()),
                "energy_percent": 100 * (energies[model] / energies[RODS] - 1),
                "stable": equilibrium.stable,
                "exudyn_moved": confirmation.moved,
            }
        )
    return {"rows": rows}


def _umbrella(file: Path) -> Umbrella:
    design = load_design(file)
    if not isinstance(design, Umbrella):
        raise InputError(
            "only umbrella meshes have plates", source=file, field="class", value=design.class_name
        )
    return design


def stiffened_plates(file: Path, factors: Sequence[float]) -> dict[str, Any]:
    """How near the joints between plates of ever stiffer rods come to those between rigid
    plates."""
    design = _umbrella(file)
    rigid = design.with_plates(RIGID)
    wanted = rigid.report_positions(rigid.deployed.state)
    rows = []
    for factor in factors:
        stiff = design.with_plates(RODS, young=factor * design.plates.young)
        apart = _percent_apart(stiff.report_positions(stiff.deployed.state), wanted)
        rows.append({"plates stiffer by": factor, "joints apart, max %": float(apart.max())})
    return {"design": design.name, "rows": rows}


def _percent_apart(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Distances (n,) after a rigid alignment, % of the bounding-box diagonal of y."""
    placed = best_placement(x, y).apply(x)
    return 100 * np.linalg.norm(placed - y, axis=1) / np.linalg.norm(np.ptp(y, axis=0))

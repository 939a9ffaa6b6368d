"""All that a search's result depends on, by which a run is known again."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, astuple, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..kit.kinds import part_kind
from ..kit.parts import Kit
from ..kit.stock import Stock
from ..structures.base import Design
from ..structures.strength import materials_of
from .request import kinds_of
from .settings import JobSettings


def described_job(
    designs: Sequence[Design],
    parts: Mapping[str, int] | None,
    kit: Kit | Stock | None,
    settings: JobSettings,
) -> dict[str, Any]:
    """All that the result depends on, as plain data; the processes that work on it are not part of
    it."""
    constraints = settings.stages.constraints
    values = asdict(replace(settings, stages=replace(settings.stages, constraints=None)))
    values["weights"] = settings.weights and settings.weights.to_dict()
    if constraints is not None:
        rows = sp.csr_array(constraints.A)
        rows.sort_indices()
        numbers = (rows.indptr, rows.indices, rows.data, constraints.lower, constraints.upper)
        values["stages"]["constraints"] = {"rows": constraints.rows, "digest": digest(*numbers)}
    del values["jobs"], values["scheduler"]
    if not any(part_kind(name).penalty is not None for name in kinds_of(parts, kit)):
        del values["stages"]["slit_cost"]
    given: dict[str, Any] = {}
    if isinstance(kit, Stock):
        given = {"stock": kit.to_dict(), "together": kit.together}
        kit = kit.kit
    if kit is not None:
        given |= {"kit": kit.to_dict()}
    sizes = dict(parts or {}) if kit is None else kit.sizes
    return {"designs": [design.name for design in designs], "parts": sizes, **values, **given}


def digest(*arrays: np.ndarray) -> str:
    """SHA-256 of arrays of numbers."""
    return hashlib.sha256(
        b"".join(np.ascontiguousarray(a, dtype=float).tobytes() for a in arrays)
    ).hexdigest()


def design_digest(design: Design) -> str:
    """SHA-256 of all numbers that a design's states and target depend on. May simulate it, for a
    target that comes of that, and raise SimulationFailure."""
    arrays: list[Any] = [design.parameters, design.joints, design.target.positions]
    arrays += [design.target.surface.vertices]
    for role in design.roles:
        scene = design.scene(role.name)
        arrays += [
            *(scene.stiffness, scene.rest_strain, scene.length_constant, scene.length_factor),
            *(scene.node_frame, scene.node_offset, scene.pinned, scene.driven.constants),
            *(scene.initial.positions, scene.initial.rotations, scene.initial.angles),
            [np.nan if role.opening is None else role.opening],
        ]
    for material in materials_of(design):
        arrays += [[np.nan if value is None else value for value in astuple(material)]]
    for case in design.load_cases:
        given = (case.gravity, case.line, case.area, case.plan, case.joints, case.forces)
        limits = (case.factor, case.deflection.absolute, case.deflection.span_over)
        numbers = [np.nan if value is None else value for value in (*given, *limits)]
        arrays += [*numbers, [] if case.supports is None else case.supports]
    return digest(*(np.asarray(array, float) for array in arrays))

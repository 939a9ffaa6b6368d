"""One HTML page with an orbitable 3D scene of designs: no network, no libraries, opens from a file.

The page holds the data (poses of all rings of all rods, as packed numbers) and a small WebGL
renderer, which sweeps the sections itself. Its content security policy lets it run this one script
and load nothing.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..drawing.colours import value_colours
from ..files.files import write_text
from ..wording import beside_units

_SCALE_STEPS = 12
# ends of colour scales; their quarters have few digits
_HANDY = (1, 1.2, 1.6, 2, 2.4, 3.2, 4, 6, 8, 10)


@dataclass(frozen=True)
class ViewerPart:
    """A part of the kit.

    label, kind : as on cut lists
    colour : (3,) sRGB in [0, 1]
    detail : its dimensions, as text
    uses : how many pieces each design has of it, in the designs' order
    """

    label: str
    kind: str
    colour: Sequence[float]
    detail: str = ""
    uses: Sequence[int] = ()


@dataclass(frozen=True)
class ViewerRods:
    """What doesn't move: rod pieces as rows of rings (section outlines across the rod), M rings in
    all.

    rings (n,) : number of rings of each piece; parts (n,) : number of the part that it is of, -1:
        none
    sections : outlines (k, 2), (y, z), counter-clockwise; section (n,) : the one of each piece
    corner_parts (m,) : parts of the marked corners
    """

    rings: np.ndarray
    parts: np.ndarray
    sections: Sequence[np.ndarray]
    section: np.ndarray
    corner_parts: np.ndarray = field(default_factory=lambda: np.empty(0, int))


@dataclass(frozen=True)
class ViewerState:
    """One state of a design.

    stage, role : what is chosen by
    positions (M, 3), rotations (M, 3, 3) : of the rings, x along the rod, in the target's
        coordinates where `placed`
    joints (j, 3), corners (m, 3) : marked points
    deviation (M,) : distance from the target, in % of its size; utilisation (M,) : of the
        elastic limit
    opening : rad, where states of one stage and role form a path; final : whether it is the one
        that counts
    note : shown beside the design's name
    """

    stage: str
    role: str
    positions: np.ndarray
    rotations: np.ndarray
    joints: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    corners: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    deviation: np.ndarray | None = None
    utilisation: np.ndarray | None = None
    opening: float | None = None
    final: bool = True
    placed: bool = False
    note: str = ""


@dataclass(frozen=True)
class ViewerDesign:
    """A design: its rods by role, its states, its target (vertices (V, 3), faces (F, 3)), failures
    by stage."""

    name: str
    rods: Mapping[str, ViewerRods]
    states: Sequence[ViewerState]
    target: tuple[np.ndarray, np.ndarray] | None = None
    failed: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ViewerScene:
    """Everything on the page.

    stages : in the order of the menu; the last one with states is shown first
    deviation_limit, utilisation_limit : values at the end of the colour scales; default: the
        largest final one
    unit : of length, as the scale bar has it
    """

    title: str
    designs: Sequence[ViewerDesign]
    parts: Sequence[ViewerPart] = ()
    stages: Sequence[str] = ("input", "direct", "unrelaxed", "relaxed", "assigned")
    deviation_limit: float | None = None
    utilisation_limit: float | None = None
    unit: str = "units"


def viewer_page(scene: ViewerScene) -> str:
    """The page as HTML."""
    folder = files(__package__)
    css, html, *scripts = (
        (folder / name).read_text(encoding="utf-8")
        for name in ("viewer.css", "viewer.html", "viewer_gl.js", "viewer.js")
    )
    script = "\n".join(scripts)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    # "<" would let data end the element that holds it
    data = json.dumps(scene_data(scene), separators=(",", ":"), allow_nan=False).replace(
        "<", "\\u003c"
    )
    return Template(html).substitute(
        title=escape(scene.title),
        css=css,
        script=script,
        scene=data,
        policy=f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'",
    )


def save_viewer(path: str | Path, scene: ViewerScene, *, overwrite: bool = False) -> Path:
    """Write the page. Raises InputError when the file exists already or can't be written."""
    return write_text(path, viewer_page(scene), overwrite=overwrite)


def scene_data(scene: ViewerScene) -> dict[str, Any]:
    """What the page's script reads, as plain values; arrays are base64 of little-endian 32-bit
    numbers."""
    limits = {
        name: given or _largest(scene, name)
        for name, given in (
            ("deviation", scene.deviation_limit),
            ("utilisation", scene.utilisation_limit),
        )
    }
    known = [name for name, limit in limits.items() if limit]
    return {
        "stages": list(scene.stages),
        "colourings": [*(["part"] if scene.parts else []), *known] or ["plain"],
        "limits": limits,
        "unit": scene.unit,
        "scale": value_colours(np.linspace(0, 1, _SCALE_STEPS)).round(4).tolist(),
        "parts": [
            {
                "label": p.label,
                "kind": p.kind,
                "colour": [round(float(c), 4) for c in p.colour],
                "detail": p.detail,
                "uses": [int(n) for n in p.uses],
            }
            for p in scene.parts
        ],
        "designs": [_design(design) for design in scene.designs],
    }


def _largest(scene: ViewerScene, name: str) -> float | None:
    """The largest value in the final states of the last stage, rounded up to a handy number; None
    without any."""
    found: dict[str, list[float]] = {}
    for state in (state for design in scene.designs for state in design.states if state.final):
        values = getattr(state, name)
        if values is not None and np.isfinite(values).any():
            found.setdefault(state.stage, []).append(float(np.nanmax(values)))
    last = next((stage for stage in reversed(scene.stages) if stage in found), None)
    if last is None or max(found[last]) <= 0:
        return None
    unit = 10.0 ** np.floor(np.log10(max(found[last])))
    return float(
        f"{next(k for k in _HANDY if k * unit >= max(found[last]) * (1 - 1e-9)) * unit:.6g}"
    )


def _design(design: ViewerDesign) -> dict[str, Any]:
    target = None
    if design.target is not None:
        vertices, faces = design.target
        target = {"vertices": _floats(vertices), "faces": _integers(faces)}
    return {
        "name": design.name,
        "target": target,
        "failed": dict(design.failed),
        "rods": {role: _rods(rods) for role, rods in design.rods.items()},
        "states": [_state(state) for state in design.states],
    }


def _rods(rods: ViewerRods) -> dict[str, Any]:
    thickness = float(np.median([np.ptp(outline, axis=0).max() for outline in rods.sections]))
    return {
        "rings": _integers(rods.rings),
        "part": _integers(rods.parts),
        "section": _integers(rods.section),
        "sections": [np.asarray(outline, float).tolist() for outline in rods.sections],
        "corner_part": _integers(rods.corner_parts),
        "thickness": thickness,
    }


def _state(state: ViewerState) -> dict[str, Any]:
    return {
        "stage": state.stage,
        "role": state.role,
        "opening": state.opening,
        "final": state.final,
        "placed": state.placed,
        "note": beside_units(state.note),
        "places": _floats(state.positions),
        "turns": _floats(Rotation.from_matrix(state.rotations).as_quat()),
        "joints": _floats(state.joints),
        "corners": _floats(state.corners),
        "deviation": _floats(state.deviation),
        "utilisation": _floats(state.utilisation),
    }


def _floats(values: np.ndarray | None) -> dict[str, str] | None:
    return None if values is None else {"f32": _packed(values, "<f4")}


def _integers(values: np.ndarray) -> dict[str, str]:
    return {"i32": _packed(values, "<i4")}


def _packed(values: np.ndarray, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode()

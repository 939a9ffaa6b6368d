"""Networks from drawings: cleaned, put together to whole curves, laid into their plane, and written
as a design file has them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry.centring import middle_of
from ..geometry.curves import Curve, curve_from_dict
from ..geometry.network import CurveNetwork, network
from ..wording import counted
from .cleaning import TOLERANCE, cleaned
from .contacts import EndContact, crossing_pieces, end_contacts
from .corners import rounded_corners, split_at_corners
from .curve_files import read_drawing
from .drawing import Drawing, DrawnCurve, Finding, size_of
from .frames import Frame, frame_of
from .joins import join_ends
from .outlines import Places
from .overlaps import without_overlaps
from .parts import advice, largest_part
from .strips import axes_of_strips, sides_of_laths
from .suspicions import (
    narrow_loops,
    refuse_stray_heights,
    refuse_strays,
    refuse_upright,
    without_bolts,
)

_FAR = 20.0  # sizes from the origin beyond which a drawing is moved there
_DIGITS = 9  # of the size, that points are written with
_SUSPICIOUS = (
    20.0  # times the tolerance: ends that stop so near to another curve may be meant on it
)
# Causes of what is wrong with a network.
_CROWDED, _SHORT = "crowded", "short"
_IN_SPACE = (
    "the net is drawn in space and read as a height field, seen along {}: where it hangs over, "
    "turn it, or give its --surface with --chart conformal"
)
_APART = ("crosses no other curve", "is not connected", "nothing is left", "at least 3 joints")


@dataclass(frozen=True)
class ReadingOptions:
    """How a drawing is read.

    layers : of DXF files, those to read; default: all that can be seen
    kind : "spline": curves go smoothly through all points; "polyline": with the corners drawn
    scale : units of the design in one of the drawing
    free_ends : whether rods go on beyond their last joint
    join : "auto", "always" or "never", see `join_ends`
    tolerance : share of the drawing's size, see `cleaned`
    largest_part : whether curves that aren't connected with the largest part are left out
    edges : whether the edges of a mesh, or graph, are the curves
    ends_kept_by : the option that sets `free_ends`, as messages name it; "" where there is none
    """

    layers: Sequence[str] = ()
    kind: str = "spline"
    scale: float = 1.0
    free_ends: bool = False
    join: str = "auto"
    tolerance: float = TOLERANCE
    largest_part: bool = False
    edges: bool = False
    ends_kept_by: str = ""


@dataclass(frozen=True)
class DrawnNetwork:
    """What was understood of a drawing.

    drawing : as it was read; options : how
    curves : whole curves, in the drawing's coordinates less its origin
    frame : the plane that they were laid into
    entries : the field `curves` of a design file
    findings : what a reader should know
    parts : what to do where the curves fall into parts that aren't connected
    origin (3,) : what was taken off the coordinates of a drawing that lies far from (0, 0, 0); zero
        for others
    """

    drawing: Drawing
    options: ReadingOptions
    curves: list[DrawnCurve]
    frame: Frame
    entries: list[dict[str, Any]]
    findings: list[Finding] = field(default_factory=list)
    parts: str | None = None
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def placed(self) -> dict[str, list[float]]:
        """The field `origin` of a design file; nothing where it would say nothing."""
        if not (self.origin.any() and self.frame.standard):
            return {}
        return {"origin": (self.options.scale * self.origin).tolist()}

    @property
    def labels(self) -> list[str]:
        """What the curves are called in the drawing."""
        return [curve.label for curve in self.curves]

    @property
    def network(self) -> CurveNetwork:
        """The curves, joined where they cross. Raises InputError, naming the curve as the drawing
        does, where no network comes of them (see `network.network`)."""
        if isinstance(self._joined, InputError):
            error = self._joined
            raise InputError(error.message, field=error.field, value=error.value)
        return self._joined

    @cached_property
    def _joined(self) -> CurveNetwork | InputError:
        """The network, or why there is none: found once, whoever asks again."""
        try:
            return network(
                self._curves(),
                free_ends=self.options.free_ends,
                acute=True,
                ends_kept_by=self.options.ends_kept_by,
                tolerance=self.options.tolerance * self.options.scale * size_of(self.curves),
            )
        except InputError as error:
            named = self.named(error)
            more = self._crowded() or self._short_of(named.field) or self._advice(named)
            if more is None:
                return named
            message = f"{named.message}. {more[0].upper()}{more[1:]}"
            return InputError(message, field=named.field, value=named.value)

    def named(self, error: InputError) -> InputError:
        """An error about a design with curves and places named as in the drawing."""

        def label(found: re.Match) -> str:
            number = int(found[1])
            return self.labels[number] if number < len(self.labels) else found[0]

        def renamed(text: str) -> str:
            return re.sub(r"(?:network\.)?curves\[(\d+)\](?:\.points)?", label, text)

        field = None if error.field is None else renamed(error.field)
        located = error.moved(self.place)
        return InputError(
            renamed(located.message), source=error.source, field=field, value=error.value
        )

    def place(self, point: Sequence[float]) -> str:
        """A point (2,) of the network, or (3,) of the curves, as the drawing has it, in words."""
        if len(point) == 2:
            drawn = self.frame(np.concatenate([curve.points for curve in self.curves]))
            plan = np.array(point) / self.options.scale
            nearest = int(np.hypot(*(drawn[:, :2] - plan).T).argmin())
            spot = self.frame.back(np.append(plan, drawn[nearest, 2]))
        else:
            spot = np.array(point, float)
        return Places(size_of(self.curves), self.origin)(spot)

    @property
    def _across(self) -> int:
        """The axis that a net in space is seen along."""
        return int(np.argmax(np.abs(self.frame.axes[2])))

    def _crowded(self) -> str | None:
        """What was said of places where too many curves end."""
        return next((f.text for f in self.findings if f.cause == _CROWDED), None)

    def _short_of(self, label: str | None) -> str | None:
        """What was said of a curve that stops a little short of others, or the other way round."""
        found = (f.text for f in self.findings if f.cause == _SHORT and label in f.labels)
        return next(found, None)

    def _advice(self, error: InputError) -> str | None:
        """What to do where the drawing falls into parts, or is in space."""
        if not any(words in error.message for words in _APART):
            return None if self.frame.flat else _IN_SPACE.format("xyz"[self._across])
        return self.parts

    def _curves(self) -> list[Curve]:
        return [curve_from_dict(e, f"curves[{k}]") for k, e in enumerate(self.entries)]


def read_network(
    path: str | Path, options: ReadingOptions = ReadingOptions(), *, space: bool = False
) -> DrawnNetwork:
    """The network that an OBJ or DXF file draws.

    space : whether nets that don't lie in a plane are taken, as seen along an axis

    Raises InputError for files that can't be read and drawings that are in no plane.
    """
    drawing = read_drawing(path, options.layers)
    try:
        return drawn_network(drawing, options, space=space)
    except InputError as error:
        raise error.at(path) from None


def drawn_network(
    drawing: Drawing, options: ReadingOptions = ReadingOptions(), *, space: bool = False
) -> DrawnNetwork:
    """The network of a drawing, see `read_network`."""
    size = size_of(drawing.curves)
    if not size > 0:
        raise InputError("all points are the same")
    tolerance = options.tolerance * size
    findings = [Finding("skipped", text) for text in drawing.skipped]
    findings += [Finding("suspicious", text) for text in drawing.doubts]
    # drawings in planes of their own have origins of their own
    standard = frame_of(drawing.curves, size).standard
    points = np.concatenate([curve.points for curve in drawing.curves])
    middle_of(points, "curves")  # refuses what lies too far away to be told apart
    origin = far_origin(points) if standard else np.zeros(3)
    say = Places(size, origin)
    near = [replace(curve, points=curve.points - origin) for curve in drawing.curves]
    curves, done = cleaned(near, tolerance)
    if 2 * len(curves) < len(near):
        refuse_strays(drawing.curves, tolerance, size)
    frame = frame_of(curves, size)
    if not frame.flat:
        refuse_stray_heights(curves, tolerance)
    if not frame.flat and not space:
        extent = np.ptp(np.concatenate([c.points for c in curves]), axis=0)
        raise InputError(
            "the curves must lie in a plane; they extend by "
            f"{', '.join(f'{length:.4g}' for length in extent)} along x, y, z, and leave the "
            f"nearest plane by {100 * frame.height:.2g} % of their size"
        )
    if frame.flat and not frame.standard:
        where = f"turned by {np.degrees(frame.tilt):.3g}° against the xy plane"
        findings.append(Finding("cleaned", f"the drawing's plane, {where}, is laid flat"))
    curves, overlaps = without_overlaps(curves, frame, tolerance, say)
    flat = [frame(curve.points)[:, :2] for curve in curves]
    refuse_upright(curves, flat, tolerance)
    strips: list[Finding] = []
    if frame.flat:
        curves, flat, strips = axes_of_strips(curves, flat, tolerance)
    curves, flat, bolts = without_bolts(curves, flat, size)
    done += [*overlaps, *strips, *bolts, *narrow_loops(curves, flat)]
    if options.largest_part:
        curves, flat, others = largest_part(curves, flat, tolerance)
        done += others
    parts = advice(curves, flat, tolerance)
    if options.kind == "spline":
        curves, flat, split = split_at_corners(curves, flat, say)
        done += split
    done += sides_of_laths(curves, flat, tolerance)
    joined = join_ends(
        curves, crossing_pieces(curves, flat, tolerance, size), tolerance, options.join
    )
    curves, ends = _ends_on_curves(joined.curves, frame, options, tolerance, say)
    findings += [*done, *_about_joins(joined, say), *ends]
    if options.kind == "spline":
        findings += rounded_corners(curves)
    entries = [_entry(curve, frame, options, size) for curve in curves]
    return DrawnNetwork(drawing, options, curves, frame, entries, findings, parts, origin)


def far_origin(points: np.ndarray) -> np.ndarray:
    """(3,) what to take off coordinates so that they lie near the origin: whole numbers; zero for
    points that are not far away already, as sizes go."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.linalg.norm(high - low))
    middle = (low + high) / 2
    return np.round(middle) if np.linalg.norm(middle) > _FAR * size > 0 else np.zeros(3)


def _entry(curve: DrawnCurve, frame: Frame, options: ReadingOptions, size: float) -> dict[str, Any]:
    digits = _DIGITS - int(np.floor(np.log10(size * options.scale)))
    points = (options.scale * frame(curve.points)[:, :2]).round(digits).tolist()
    kind = "polyline" if len(points) == 2 else options.kind
    return {"type": kind, "points": points} | ({"closed": True} if curve.closed else {})


def _about_joins(joined: Any, say: Places) -> list[Finding]:
    """What was joined and what was hinged, in words."""
    found = []
    if len(joined.seams):
        text = f"{counted(len(joined.seams), 'seam')} joined: pieces that go on in each other"
        found.append(Finding("joined", text, joined.seams))
    if len(joined.tips):
        text = (
            f"{counted(len(joined.tips), 'tip')} hinged: ends that meet and are of different curves"
        )
        found.append(Finding("hinged", text, joined.tips))
    if len(joined.by_turn):
        text = (
            f"at {len(joined.by_turn)} of these places the two families say nothing, or the curve "
            "has a corner: the turn alone decided (--join always or never decides otherwise)"
        )
        found.append(Finding("suspicious", text, joined.by_turn))
    if len(joined.crowded):
        text = (
            "more than four ends of curves meet at "
            f"{counted(len(joined.crowded), 'place')}, such as "
            f"{say(joined.crowded[0])}: a joint holds two laths, of which at most four ends "
            "meet"
        )
        found.append(Finding("suspicious", text, joined.crowded, _CROWDED))
    if not joined.families:
        text = (
            "the curves don't fall into two families that cross only each other: they brace each "
            "other and will hardly open like scissors"
        )
        found.append(Finding("suspicious", text))
    return found


def _ends_on_curves(
    curves: list[DrawnCurve],
    frame: Frame,
    options: ReadingOptions,
    tolerance: float,
    say: Places,
) -> tuple[list[DrawnCurve], list[Finding]]:
    """Ends within the tolerance of another curve brought onto it; and what looks like a miss."""
    plain = replace(options, scale=1.0)
    size = size_of(curves)
    flat = [curve_from_dict(_entry(curve, frame, plain, size), curve.label) for curve in curves]
    contacts = end_contacts(flat, _SUSPICIOUS * tolerance)
    exact = 1e-6 * size
    reached = {(c.curve, c.end) for c in contacts if abs(c.beyond) <= exact}
    points = [curve.points.copy() for curve in curves]
    moved: list[np.ndarray] = []
    largest, near = 0.0, []
    for contact in sorted(contacts, key=lambda c: abs(c.beyond)):
        place = (contact.curve, contact.end)
        if place in reached or abs(contact.beyond) <= exact:
            continue
        short = contact.beyond < 0
        if abs(contact.beyond) <= tolerance and (short or options.free_ends):
            height = frame(points[contact.curve][contact.end])[2]
            spot = frame.back(np.append(contact.position, height))
            points[contact.curve][contact.end] = spot
            reached.add(place)
            moved.append(spot)
            largest = max(largest, abs(contact.beyond))
        elif short and contact.beyond < -tolerance:
            near.append(contact)
    found = []
    if moved:
        text = (
            f"{counted(len(moved), 'end')} brought onto the curves beside, by {largest:.3g} at most"
        )
        found.append(Finding("cleaned", text, np.array(moved)))
    found += _missed(curves, [c for c in near if (c.curve, c.end) not in reached], say)
    return [replace(curve, points=x) for curve, x in zip(curves, points)], found


def _missed(curves: Sequence[DrawnCurve], near: Sequence[EndContact], say: Places) -> list[Finding]:
    """Ends that stop a little short of another curve; where both curves end there, this is told of
    the one that is nearer."""
    told: list[EndContact] = []
    for contact in near:
        others_end = [o for o in told if (o.curve, o.other) == (contact.other, contact.curve)]
        if not any(
            np.hypot(*(o.position - contact.position)) <= abs(o.beyond) + abs(contact.beyond)
            for o in others_end
        ):
            told.append(contact)
    found = []
    for contact in told:
        labels = (curves[contact.curve].label, curves[contact.other].label)
        place = curves[contact.curve].points[contact.end][None]
        text = (
            f"{labels[0]} ends {-contact.beyond:.3g} short of {labels[1]} at {say(place[0])}: a "
            "joint may be meant (--tolerance)"
        )
        found.append(Finding("suspicious", text, place, _SHORT, labels))
    return found


def network_summary(found: CurveNetwork) -> Mapping[str, Any]:
    """Figures of a network, lengths in its own unit: joints, spans, angles between its families."""
    spans = np.concatenate([strand.lengths for strand in found.strands])
    angles = np.degrees(found.opening_angles[found.opens])
    return {
        "curves": len(found.strands),
        "joints": found.n_joints,
        "spans": len(spans),
        "shortest_span": float(spans.min()) if len(spans) else None,
        "median_span": float(np.median(spans)) if len(spans) else None,
        "longest_span": float(spans.max()) if len(spans) else None,
        "size": found.size,
        "mean_angle_deg": float(angles.mean()) if len(angles) else None,
        "families": bool(found.opens.all()),
    }

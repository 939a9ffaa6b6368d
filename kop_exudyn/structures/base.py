"""What every structure class offers to the kit and the optimiser: elements, states to solve, a
target to fit.

A structure class is one module in this folder that registers a `Design` subclass; nothing else has
to change.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from ..arrays import Indices, Numbers, Parameters, Points, Triangles, Vector
from ..errors import InputError, did_you_mean
from ..files.documents import check_range, check_schema, has_schema
from ..files.json_files import plain
from ..geometry.triangles import TriangleSurface
from ..kit.groups import ElementGroup
from ..plugins import Registry
from ..units import Units, units_from_dict
from ..wording import counted
from .hardware import CellHardware
from .links import joint_links
from .loads import FILE_LOADS, LoadCase, load_cases_from_dict, tributary_areas

if TYPE_CHECKING:
    from ..equilibrium.equilibria import Equilibrium, Start
    from ..equilibrium.system import System
    from ..scene.scene import Scene
    from ..scene.state import State
    from .opening import Way

_WORKSPACES = "_workspaces"  # of the solver, by thread


_NO_FILE = "design"  # what errors begin with where the content is of no file
# what files have to say of themselves, and contents that scripts make need not
_ENVELOPE = {"format": "kop_exudyn/design", "version": 1}
# An engine's way from a start to an equilibrium, with the parameters of `equilibrium.newton.solve`.
Solve = Callable[..., "Equilibrium"]


@dataclass(frozen=True)
class Target:
    """The shape that a design should keep.

    vertices (V, 3), faces (F, 3) : the target surface
    positions (n_joints, 3) : where the joints were in the input design's deployed state
    size : of the surface, l0, to which percentages refer: see `geometry.extent.size_of_points`
    """

    vertices: Points
    faces: Triangles
    positions: Points
    size: float

    @cached_property
    def surface(self) -> TriangleSurface:
        """The surface with its search tree, which everything that measures distances from this
        target shares."""
        return TriangleSurface(self.vertices, self.faces)


@dataclass(frozen=True)
class Role:
    """One equilibrium that the objective looks at.

    name : "deployed" (fit and energy) or another name such as "rest" (energy only)
    opening : prescribed mean hinge angle, or None without actuation
    fitted : whether the joints of this state are compared with the target
    """

    name: str
    opening: float | None = None
    fitted: bool = False


MADE_ANEW = (_WORKSPACES, "way")  # in every process, and for every copy


class Design(ABC):
    """One bending-active structure, ready to be simulated for any value of its parameters q.

    Attributes set by subclasses
    ----------------------------
    name : the design's name
    parameters : (nq,) q of the input design
    lower, upper : (nq,) bounds within which an element can exist at all (inf where free)
    groups : the elements, a list of `ElementGroup`
    roles : the states to solve; exactly one of them is fitted
    joints : (n_joints,) body indices of the joints that are compared with the target
    """

    class_name: ClassVar[str]
    # Weight of the fit in the objective, against 0.02 for the energy, that suits the class: stiff
    # structures whose shape hardly depends on their parts need more of it, those with many soft
    # modes less.
    fit_weight: ClassVar[float] = 1e4
    # Whether rods lie beside the target, so that only the joints' distances from it count.
    beside_target: ClassVar[bool] = False
    # Weight of the stress, over the input design's: where highly stressed designs have several
    # stable states, a little of it leads the search to those that open by themselves.
    stress_weight: ClassVar[float] = 0.0
    # Typical change of parameters that belong to no element.
    free_scale: float = 1.0
    # What acts on the deployed design; the shape that a kit is sought for is the unloaded one.
    loads: LoadCase = LoadCase()
    # All cases in which something acts: what the design has to carry, one after the other.
    load_cases: tuple[LoadCase, ...] = ()
    # Of all its numbers; None where its file names none.
    units: Units | None = None
    # The file that it was read from, which errors name.
    source: str | None = None
    # (3,) where the scenes' coordinates begin in those of the design's own file: zero, unless it
    # lies far from the origin (see `geometry.centring`).
    middle: Vector = np.zeros(3)
    # (3,) where they begin in those of its user's other files.
    # Numbers here stay small; what is written for other programs has it added.
    origin: Vector = np.zeros(3)
    name: str
    parameters: Parameters
    lower: Parameters
    upper: Parameters
    groups: list[ElementGroup]
    roles: tuple[Role, ...]
    joints: Indices

    def __repr__(self) -> str:
        unit = "" if self.units is None else f", in {self.units.length}"
        return (
            f"<{self.class_name} design {self.name!r}: {counted(self.n_elements, 'element')}{unit}>"
        )

    @abstractmethod
    def scene(self, role: str) -> Scene:
        """The scene of one of the roles; the same object at every call."""

    def checked(self, q: Parameters | None) -> Parameters:
        """(nq,) parameters that a caller gives, or the input's in place of None. Raises InputError
        for another number of them, and for what isn't finite."""
        if q is None:
            return self.parameters
        try:
            given = np.asarray(q, float)
        except (TypeError, ValueError):
            raise InputError("expected numbers", field="q", value=type(q).__name__) from None
        if given.shape != self.parameters.shape:
            raise InputError(
                f"expected the {len(self.parameters)} parameters of {self.name}, got an array of "
                f"the shape {given.shape}",
                field="q",
            )
        if not np.isfinite(given).all():
            raise InputError("must be finite", field=f"q[{int(np.argmin(np.isfinite(given)))}]")
        return given

    @abstractmethod
    def deploy(
        self, q: Parameters | None = None, solve: Solve | None = None
    ) -> dict[str, Equilibrium]:
        """Equilibria of all roles from the design's own starting geometry (no warm start), at q
        (default: the input).

        q : (nq,), see `checked`
        solve : of an engine, as `equilibrium.newton.solve`, which is the default

        Their `iterations` and `wall_s` count all solves that led to them (see `Equilibrium.after`).
        Raises SimulationFailure when one of them can't be reached.
        """

    def check_state(self, role: str, state: State) -> None:  # noqa: B027
        """Raise SimulationFailure for an equilibrium of a role that no structure can have, say as
        its rods would pass through each other. By default there is none."""

    @cached_property
    @abstractmethod
    def target(self) -> Target:
        """The target; may need simulations of the input design, so it is computed at first use and
        kept."""

    @cached_property
    def joint_areas(self) -> tuple[Numbers, Numbers]:
        """The areas of the target surface that its joints carry, see `tributary_areas`: the cells
        are those between the rods. Raises InputError for joints that span no surface."""
        links = joint_links(self.scene(self.fitted_role.name), self.joints)
        return tributary_areas(self.target.positions, links)

    def report_positions(self, state: State) -> Points:
        """Joint positions (n, 3) in the order, the units and the place of the design's own
        file."""
        return self.middle + state.positions[self.joints]

    def file_with(self, data: Mapping[str, Any], q: Parameters) -> dict[str, Any]:
        """The content of a design file like the design's own, with other parameters.

        data : of the design's own file; q : (nq,)

        Raises InputError for classes whose files have no fields for parameters.
        """
        raise InputError(
            "files of this class have no fields for other parameters than those that follow from "
            "the rest of them",
            field="class",
            value=self.class_name,
        )

    @property
    def hardware(self) -> CellHardware | None:
        """Arms and plates, of classes whose parts are cells; None of others."""
        return None

    @property
    def doubts(self) -> list[str]:
        """What looks like a mistake in the design's own data, in words, as imports and simulations
        tell it."""
        return []

    @property
    def cautions(self) -> list[str]:
        """What else to know of the design before a kit is sought for it, in words, as `kop check`
        prints them."""
        return []

    @property
    def file_origin(self) -> Vector:
        """(3,) where the coordinates of the design's own file begin in those of its user's other
        files: what `report_positions` lacks of them."""
        return self.origin - self.middle

    @property
    def fitted_role(self) -> Role:
        return next(role for role in self.roles if role.fitted)

    @property
    def systems(self) -> dict[str, System]:
        """Solver workspaces by the names of scenes (the roles', and of stations on the way), made
        at first use: each thread has its own."""
        own = self.__dict__.setdefault(_WORKSPACES, threading.local())
        if not hasattr(own, "systems"):
            own.systems = _Systems(self)
        return own.systems

    def __getstate__(self) -> dict[str, Any]:
        """What travels to another process: everything but the solver workspaces, which are made
        anew there."""
        return {key: value for key, value in self.__dict__.items() if key not in MADE_ANEW}

    @cached_property
    def way(self) -> Way | None:
        """The way from the assembly to the deployed state; None for what is assembled in place."""
        return None

    def assembled(self, q: Parameters, equilibria: Mapping[str, Equilibrium]) -> Start:
        """Where the way begins, for parameters q; equilibria of other roles than the fitted one are
        known already."""
        raise NotImplementedError(f"{self.class_name} designs are assembled in place")

    def opened_through(
        self, q: Parameters, equilibria: Mapping[str, Equilibrium]
    ) -> dict[str, Equilibrium]:
        """The states that a builder opens the design through, in order and by name, the deployed
        one last; none of what is assembled in place.

        q : (nq,) parameters; equilibria : those of the other roles at q
        Raises SimulationFailure where a state isn't found.
        """
        if self.way is None:
            return {}
        found = self.way.opened(self.systems, q, self.assembled(q, equilibria))
        names = [station.name for station in (*self.way.stations, self.way.deployed)]
        return dict(zip(names, found))

    @property
    def free(self) -> Indices:
        """(k,) parameters that belong to no element, such as places of supports: no part has to
        realise them."""
        used = [group.indices.ravel() for group in self.groups]
        return np.setdiff1d(np.arange(len(self.parameters)), np.concatenate(used) if used else used)

    @property
    def n_elements(self) -> int:
        return sum(len(group.indices) for group in self.groups)


class _Systems(dict[str, "System"]):
    """A design's workspaces, each made when it is first asked for."""

    def __init__(self, design: Design):
        super().__init__()
        self._design = design

    def __missing__(self, name: str) -> System:
        from ..equilibrium.system import System

        return self.setdefault(name, System(self._design.scene(name)))


Reader = Callable[[Mapping[str, Any], str], Design]
R = TypeVar("R", bound=Reader)
CLASSES: Registry[Reader] = Registry(__package__)


@dataclass(frozen=True)
class ForeignFormat:
    """Files of other programs that are designs as they are.

    recognises : whether a file's content is of this format, perhaps damaged
    read : makes the design of the content and the file's name
    rewrite : makes the content of a design file of our own, of the content, the design's name and
        the file's name; None: there is no such file
    """

    recognises: Callable[[Any], bool]
    read: Reader
    rewrite: Callable[[Mapping[str, Any], str, str], dict[str, Any]] | None = None


FORMATS: Registry[ForeignFormat] = Registry(__package__, "formats")


def register_format(
    name: str,
    recognises: Callable[[Any], bool],
    read: Reader,
    rewrite: Callable[[Mapping[str, Any], str, str], dict[str, Any]] | None = None,
) -> None:
    """Make `load_design` and ``kop import`` know files of another program.

    name : of the format, as messages call such a file
    recognises, read, rewrite : see `ForeignFormat`
    """
    FORMATS.add(name, ForeignFormat(recognises, read, rewrite))


def foreign_format(data: Any) -> ForeignFormat | None:
    """The format of a file's content that isn't in our own; None where it is, or is nothing that is
    known."""
    for name in FORMATS.names():
        found = FORMATS.get(name)
        if found is not None and found.recognises(data):
            return found
    return None


def format_names() -> list[str]:
    """Names of the formats of other programs, sorted."""
    return FORMATS.names()


def register_class(class_name: str) -> Callable[[R], R]:
    """Decorator: the reader that makes a `Design` of a design file's content (a mapping) and its
    source name.

    class_name : the field "class" of such files
    """

    def add(reader: R) -> R:
        CLASSES.add(class_name, reader)
        return reader

    return add


def class_names() -> list[str]:
    """Names of all structure classes, sorted: those of this folder, and those of extensions."""
    return CLASSES.names()


def design_from_dict(data: Mapping[str, Any], source: str = _NO_FILE) -> Design:
    """Make the design that a design file's content describes.

    data : the content, as the class's schema describes it; arrays and tuples are lists
    source : name of the file, which errors begin with and files that it names lie beside

    Raises InputError when the class is unknown or a field is missing, unknown or unusable.
    """
    if not isinstance(data, Mapping):
        raise InputError("expected a design file's content", source=source, value=data)
    data = plain(data, finite=False)
    check_range(data, source)
    whole = {**_ENVELOPE, **data}
    check_schema(whole, "design", source)
    class_name = data["class"]
    reader = CLASSES.get(class_name)
    if reader is None:
        raise InputError(
            f"unknown structure class ({did_you_mean(class_name, class_names())}"
            f"known: {', '.join(class_names())})",
            source=source,
            field="class",
            value=class_name,
        )
    if has_schema(class_name):
        check_schema(whole, class_name, source)
    try:
        near, middle = centred(data)
    except InputError as error:
        raise error.at(source) from None
    try:
        design = reader(near, source)
    except InputError as error:
        raise error.moved(lambda place: np.add(place, middle[: len(place)])) from None
    if middle.any():
        design.middle = middle
    design.source = None if source == _NO_FILE else str(source)
    if "units" in data:
        design.units = units_from_dict(data["units"])
    design.origin = design.middle + np.array(data.get("origin", (0.0, 0.0, 0.0)), float)
    cases = load_cases_from_dict(data)
    for case in cases:
        case.check(len(design.joints), source)
        if case.empty and (case.name != FILE_LOADS or "loads" in data):
            raise InputError(
                f"nothing acts in {case.name}: leave it out", source=source, field=case.name
            )
    if cases:
        design.loads = cases[0]
        design.load_cases = tuple(case for case in cases if not case.empty)
    return design


Centring = Callable[[Mapping[str, Any]], tuple[Mapping[str, Any], np.ndarray]]
_CENTRINGS: dict[str, Centring] = {}


def register_centring(class_name: str) -> Callable[[Centring], Centring]:
    """Decorator: the function that gives a design file's content seen from its own middle, and
    that middle (3,): see `geometry.centring`. Files of classes without one are read as they
    are."""

    def add(centring: Centring) -> Centring:
        _CENTRINGS[class_name] = centring
        return centring

    return add


def centred(data: Mapping[str, Any]) -> tuple[Mapping[str, Any], np.ndarray]:
    """A design file's content around the origin, and where its own coordinates have that place
    (3,), zero for designs that lie near the origin anyway. Raises InputError for such as lie too
    far away."""
    centring = _CENTRINGS.get(data["class"])  # read by now
    if centring is None:
        return data, np.zeros(3)
    try:
        return centring(data)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        if isinstance(error, InputError):
            raise
        return data, np.zeros(3)  # a field is missing or wrong: what reads it says so


Rescaling = Callable[[Mapping[str, Any], float], dict[str, Any]]
_RESCALINGS: dict[str, Rescaling] = {}


def register_rescaling(class_name: str) -> Callable[[Rescaling], Rescaling]:
    """Decorator: the function that gives a design file's content at another size, all lengths of
    elements multiplied by a factor and sections kept. Classes whose designs can't be rescaled have
    none."""

    def add(rescaling: Rescaling) -> Rescaling:
        _RESCALINGS[class_name] = rescaling
        return rescaling

    return add


def can_be_rescaled(design: Design) -> bool:
    """Whether there are designs of this class at other sizes that share parts with it."""
    return design.class_name in _RESCALINGS


def rescaled(data: Mapping[str, Any], factor: float) -> dict[str, Any]:
    """A design file's content at another size, see `register_rescaling`.

    data : of a file that has been read as a design; factor : positive

    Raises InputError for classes whose designs can't be rescaled.
    """
    class_name = data.get("class")
    for name in class_names():
        CLASSES.get(name)  # reading a class's module registers what it has
    if class_name not in _RESCALINGS:
        raise InputError(
            f"designs of this class can't be rescaled (those of {', '.join(sorted(_RESCALINGS))} "
            "can)",
            field="class",
            value=class_name,
        )
    return _RESCALINGS[class_name](data, factor)

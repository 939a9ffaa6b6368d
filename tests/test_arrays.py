"""The public interface names its arrays by shape, and they have these shapes."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from functools import cached_property
from typing import Annotated, Any, get_args, get_origin

import numpy as np
import pytest

import kop_exudyn as kop
from kop_exudyn import arrays

ALIASES = {n: get_args(a) for n, a in vars(arrays).items() if get_origin(a) is Annotated}
SHAPES = {name: args[1] for name, args in ALIASES.items()}
KINDS = {name: get_args(get_args(args[0])[1])[0] for name, args in ALIASES.items()}


def functions(item: type) -> Iterator[tuple[str, Any]]:
    """The public functions of a class, those behind its properties included."""
    for name, member in vars(item).items():
        if isinstance(member, property):
            member = member.fget
        elif isinstance(member, cached_property):
            member = member.func
        elif isinstance(member, (classmethod, staticmethod)):
            member = member.__func__
        if inspect.isfunction(member) and (not name.startswith("_") or name == "__getitem__"):
            yield name, member


def signatures() -> Iterator[tuple[str, str]]:
    """Place and annotation of every field, parameter and returned value of the public interface."""
    for name in kop.__all__:
        item = getattr(kop, name)
        if inspect.isclass(item):
            for field, annotation in inspect.get_annotations(item).items():
                if not field.startswith("_"):
                    yield f"{name}.{field}", str(annotation)
        members = functions(item) if inspect.isclass(item) else [("", item)]
        for member, function in members:
            if inspect.isfunction(function):
                for parameter, annotation in inspect.get_annotations(function).items():
                    yield f"{name}.{member}({parameter})", str(annotation)


def test_every_array_of_the_public_interface_has_a_shape():
    found = dict(signatures())
    assert len(found) > 200 and "ElementIndices" in found["ElementGroup.indices"]
    bare = {place: a for place, a in found.items() if "ndarray" in a or "NDArray" in a}
    assert not bare


def misfits(item: Any, sizes: dict[str, int]) -> list[str]:
    """What of a public object's fields and properties hasn't the shape or the kind of its alias.

    sizes : what the letters of shapes stand for in this object; filled in on the way
    """
    found = []
    for owner in reversed(type(item).__mro__):
        annotated = {k: str(a) for k, a in inspect.get_annotations(owner).items()}
        for name, member in vars(owner).items():
            function = member.fget if isinstance(member, property) else None
            function = member.func if isinstance(member, cached_property) else function
            if function is not None:
                annotated[name] = str(inspect.get_annotations(function).get("return"))
        for name, annotation in annotated.items():
            alias = next((a for a in SHAPES if a in annotation.replace("|", " ").split()), None)
            if alias is not None and (value := getattr(item, name)) is not None:
                found += [f"{name}: {why}" for why in why_not(value, alias, sizes)]
    return found


def why_not(value: np.ndarray, alias: str, sizes: dict[str, int]) -> list[str]:
    """Why an array isn't of an alias."""
    shape = SHAPES[alias]
    if len(shape) != value.ndim:
        return [f"{value.shape} for {shape}"]
    own = sizes if alias != "Numbers" and alias != "Indices" and alias != "Points" else {}
    wrong = [
        f"{value.shape} for {shape}"
        for length, letter in zip(value.shape, shape)
        if length != (own.setdefault(letter, length) if isinstance(letter, str) else letter)
    ]
    kind = np.dtype(KINDS[alias]).kind
    return wrong + ([f"{value.dtype} for {kind}"] if value.dtype.kind != kind else [])


@pytest.fixture(scope="module")
def result(repository):
    return kop.simulate(kop.load_design(repository / "models" / "small" / "01_sinh.json"))


def test_designs_and_simulations(result):
    design = result.design
    sizes: dict[str, int] = {}
    assert misfits(design, sizes) == [] and sizes["n_q"] == len(design.parameters)
    assert misfits(result, {}) == [] and misfits(design.target, {}) == []
    for group in design.groups:
        assert misfits(group, {}) == []
    assert why_not(design.report_positions(result.deployed.state), "Points", {}) == []
    case = kop.LoadCase(gravity=[0, 0, -9.81], joints=[1, 2], forces=[[0, 0, 1], [1, 0, 0]])
    assert misfits(case, {}) == []


def test_kits_and_assignments(result):
    design = result.design
    found = kop.cluster(design.groups, design.parameters, {"linear": 3, "angular": 2})
    kit, assignment, sizes = found.kit, found.assignment, {"n_q": len(design.parameters)}
    assert misfits(kit, {}) == []
    for kind in kit.parts:
        assert why_not(kit[kind], "Parts", {}) == []
    for rows in (*assignment.part, *assignment.variant, *assignment.pieces(kit).values()):
        assert why_not(rows, "Indices", {}) == []
    assert why_not(assignment.realise(kit, design.parameters), "Parameters", sizes) == []
    assert why_not(assignment.contact(design.parameters, kit)[1], "ParameterFlags", sizes) == []


def test_sensitivities(result):
    design = result.design
    role = design.fitted_role.name
    found = kop.Sensitivities(design.systems[role], result.deployed)
    sizes = {"n_q": len(design.parameters)}
    n = len(design.scene(role).elements)
    ones = np.ones((n, 6))
    values = {
        "ParameterRows": found.positions(design.joints),
        "Parameters": found.stress_adjoint(ones),
        "ParameterHessian": found.potential_hessian,
        "StressRows": found.stresses_of(np.arange(3)),
    }
    for alias, value in values.items():
        assert why_not(value, alias, dict(sizes)) == []
    for name in ("energy_gradient", "potential_gradient", "torque_gradient"):
        assert why_not(getattr(found, name), "Parameters", dict(sizes)) == []
    assert why_not(found.full, "ParameterRows", dict(sizes)) == []
    factors = np.ones((3, 2, 6))
    assert why_not(factors, "StressFactors", {}) == []
    assert why_not(found.stress_rows(np.arange(3), factors), "ParameterRows", dict(sizes)) == []


def test_wrong_shapes_and_kinds_are_seen():
    """The control: what the tests above look for is found where it is."""
    assert why_not(np.zeros((2, 2)), "Points", {}) == ["(2, 2) for ('n', 3)"]
    assert why_not(np.zeros(3, int), "Vector", {}) == ["int64 for f"]
    assert why_not(np.zeros(4), "Parameters", {"n_q": 5}) == ["(4,) for ('n_q',)"]
    assert why_not(np.zeros((4, 5)), "ParameterHessian", {})

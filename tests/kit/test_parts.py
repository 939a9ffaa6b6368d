"""Kits and assignments: order of the parameters, files, and the map from parts to elements."""

import json

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.kit.assign import nearest
from kop_exudyn.kit.groups import ElementGroup
from kop_exudyn.kit.parts import Assignment, Kit

KIT = Kit({"linear": [[1, 2], [3, 4]], "angular": [0.5, 1.0]})
GROUPS = [
    ElementGroup("linear", np.array([[0, 1], [2, 3]])),
    ElementGroup("linear", np.array([[4]])),
    ElementGroup("angular", np.array([[6], [5]])),
]
Q = np.array([2.1, 1.1, 3.1, 4.1, 3.9, 0.6, -0.9, 7.0])


def test_vector_order_is_by_kind_then_part():
    np.testing.assert_array_equal(KIT.vector, [0.5, 1, 1, 2, 3, 4])
    doubled = KIT.with_vector(2 * KIT.vector)
    np.testing.assert_array_equal(doubled["linear"], [[2, 4], [6, 8]])
    lower, upper = KIT.bounds({"linear": (0.5, (5, 6))})
    np.testing.assert_array_equal(lower, [0, 0, 0.5, 0.5, 0.5, 0.5])
    np.testing.assert_array_equal(upper, [np.pi, np.pi, 5, 6, 5, 6])


def test_kit_survives_json():
    again = Kit.from_dict(json.loads(json.dumps(KIT.to_dict())))
    assert KIT.to_dict() == {"angular": [0.5, 1.0], "linear": [[1.0, 2.0], [3.0, 4.0]]}
    np.testing.assert_array_equal(again.vector, KIT.vector)


@pytest.mark.parametrize(
    "data, message",
    [
        ([], "non-empty object"),
        ({}, "non-empty object"),
        ({"curved": [[1]]}, "unknown kind"),
        ({"linear": [[1, 2], [3]]}, "lists of numbers"),
        ({"linear": [[1, 2, 3]]}, "2 parameters"),
        ({"linear": []}, "at least one part"),
        ({"linear": [["a", 2]]}, "lists of numbers"),
        ({"linear": [["1", "2"]]}, "lists of numbers"),
        ({"linear": None}, "lists of numbers"),
        ({"linear": [[1, float("nan")]]}, r"linear\[0\].*outside"),
        ({"linear": [[1, 2], [-1, 2]]}, r"linear\[1\].*outside"),
        ({"angular": [4.0]}, "outside"),
    ],
)
def test_malformed_kits(data, message):
    with pytest.raises(InputError, match=message) as caught:
        Kit.from_dict(data, source="kit.json")
    assert caught.value.source == "kit.json"


def test_matrix_gives_the_assigned_elements():
    assignment = nearest(GROUPS, Q, KIT)
    realised = assignment.matrix(KIT) @ KIT.vector
    np.testing.assert_array_equal(realised, [2, 1, 3, 4, 4, 0.5, -1, 0])
    np.testing.assert_array_equal(assignment.realise(KIT, Q), realised + [0, 0, 0, 0, 0, 0, 0, 7])
    assert {k: v.tolist() for k, v in assignment.pieces(KIT).items()} == {
        "angular": [1, 1],
        "linear": [1, 2],
    }


def test_assignment_survives_json_and_is_checked():
    assignment = nearest(GROUPS, Q, KIT)
    data = json.loads(json.dumps(assignment.to_dict()))
    assert Assignment.from_dict(data, GROUPS, len(Q), KIT).changes(assignment) == 0
    data[0]["part"][0] = 5
    with pytest.raises(InputError, match="doesn't exist"):
        Assignment.from_dict(data, GROUPS, len(Q), KIT)
    with pytest.raises(InputError, match="doesn't fit"):
        Assignment.from_dict(data[:2], GROUPS, len(Q), KIT)
    with pytest.raises(InputError, match="list of objects"):
        Assignment.from_dict({"part": 1}, GROUPS, len(Q), KIT)


def test_changes_counts_elements():
    assignment = nearest(GROUPS, Q, KIT)
    mirrored = nearest(GROUPS, np.array([1.1, 2.1, 3.1, 4.1, 1.2, 0.6, -0.9, 7.0]), KIT)
    assert assignment.changes(mirrored) == 2


def test_interval_parts_have_two_ends():
    kit = Kit({"slit": [[1, 2, 0.5]]})
    group = [ElementGroup("slit", np.array([[0, 1]]))]
    q = np.array([1.2, 3.0])
    assignment = nearest(group, q, kit)
    np.testing.assert_array_equal(assignment.matrix(kit) @ kit.vector, [1, 2])
    np.testing.assert_array_equal(assignment.matrix(kit, upper=True) @ kit.vector, [1.5, 2.5])
    np.testing.assert_array_equal(assignment.realise(kit, q), [1.2, 2.5])


def test_missing_kind():
    with pytest.raises(InputError, match="no parts of this kind"):
        nearest(GROUPS, Q, Kit({"linear": [[1, 2]]}))

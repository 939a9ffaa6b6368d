"""Design files: every mistake is named with file, field and value."""

import copy
import json
from dataclasses import dataclass

import numpy as np
import pytest

from kop_exudyn.errors import InputError
from kop_exudyn.files import documents
from kop_exudyn.files.documents import check_envelope, check_schema
from kop_exudyn.io import designs as designs_module
from kop_exudyn.io.datasets import load_designs
from kop_exudyn.io.designs import design_files, load_design
from kop_exudyn.structures import base


@dataclass
class Named:
    """What a reader made of a file."""

    name: str
    content: dict
    units: None = None
    middle: object = 0.0


@pytest.fixture
def named_class(monkeypatch):
    """A structure class without schema, whose reader keeps the content."""
    monkeypatch.setitem(
        base.CLASSES.items, "named", lambda data, source: Named(data["name"], dict(data))
    )


def design_data(name: str, **more) -> dict:
    return {"format": "kop_exudyn/design", "version": 1, "class": "named", "name": name, **more}


def changed(data: dict, path: list, value) -> dict:
    """A copy with one value replaced; removed where the value is ..., added where it isn't
    there."""
    data = copy.deepcopy(data)
    *parents, last = path
    place = data
    for step in parents:
        place = place[step]
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return data


def test_the_example_is_valid(c_shell_data):
    check_schema(c_shell_data, "c_shell")


def damaged(data, rng):
    """A copy of a design file's content, one place of which, wherever it is, is something else, is
    missing, or has a field more."""
    data = copy.deepcopy(data)
    places, waiting = [], [data]
    while waiting:
        place = waiting.pop()
        keys = list(place) if isinstance(place, dict) else range(len(place))
        for key in keys:
            places.append((place, key))
            if isinstance(place[key], (dict, list)):
                waiting.append(place[key])
    place, key = places[rng.integers(len(places))]
    others = (
        None,
        True,
        -1,
        0,
        2,
        2.0,
        1e-9,
        2**70,
        float("nan"),
        "",
        "up",
        [],
        [1.5],
        {},
        {"x": 1},
    )
    match rng.integers(4):
        case 0:
            del place[key]
        case 1 if isinstance(place, dict):
            place[f"{key}x"] = place[key]
        case _:
            place[key] = others[rng.integers(len(others))]
    return data


def complaint(data, schema):
    """What `check_schema` says."""
    try:
        check_schema(data, schema)
    except InputError as error:
        return str(error)
    return None


@pytest.mark.parametrize("model", ["conformals/01_sinh", "grids/01_dome", "umbrellas/dome"])
def test_what_is_accepted_quickly_is_what_is_accepted(repository, model, monkeypatch):
    """Two validators read the same schemas: nothing passes the quick one that the other refuses."""
    data = json.loads((repository / "models" / f"{model}.json").read_text(encoding="utf-8"))
    rng = np.random.default_rng(5)
    files = [damaged(data, rng) for _ in range(40)]
    schemas = ["design", data["class"]]
    found = [complaint(file, schema) for file in files for schema in schemas]
    monkeypatch.setattr(documents, "_is_accepted", lambda data, schema: False)
    assert found == [complaint(file, schema) for file in files for schema in schemas]
    assert 10 < sum(words is None for words in found) < 70


@pytest.mark.parametrize(
    "change",
    [
        (["section"], {"type": "circle", "radius": 0.1}),
        (["section"], {"type": "general", "area": 1, "inertia_y": 1, "inertia_z": 2, "torsion": 1}),
        (["crossings"], [{"curves": [0, 3], "near": [0, 0]}, {"curves": [1, 3]}]),
        (["crossings"], ...),
        (["curves", 0, "closed"], True),
        (["opening", "side"], "down"),
        (["material", "density"], 1e-9),
        (["comment"], "made by hand"),
    ],
)
def test_variations_are_valid(c_shell_data, change):
    check_schema(changed(c_shell_data, *change), "c_shell")


@pytest.mark.parametrize(
    "path, value, expected",
    [
        (["name"], ..., "name: is missing"),
        (["name"], "", "name = '': must not be empty"),
        (["name"], 3, "name = 3: must be a text"),
        (["material"], ..., "material: is missing"),
        (["material", "poisson"], ..., "material.poisson: is missing"),
        (["material", "young"], -1, "material.young = -1: must be positive"),
        (["material", "young"], True, "material.young = True: must be a number"),
        (["material", "poisson"], 0.6, "material.poisson = 0.6: must be at most 0.5"),
        (["material", "yuong"], 1, "material.yuong: unknown field (did you mean 'young'?)"),
        (
            ["elements_per_peice"],
            1,
            "elements_per_peice: unknown field (did you mean 'elements_per_piece'?)",
        ),
        (["colour"], 1, "colour: unknown field (known: class, "),
        (
            ["section", "type"],
            "tube",
            'section.type = \'tube\': must be one of "rectangle", "circle", "general"',
        ),
        (["section", "type"], ..., "section.type: is missing"),
        (
            ["section", "radius"],
            1,
            "section.radius: unknown field (known: half_lap, height, joint_hole, type, width)",
        ),
        (["section", "height"], ..., "section.height: is missing"),
        (["section", "width"], 0, "section.width = 0: must be positive"),
        (["section"], [1], "section = [1]: must be an object"),
        (["curves"], [], "curves = []: must have at least 2 entries"),
        (["curves", 2], 5, "curves[2] = 5: must be an object"),
        (
            ["curves", 2, "points"],
            [[0, 0]],
            "curves[2].points = [[0, 0]]: must have at least 2 entries",
        ),
        (
            ["curves", 2, "points", 1],
            [0, 0, 0],
            "curves[2].points[1] = [0, 0, 0]: must have at most 2 entries",
        ),
        (["curves", 2, "points", 1, 0], "0", "curves[2].points[1][0] = '0': must be a number"),
        (
            ["curves", 0, "type"],
            "nurbs",
            'curves[0].type = \'nurbs\': must be one of "spline", "polyline"',
        ),
        (["curves", 0, "closed"], 1, "curves[0].closed = 1: must be true or false"),
        (["crossings"], "all", "crossings = 'all': must be \"find\""),
        (["crossings"], 3, "crossings = 3: must be a text or a list"),
        (
            ["crossings"],
            [{"curves": [0]}],
            "crossings[0].curves = [0]: must have at least 2 entries",
        ),
        (["crossings"], [{"curves": [0, -1]}], "crossings[0].curves[1] = -1: must be at least 0"),
        (["opening", "angle"], ..., "opening.angle: is missing"),
        (["opening", "side"], "left", 'opening.side = \'left\': must be one of "up", "down"'),
        (["elements_per_piece"], 0, "elements_per_piece = 0: must be at least 1"),
        (["elements_per_piece"], 1.5, "elements_per_piece = 1.5: must be an integer"),
        (["format"], "other", "format = 'other': not a design file: expected 'kop_exudyn/design'"),
        (["format"], ..., "format = '(missing)': not a design file: expected 'kop_exudyn/design'"),
        (
            ["version"],
            3,
            "version = 3: written for a newer kop_exudyn; this one reads versions up to 2: upgrade",
        ),
        (["version"], "1", "version = '1': unknown version; this kop_exudyn reads 1"),
        (["version"], ..., "version = '(missing)': unknown version; this kop_exudyn reads 1"),
        (["class"], ..., "class: is missing"),
        (["class"], "../kit", "class = '../kit': "),
        (
            ["class"],
            "d_shell",
            "class = 'd_shell': unknown structure class (did you mean 'c_shell'? ",
        ),
    ],
)
def test_mistakes(c_shell_data, write_json_file, path, value, expected):
    file = write_json_file("bad.json", changed(c_shell_data, path, value))
    with pytest.raises(InputError) as caught:
        load_design(file)
    assert str(caught.value).startswith(f"{file}: {expected}")
    assert "\n" not in str(caught.value)


def test_a_design_that_is_a_list(write_json_file):
    with pytest.raises(InputError, match="expected an object of the format 'kop_exudyn/design'"):
        load_design(write_json_file("list.json", []))


def test_envelope_accepts_older_versions():
    check_envelope({"format": "kop_exudyn/kit", "version": 1}, "kit", 3)


def test_the_files_own_content_reaches_the_class(named_class, write_json_file):
    design = load_design(write_json_file("a.json", design_data("arch", spans=[1, 2])))
    assert (design.name, design.content["spans"]) == ("arch", [1, 2])


def test_errors_of_the_class_name_the_file(monkeypatch, write_json_file):
    def reader(data, source):
        raise InputError("crosses no other", field="curves[1]")

    monkeypatch.setitem(base.CLASSES.items, "named", reader)
    file = write_json_file("a.json", design_data("a"))
    with pytest.raises(InputError, match=r"a\.json: curves\[1\]: crosses no other"):
        load_design(file)


@pytest.fixture
def folder(named_class, write_json_file, tmp_path):
    for number in (10, 2, 1):
        write_json_file(f"set/shape_{number}.json", design_data(f"Shape {number}"))
    (tmp_path / "set" / "notes.txt").touch()
    (tmp_path / "set" / ".hidden.json").touch()
    return tmp_path / "set"


def test_natural_order(folder):
    assert [path.name for path in design_files(folder)] == [
        "shape_1.json",
        "shape_2.json",
        "shape_10.json",
    ]
    assert [design.name for design in load_designs(folder)] == ["Shape 1", "Shape 2", "Shape 10"]


def test_the_first_few_are_read_and_no_others(folder, monkeypatch):
    read = []
    read_json = designs_module.read_json
    monkeypatch.setattr(
        designs_module, "read_json", lambda path: read.append(path.name) or read_json(path)
    )
    assert [design.name for design in load_designs(folder, 2)] == ["Shape 1", "Shape 2"]
    assert read == ["shape_1.json", "shape_2.json"]


def test_by_name_in_the_order_asked_for(folder):
    assert [design.name for design in load_designs(folder, ["shape_10", "shape_1"])] == [
        "Shape 10",
        "Shape 1",
    ]


@pytest.mark.parametrize(
    "select, message",
    [
        (4, "designs = 4: expected a number of designs from 1 to 3"),
        (0, "designs = 0: expected a number"),
        (
            ["shape_3"],
            r"designs = 'shape_3': no such design \(there are shape_1, shape_2, shape_10\)",
        ),
        (["shape_1", "shape_1"], "one or more different designs"),
        ([], "one or more different designs"),
    ],
)
def test_impossible_selections(folder, select, message):
    with pytest.raises(InputError, match=message):
        load_designs(folder, select)


def test_same_name_twice(folder, write_json_file):
    write_json_file("set/twin.json", design_data("Shape 1"))
    with pytest.raises(
        InputError, match="have the same name: results and files are told apart by it"
    ):
        load_designs(folder)


def test_folders_without_designs(tmp_path):
    (tmp_path / "file.json").touch()
    with pytest.raises(InputError, match="no such folder"):
        load_designs(tmp_path / "missing")
    with pytest.raises(InputError, match="is a file, expected a folder"):
        load_designs(tmp_path / "file.json")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="contains no designs"):
        load_designs(tmp_path / "empty")

"""Whatever is wrong with what a command is given: one line that names it, exit status 2, and no
file that is written or changed."""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest
from support.shells import shell_data

from kop_exudyn import cli
from kop_exudyn.files.arrays import load_arrays, save_arrays, sealed, unsealed

NET = """v 0 0 0\nv 1 0 0\nv 0 .5 0\nv 1 .5 0\nv .2 -1 0\nv .2 1 0\nv .7 -1 0\nv .7 1 0
l 1 2\nl 3 4\nl 5 6\nl 7 8\n"""
NET_POINTS = [line[2:] for line in NET.splitlines() if line.startswith("v")]
NET_LINES = "l 1 2\nl 3 4\nl 5 6\nl 7 8\n"
ROD = "--section .02,.01 --material 1e9,.3"
STUDY = 'format = "kop_exudyn/study"\nversion = 1\ndesigns = ["designs"]\n'
QUICK = """baselines = false
parts = {linear = 2, angular = 2}
settings = {schedule = [1e4], relaxed_steps = 1, assigned_steps = 1, reassignments = 0,\
 leaps = 0, path_steps = 2, redeployments = 0, effort = "quick"}
requirements = {opening = false, stress = false, samples = 0}
tolerance = {samples = 0}
"""
KIT = {"format": "kop_exudyn/kit", "version": 1}
STOCK = "kind,count,l1,l2,angle\n"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder of all files that the cases name, with a finished run of one design."""
    folder = tmp_path_factory.mktemp("faults")

    def write(name: str, content) -> None:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not isinstance(content, bytes):
            content = (content if isinstance(content, str) else json.dumps(content)).encode()
        path.write_bytes(content)

    write("designs/one.json", shell_data("one"))
    write("study.toml", STUDY + QUICK)
    asked = ["optimize", str(folder / "study.toml"), "--out", str(folder / "run"), "--jobs", "1"]
    assert cli.main([*asked, "--quiet"]) == 0
    (folder / "empty").mkdir()
    for name, content in {
        "blank.json": "",
        "bytes.json": bytes(range(256)),
        "array.json": "[1, 2]",
        "other.json": {"type": "FeatureCollection", "features": []},
        "class.json": shell_data("x", **{"class": "c_shel"}),
        "classlist.json": shell_data("x", **{"class": ["c_shell"]}),
        "nan.json": json.dumps(shell_data("x")).replace("0.35", "NaN"),
        "future.json": shell_data("x", version=99),
        "broken.json.gz": b"\x1f\x8b\x08nothing",
        "text.txt": "hello",
        "net.obj": NET,
        "far.obj": "".join(
            f"v {float(x) + 1e9} {y} {z}\n" for x, y, z in (v.split() for v in NET_POINTS)
        )
        + NET_LINES,
        "tiny.obj": "v .2 0 0\nv .201 0 0\nv .2 .001 0\nf 1 2 3\n",
        "nan.obj": "v 0 0 nan\nl 1 2\n",
        "number.obj": "v 0 0 0\nl 1 99\n",
        "drawing.dxf": "hello",
        "mesh.ply": "ply\nfoo",
        "kits/kit.json": (folder / "run" / "kit.json").read_bytes(),
        "broken.toml": "a = [",
        "bytes.toml": bytes(range(256)),
        "format.toml": "format = 'x'\nversion = 1\n",
        "nofile.toml": STUDY.replace('designs"]', 'no.json"]'),
        "nan.toml": STUDY + "weights = {fit = nan}\n",
        "text.toml": STUDY + 'parts = {linear = "2"}\n',
        "bounds.toml": STUDY + "settings = {bounds = {linear = {lower = [1]}}}\n",
        "boundkind.toml": STUDY + "settings = {bounds = {foo = {lower = 1}}}\n",
        "kit_huge.json": KIT | {"parts": {"linear": [[1e300, 2]], "angular": [0.1]}},
        "kit_none.json": KIT | {"parts": {"linear": [[0, 0]], "angular": [0.1]}},
        "kit_three.json": KIT | {"parts": {"linear": [[1, 2, 3]], "angular": [0.1]}},
        "kit_kind.json": KIT | {"parts": {"linear": [[1, 2]]}},
        "bytes.csv": bytes(range(256)),
        "columns.csv": "a,b\n1,2\n",
        "nan.csv": STOCK + "linear,3,nan,1,\n",
        "count.csv": STOCK + "linear,1e30,1,1,\nangular,1e30,,,.1\n",
        "huge.csv": STOCK + "linear,90,1e300,1,\nangular,90,,,.1\n",
        "nothing.csv": STOCK + "linear,90,0,0,\nangular,90,,,.1\n",
        "few.csv": STOCK + "linear,1,.3,.3,\nangular,1,,,.1\n",
    }.items():
        write(name, content)
    return folder


DESIGN_FAULTS = [
    ("no.json", "no.json: no such file"),
    ("empty", "empty: is a folder"),
    ("blank.json", "blank.json: not JSON"),
    ("bytes.json", "bytes.json: not UTF-8"),
    ("array.json", "array.json: expected an object"),
    ("other.json", "other.json: format"),
    ("run/kit.json", "kit.json: format = 'kop_exudyn/kit': not a design file"),
    ("run/result.json", "result.json: format = 'kop_exudyn/result': not a design file"),
    ("class.json", "class = 'c_shel': unknown structure class (did you mean 'c_shell'?"),
    ("classlist.json", "classlist.json: class = ['c_shell']"),
    ("nan.json", "nan.json: NaN"),
    ("future.json", "version = 99"),
    ("broken.json.gz", "damaged gzip"),
    ("text.txt", "text.txt: not JSON"),
]
FOLDER_FAULTS = [
    ("no", "no: no such folder"),
    ("empty", "empty: contains no designs"),
    ("text.txt", "text.txt: is a file, expected a folder"),
    ("kits", "kit.json: format = 'kop_exudyn/kit'"),
    ("no.toml", "no.toml: no such file"),
    ("broken.toml", "broken.toml: not TOML"),
    ("bytes.toml", "bytes.toml: not UTF-8"),
    ("format.toml", "format.toml: format = 'x'"),
    ("nofile.toml", "designs[0] = 'no.json': no such file"),
    ("nan.toml", "weights.fit = nan"),
    ("text.toml", "parts.linear = '2'"),
    ("bounds.toml", "settings.bounds.linear.lower = [1]: expected one number, or 2 (l1, l2)"),
    ("boundkind.toml", "'foo': unknown kind of parts"),
]
CASES = (
    [(f"simulate {name}", message) for name, message in DESIGN_FAULTS]
    + [
        (f"{command} {name} --out OUT", message)
        for command in ("view", "export")
        for name, message in DESIGN_FAULTS
        if name != "empty"  # of a finished run, as it is said
    ]
    + [
        (line.replace("FOLDER", name), message)
        for line in (
            "optimize FOLDER --parts linear=2,angular=2 --out OUT",
            "optimize FOLDER --max-deviation 5 --out OUT",
            "tradeoff FOLDER --parts linear=1:2,angular=2 --out OUT",
            "check FOLDER",
            "view run FOLDER --out OUT",
            "export run FOLDER --unit m --out OUT",
        )
        for name, message in FOLDER_FAULTS
    ]
    + [
        ("import no.obj --out OUT.json", "no.obj: no such file"),
        ("import empty --out OUT.json", "empty: is a folder, expected a file"),
        ("import text.txt --out OUT.json", "text.txt: can't be imported (known: .3dm, .dxf,"),
        ("import study.toml --preview OUT", "study.toml: can't be imported"),
        ("import array.json --out OUT.json", "array.json: isn't a released umbrella mesh"),
        ("import run/kit.json --out OUT.json", "kit.json: format: is a file of kop_exudyn already"),
        (f"import nan.obj --opening .3 {ROD} --out OUT.json", "nan.obj: line 1"),
        (f"import far.obj --opening .3 {ROD} --out OUT.json", "far.obj: curves = [1000000000.5"),
        (
            f"import net.obj --opening .3 --target tiny.obj {ROD} --out OUT.json",
            "tiny.obj: is 0.00148",
        ),
        (f"import number.obj --opening .3 {ROD} --out OUT.json", "number.obj: line 2 = 99"),
        (
            f"import drawing.dxf --opening .3 {ROD} --out OUT.json",
            "drawing.dxf: can't be read as DXF",
        ),
        ("import mesh.ply --patch hexagon,2 --out OUT.json", "mesh.ply: "),
        (f"import net.obj --as grid --surface no.obj {ROD} --out OUT.json", "no.obj: no such file"),
        (f"import net.obj --as grid --surface text.txt {ROD} --out OUT.json", "is no mesh file"),
        (
            f"import net.obj --opening .3 --target empty {ROD} --out OUT.json",
            "empty: is no mesh file",
        ),
        (
            f"import net.obj --opening .3 --held 3 {ROD} --out OUT.json",
            "--held: isn't for this import",
        ),
        (
            f"import net.obj --as grid --opening .3 {ROD} --out OUT.json",
            "--opening: isn't for this import",
        ),
        (f"import net.obj --opening .3 {ROD} --out empty", "empty: is a folder"),
        (f"import net.obj --opening .3 {ROD} --out no/x.json", "its folder doesn't exist"),
        (f"import net.obj --opening .3 {ROD} --out net.obj", "exists already"),
        ("optimize designs --parts linear=99,angular=2 --out OUT", "--parts.linear = 99: more"),
        ("optimize designs --parts linear=2 --out OUT", "--parts.angular: "),
        ("check designs --parts cells=2", "--parts.cell = 2: the designs have no elements"),
        ("optimize designs --kit no --out OUT", "no: no such file"),
        ("optimize designs --kit empty --out OUT", "empty: is a folder"),
        ("optimize designs --kit designs/one.json --out OUT", "not a kit file"),
        ("optimize designs --kit kit_huge.json --out OUT", "parts.linear[0][0] = 1e+300"),
        ("optimize designs --kit kit_none.json --out OUT", "kit.linear[0] = [0.0, 0.0]: is a part"),
        ("optimize designs --kit kit_three.json --out OUT", "kit.linear = [[1, 2, 3]]"),
        ("optimize designs --kit kit_kind.json --out OUT", "has no angular parts"),
        ("optimize designs --stock no.csv --out OUT", "no.csv: no such file"),
        ("optimize designs --stock bytes.csv --out OUT", "bytes.csv: not UTF-8"),
        ("optimize designs --stock columns.csv --out OUT", "columns.csv: kind: a column is"),
        ("optimize designs --stock nan.csv --out OUT", "line 2, l1 = 'nan'"),
        ("optimize designs --stock count.csv --out OUT", "line 2, count = '1e30'"),
        ("optimize designs --stock huge.csv --out OUT", "line 2: l1 = 1e+300"),
        ("optimize designs --stock nothing.csv --out OUT", "kit.linear[0] = [0.0, 0.0]"),
        ("optimize designs --stock few.csv --out OUT", "--stock: doesn't suffice"),
        ("optimize designs --parts linear=2,angular=2 --out text.txt", "text.txt: is a file"),
        ("optimize designs --parts linear=2,angular=2 --out empty/../kits", "kits: the folder"),
        ("check designs --harmonise .9,1.1 --out designs", "one.json: exists already"),
        ("export designs/one.json --out text.txt", "text.txt: is a file"),
        ("view designs/one.json --out empty", "empty: is a folder"),
        ("examples text.txt", "can't be written: not a directory"),
        ("simulate designs/one.json --gravity", "the design names no units"),
        ("simulate designs/one.json --gravity 9.81", "material.density"),
    ]
)


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def refused(line: str, place: Path, capsys, monkeypatch) -> str:
    """The one line that a command ends with, in that folder; all files there stay as they are."""
    monkeypatch.chdir(place)
    before = contents(place)
    capsys.readouterr()
    try:
        status = cli.main(line.split())
    except SystemExit as end:
        status = end.code
    output = capsys.readouterr()
    assert status == 2, output.err
    assert output.err.startswith("kop") and output.err.count("\n") == 1 and output.out == ""
    assert contents(place) == before
    return output.err


@pytest.mark.parametrize(("line", "message"), CASES, ids=[line for line, _ in CASES])
def test_one_line_that_names_it(line, message, place, capsys, monkeypatch):
    assert message in refused(line, place, capsys, monkeypatch)


def result(change):
    """A damage of result.json."""

    def damage(run: Path) -> None:
        path = run / "result.json"
        data = json.loads(path.read_text(encoding="utf-8"))
        change(data)
        path.write_text(json.dumps(data), encoding="utf-8")

    return damage


def states(change):
    """Other states, under a seal of their own."""

    def damage(run: Path) -> None:
        path = run / "states.npz"
        arrays = dict(unsealed(load_arrays(path), path))
        save_arrays(path, sealed(change(arrays)), overwrite=True)

    return damage


def of_nothing(arrays: dict) -> dict:
    return {name: np.full_like(array, np.nan) for name, array in arrays.items()}


def without_last(arrays: dict) -> dict:
    return {name: array for name, array in arrays.items() if "/assigned/" not in name}


def cut(name: str):
    def damage(run: Path) -> None:
        content = (run / name).read_bytes()
        (run / name).write_bytes(content[: len(content) // 2])

    return damage


def one_array_changed(run: Path) -> None:
    """One bit less in the middle of an array, in an archive that is whole."""
    path = run / "states.npz"
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = next(name for name in members if "positions" in name)
    members[name] = members[name][:-1] + bytes([members[name][-1] ^ 1])
    with zipfile.ZipFile(path, "w") as archive:
        for other, content in members.items():
            archive.writestr(other, content)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda run: (run / "result.json").unlink(), "result.json: no such file"),
        (
            lambda run: (run / "states.npz").unlink(),
            "states.npz: no such file: reports that are kept without",
        ),
        (cut("result.json"), "result.json: not JSON"),
        (cut("states.npz"), "states.npz: not a readable file of arrays"),
        (one_array_changed, "states.npz: is damaged"),
        (states(of_nothing), "damaged"),
        (states(without_last), "states.npz: assigned: lacks the states"),
        (result(lambda data: data["kit"].update(angular=[1.0, 2.0])), "those of another kit"),
        (result(lambda data: data["kit"].update(linear=[[1, 2, 3]])), "kit.linear"),
        (result(lambda data: data["kit"].pop("linear")), "result.json: kit = 'linear'"),
        (result(lambda data: data.update(assignment={})), "assignment = {}"),
        (result(lambda data: data["designs"][0].update(name="two")), "aren't there"),
        (result(lambda data: data["designs"][0].update(buildable={})), "buildable.verdict: is"),
        (result(lambda data: data.update(warnings=3)), "warnings = 3"),
        (result(lambda data: data.update(history=3)), "history = 3"),
        (
            result(lambda data: data["settings"].update(weights={"foo": 1})),
            "result.json: weights = 'foo'",
        ),
        (result(lambda data: data.update(version=99)), "version = 99"),
        (result(lambda data: data.update(format="kop_exudyn/kit")), "not a result file"),
    ],
)
@pytest.mark.parametrize("line", ["view bad DESIGNS --out OUT", "export bad DESIGNS --out OUT"])
def test_a_run_that_is_damaged(line, damage, message, place, tmp_path, capsys, monkeypatch):
    shutil.copytree(place / "run", tmp_path / "bad")
    damage(tmp_path / "bad")
    line = line.replace("DESIGNS", str(place / "designs"))
    line += " --unit m" if line.startswith("export") else ""
    error = refused(line, tmp_path, capsys, monkeypatch)
    assert message in error


@pytest.mark.parametrize("name", ["job.json", "relaxed-10000.npz", "assigned.npz"])
def test_a_checkpoint_that_is_damaged(name, place, tmp_path, capsys, monkeypatch):
    shutil.copytree(place / "run", tmp_path / "run")
    cut(f"checkpoints/{name}")(tmp_path / "run")
    study = place / "study.toml"
    line = f"optimize {study} --out run --resume --jobs 1 --quiet"
    assert name in refused(line, tmp_path, capsys, monkeypatch)

"""Files of other versions: one clear error that names the file, the field and the value."""

import json

import pytest

from kop_exudyn.cli import main
from kop_exudyn.errors import InputError
from kop_exudyn.io.checkpoint import Job
from kop_exudyn.io.designs import load_design
from kop_exudyn.io.kits import load_kit
from kop_exudyn.io.results import load_result

READERS = {"design": load_design, "kit": load_kit, "result": load_result, "job": Job.load}
NEWEST = {"design": 2, "kit": 1, "result": 1, "job": 1}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize(
    "version, message",
    [
        (
            3,
            r"version = 3: written for a newer kop_exudyn; this one reads versions up to {}: "
            r"upgrade with pip",
        ),
        (0, r"version = 0: unknown version; this kop_exudyn reads 1"),
        (-1, "version = -1: unknown version"),
        (1.5, "version = 1.5: unknown version"),
        ("1", "version = '1': unknown version"),
        (True, "version = True: unknown version"),
        (None, r"version = '\(missing\)': unknown version"),
    ],
)
def test_versions_that_cannot_be_read(name, version, message, write_json_file):
    path = write_json_file(
        "file.json", {"format": f"kop_exudyn/{name}", "version": version, "rest": 1}
    )
    with pytest.raises(InputError, match=message.format(NEWEST[name])) as caught:
        READERS[name](path)
    assert str(caught.value).startswith(f"{path}: version = ")


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize(
    "content, message",
    [
        ({"format": "other/format", "version": 1}, "format = 'other/format': not a {} file"),
        ({"version": 1}, r"format = '\(missing\)': not a {} file"),
        ([1], "expected an object of the format 'kop_exudyn/{}'"),
    ],
)
def test_other_formats(name, content, message, write_json_file):
    path = write_json_file("file.json", content)
    with pytest.raises(InputError, match=message.format(name)):
        READERS[name](path)


def test_commands_end_with_status_2(tmp_path, write_json_file, c_shell_data, capsys):
    write_json_file("designs/one.json", c_shell_data)
    write_json_file("run/result.json", {"format": "kop_exudyn/result", "version": 7})
    assert (
        main(
            [
                "view",
                str(tmp_path / "run"),
                str(tmp_path / "designs"),
                "--out",
                str(tmp_path / "page.html"),
            ]
        )
        == 2
    )
    error = capsys.readouterr().err
    assert (
        "result.json: version = 7: written for a newer kop_exudyn" in error
        and error.count("\n") == 1
    )
    assert not (tmp_path / "page.html").exists()
    write_json_file("designs/one.json", c_shell_data | {"version": 7})
    assert main(["simulate", str(tmp_path / "designs" / "one.json")]) == 2
    assert json.loads((tmp_path / "designs" / "one.json").read_text())["version"] == 7

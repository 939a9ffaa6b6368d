"""Study files: everything that a kit is sought with, in one TOML file."""

import json
from dataclasses import fields

import numpy as np
import pytest

from kop_exudyn.analysis.verdict import VerdictSettings
from kop_exudyn.errors import InputError
from kop_exudyn.io.datasets import load_designs, select_files
from kop_exudyn.io.studies import load_study
from kop_exudyn.search.requirements import Requirements
from kop_exudyn.search.settings import StageSettings
from kop_exudyn.search.weights import Weights

HEAD = 'format = "kop_exudyn/study"\nversion = 1\n'


@pytest.fixture
def folder(tmp_path, write_json_file, c_shell_data):
    for name in ("one", "two", "more/three", "more/four"):
        write_json_file(f"designs/{name}.json", c_shell_data | {"name": name.replace("/", " ")})
    return tmp_path


@pytest.fixture
def study(folder):
    """A function that writes a study file beside the folder of designs."""

    def write(text: str, head: str = HEAD):
        path = folder / "study.toml"
        path.write_text(head + text, encoding="utf-8")
        return path

    return write


def names(files) -> list[str]:
    return [path.stem for path in files]


def test_everything_that_can_be_said(study):
    found = load_study(
        study("""
designs = ["designs/two.json", {file = "designs/one.json", weight = 2}, "designs/more"]
baselines = false
parts = {linear = 12, angular = 5}
[weights]
energy = 0.05
stress = 0.5
[settings]
schedule = [1000, 1e5]
seed = 3
hessian = "bfgs"
bounds.linear = {lower = 0.1, upper = [2, 3]}
bounds.angular = {upper = 1.5}
[tolerance]
length = 0.001
samples = 100
""")
    )
    assert names(found.files) == ["two", "one", "four", "three"] and found.counts == (
        1.0,
        2.0,
        1.0,
        1.0,
    )
    assert found.parts == {"linear": 12, "angular": 5} and found.baselines is False
    settings = found.settings
    assert (settings.schedule, settings.seed, settings.hessian) == ((1000, 1e5), 3, "bfgs")
    assert settings.relaxed_steps == StageSettings().relaxed_steps
    np.testing.assert_array_equal(settings.bounds["linear"][1], [2, 3])
    assert settings.bounds["linear"][0] == 0.1 and settings.bounds["angular"] == (-np.inf, 1.5)
    assert found.verdict == VerdictSettings(length=0.001, samples=100)
    # the search tries errors as large, in numbers of its own
    assert settings.requirements == Requirements(length=0.001)
    designs = found.designs()
    assert [design.name for design in designs] == ["two", "one", "more four", "more three"]
    job = found.job_settings(designs, 2)
    assert job.weights == Weights(
        fit=designs[0].fit_weight, energy=0.05, others=(("stress", 0.5),)
    ) and job.design_weights == (1, 2, 1, 1)
    assert (job.jobs, job.stages) == (2, settings)


def test_only_designs(study):
    found = load_study(study('designs = ["designs"]'))
    assert (
        names(found.files) == ["one", "two"]
        and not found.parts
        and found.settings == StageSettings()
    )
    job = found.job_settings(found.designs(), 1)
    assert job.weights is None and job.design_weights is None


def test_a_folder_is_a_study_with_the_usual_settings(folder):
    found = load_study(folder / "designs", 1)
    assert names(found.files) == ["one"] and found.settings == StageSettings()


def test_designs_are_picked_with_their_weights(study):
    path = study(
        'designs = ["designs/two.json", {file = "designs/one.json", weight = 2}, "designs/more"]'
    )
    assert load_study(path, ["one", "three"]).counts == (2.0, 1.0)
    assert names(select_files(path, 2)) == ["two", "one"]
    assert [design.name for design in load_designs(path, ["three"])] == ["more three"]
    with pytest.raises(
        InputError, match=r"study.toml: designs = 'five': no such design \(there are two, one, four"
    ):
        load_study(path, ["five"])


def test_the_schema_knows_all_settings(repository):
    schema = json.loads(
        (repository / "kop_exudyn" / "io" / "schemas" / "study.schema.json").read_text()
    )
    known = set(schema["properties"]["settings"]["properties"])
    # constraints are written in Python, requirements have a table of their own
    assert known == {f.name for f in fields(StageSettings)} - {"constraints", "requirements"}
    assert set(schema["properties"]["requirements"]["properties"]) == {
        field.name for field in fields(Requirements)
    } - {"penalty", "length", "angle"}
    assert set(schema["properties"]["weights"]["properties"]) == {
        field.name for field in fields(Weights)
    } - {"others", "level"}  # the level is that of the setting `levelling`
    assert set(schema["properties"]["tolerance"]["properties"]) == {
        field.name for field in fields(VerdictSettings)
    } - {"safety"}  # which is the requirements'


DESIGNS = 'designs = ["designs"]\n'


@pytest.mark.parametrize(
    "text, message",
    [
        ("designs = [1 2]", "not TOML: .*line 3"),
        ("", "designs: is missing"),
        ("designs = []", r"designs = \[\]: must have at least 1"),
        ('designs = ["no.json"]', r"designs\[0\] = 'no.json': no such file or folder"),
        # too long for a file's name
        (f'designs = ["{"n" * 300}"]', r"designs\[0\] = 'nnn.*: no such file or folder"),
        (
            'designs = ["designs/one.json", "designs"]',
            r"designs\[1\] = 'one.json': two design files have the same name",
        ),
        (
            'designs = [{file = "designs", weigth = 2}]',
            r"designs\[0\].weigth: unknown field \(did you mean 'weight'\?\)",
        ),
        (
            'designs = [{file = "designs", weight = 0}]',
            r"designs\[0\].weight = 0: must be positive",
        ),
        (DESIGNS + "part = {linear = 1}", r"part: unknown field \(did you mean 'parts'\?\)"),
        (DESIGNS + "parts = {linear = 0}", "parts.linear = 0: must be at least 1"),
        (DESIGNS + "parts = {linear = 1.5}", "parts.linear = 1.5: must be an integer"),
        (
            DESIGNS + "[settings]\nsead = 1",
            r"settings.sead: unknown field \(did you mean 'seed'\?\)",
        ),
        (DESIGNS + "[settings]\nseed = true", "settings.seed = True: must be an integer"),
        (DESIGNS + "[settings]\ntight = nan", "settings.tight = nan: must be finite"),
        (
            DESIGNS + '[settings]\nhessian = "none"',
            'settings.hessian = \'none\': must be one of "exact", "bfgs"',
        ),
        (DESIGNS + "[settings.bounds]\nlinear = {}", "settings.bounds.linear"),
        (
            DESIGNS + "[weights]\nfit = 0\nenergy = 0",
            "weights = .*: fit and energy can't both be 0",
        ),
        (
            DESIGNS + "[weights]\nstrength = 1",
            r"weights = 'strength': unknown term .*known: fit, energy, compliance",
        ),
        (
            DESIGNS + "[weights]\nstress = -1",
            r"weights.stress = -1: must not be negative|weights.stress = -1",
        ),
        (DESIGNS + "version = 1", "not TOML: Cannot overwrite a value"),
        ("designs = 2026-01-01", "designs = .*: must be a list"),
    ],
)
def test_mistakes(text, message, study):
    path = study(text)
    with pytest.raises(InputError, match=message) as caught:
        load_study(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "head, message",
    [
        ("", r"format = '\(missing\)': not a study file"),
        (
            'format = "kop_exudyn/study"\nversion = 2\n',
            "version = 2: written for a newer kop_exudyn",
        ),
        ('format = "kop_exudyn/study"\nversion = 0\n', "version = 0: unknown version"),
    ],
)
def test_other_versions(head, message, study):
    with pytest.raises(InputError, match=message):
        load_study(study(DESIGNS, head))


def test_what_is_no_text(folder):
    path = folder / "study.toml"
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="not UTF-8"):
        load_study(path)
    with pytest.raises(InputError, match="no such file"):
        load_study(folder / "missing.toml")


def test_a_number_of_thousands_of_digits(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(f'format = "kop_exudyn/study"\nversion = 1\nseed = {"9" * 5000}\n')
    with pytest.raises(InputError, match="study.toml: contains a number with too many digits"):
        load_study(path)

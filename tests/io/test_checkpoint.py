"""Checkpoints go on with the same job, and with no other."""

import logging
import shutil

import numpy as np
import pytest

from kop_exudyn import provenance
from kop_exudyn.errors import InputError
from kop_exudyn.io.checkpoint import CheckpointStore, Job
from kop_exudyn.io.run_folder import RunFolder

ARRAYS = {
    "sqp/x": np.linspace(0, 1, 7),
    "terms": np.array(["{}", '{"fit": 1}']),
    "file": np.array(3),
    "none": np.empty((0, 2)),
}


@pytest.fixture
def inputs(tmp_path):
    paths = [tmp_path / name for name in ("a.json", "b.json")]
    for path in paths:
        path.write_text(path.name)
    return paths


def job(inputs, **settings):
    return Job.of({"parts": {"linear": 12}, "seed": 0, **settings}, inputs)


def test_arrays_come_back_exactly(tmp_path, inputs):
    store = CheckpointStore.open(tmp_path / "c", job(inputs))
    assert store.load("relaxed-1000") is None
    store.save("relaxed-1000", ARRAYS)
    read = CheckpointStore.open(tmp_path / "c", job(inputs), resume=True).load("relaxed-1000")
    assert list(read) == list(ARRAYS)
    for name, array in ARRAYS.items():
        assert read[name].dtype == array.dtype
        np.testing.assert_array_equal(read[name], array)


def test_the_same_arrays_give_the_same_bytes(tmp_path, inputs):
    store = CheckpointStore.open(tmp_path / "c", job(inputs))
    store.save("one", ARRAYS)
    store.save("two", ARRAYS)
    assert (tmp_path / "c" / "one.npz").read_bytes() == (tmp_path / "c" / "two.npz").read_bytes()


def test_starting_anew_forgets_older_checkpoints(tmp_path, inputs):
    CheckpointStore.open(tmp_path / "c", job(inputs)).save("one", ARRAYS)
    (tmp_path / "c" / "notes.txt").touch()
    assert CheckpointStore.open(tmp_path / "c", job(inputs)).names() == []
    assert (tmp_path / "c" / "notes.txt").exists()


@pytest.mark.parametrize(
    "settings, message",
    [
        ({"seed": 1}, "seed was 0 and is now 1"),
        ({"parts": {"linear": 13}}, "parts.linear was 12 and is now 13"),
        ({"parts": {"linear": 12, "angular": 5}}, "parts.angular was not given and is now 5"),
    ],
)
def test_other_settings_are_not_resumed(tmp_path, inputs, settings, message):
    CheckpointStore.open(tmp_path / "c", job(inputs)).save("one", ARRAYS)
    with pytest.raises(InputError, match=f"belong to a different job: {message}"):
        CheckpointStore.open(tmp_path / "c", job(inputs, **settings), resume=True)
    assert CheckpointStore.open(tmp_path / "c", job(inputs), resume=True).names() == ["one"]


def test_other_inputs_are_not_resumed(tmp_path, inputs):
    before = job(inputs)
    assert before.difference(job(inputs)) is None
    assert before.difference(job(inputs[::-1])) == "the input files have another order"
    assert before.difference(job(inputs[:1])) == "the input file b.json belongs to one of them only"
    inputs[1].write_text("other")
    assert before.difference(job(inputs)) == "the input file b.json has changed"


def test_the_place_of_the_inputs_is_no_matter(tmp_path, inputs):
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    assert job(inputs).difference(job([shutil.copy(path, moved) for path in inputs])) is None


def test_a_damaged_checkpoint_is_named(tmp_path, inputs):
    store = CheckpointStore.open(tmp_path / "c", job(inputs))
    store.save("one", ARRAYS)
    path = tmp_path / "c" / "one.npz"
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(InputError, match=r"one\.npz: not a readable file of arrays"):
        store.load("one")


def test_names_stay_in_the_folder(tmp_path, inputs):
    store = CheckpointStore.open(tmp_path / "c", job(inputs))
    with pytest.raises(ValueError, match="not a name"):
        store.save("../escape", ARRAYS)


class TestRunFolder:
    def test_the_same_job_may_run_again(self, tmp_path, inputs):
        folder = RunFolder.open(tmp_path / "out", job(inputs))
        folder.store.save("one", ARRAYS)
        (folder.path / "result.json").touch()
        assert RunFolder.open(tmp_path / "out", job(inputs)).store.names() == []

    def test_a_different_job_may_not(self, tmp_path, inputs):
        RunFolder.open(tmp_path / "out", job(inputs)).store.save("one", ARRAYS)
        with pytest.raises(
            InputError, match=r"results of a different job \(seed was 0 and is now 1\)"
        ):
            RunFolder.open(tmp_path / "out", job(inputs, seed=1))
        with pytest.raises(InputError, match="can't resume"):
            RunFolder.open(tmp_path / "out", job(inputs, seed=1), resume=True)
        assert (
            RunFolder.open(tmp_path / "out", job(inputs, seed=1), overwrite=True).store.names()
            == []
        )

    def test_other_peoples_files_are_left_alone(self, tmp_path, inputs):
        (tmp_path / "out").mkdir()
        (tmp_path / "out" / "thesis.tex").touch()
        with pytest.raises(InputError, match="isn't empty"):
            RunFolder.open(tmp_path / "out", job(inputs))

    def test_resume_goes_on_or_says_that_it_starts_anew(self, tmp_path, inputs, caplog):
        with caplog.at_level(logging.INFO, logger="kop_exudyn"):
            folder = RunFolder.open(tmp_path / "out", job(inputs), resume=True)
        assert "nothing to resume" in caplog.text
        folder.store.save("one", ARRAYS)
        assert RunFolder.open(tmp_path / "out", job(inputs), resume=True).store.names() == ["one"]


def test_other_code_does_not_go_on_but_may_begin_anew(tmp_path, monkeypatch):
    """Results of different code are not mixed; the same command still renews them."""
    folder = RunFolder.open(tmp_path / "run", Job.of({"parts": 3}, []))
    folder.store.save("relaxed", {"x": np.zeros(2)})
    monkeypatch.setattr("kop_exudyn.io.checkpoint.code_digest", lambda: "another")
    with pytest.raises(InputError, match="can't resume.*kop_exudyn itself has changed"):
        RunFolder.open(tmp_path / "run", Job.of({"parts": 3}, []), resume=True)
    assert RunFolder.open(tmp_path / "run", Job.of({"parts": 3}, [])).store.names() == []


def test_the_digest_of_the_code_changes_with_any_source(tmp_path, monkeypatch):
    (tmp_path / "a.py").write_text("x = 1\n")
    monkeypatch.setattr(provenance, "_PACKAGE", tmp_path)
    digests = set()
    for content in ("x = 1\n", "x = 2\n", "x = 1\n"):
        (tmp_path / "a.py").write_text(content)
        digests.add(provenance.code_digest.__wrapped__())
    assert len(digests) == 2

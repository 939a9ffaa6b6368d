"""The folder that a long run writes to: prepared before it starts, so that no result is lost by
chance."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

from ..errors import OccupiedError
from ..files.files import is_temporary, make_folder
from .checkpoint import CheckpointStore, Job

log = logging.getLogger(__name__)

_CHECKPOINTS = "checkpoints"


@dataclass(frozen=True)
class RunFolder:
    """A folder for one job's results.

    path : the folder; results in it may be written with overwrite=True
    store : the job's checkpoints
    """

    path: Path
    store: CheckpointStore

    @classmethod
    def open(
        cls, path: str | Path, job: Job, *, resume: bool = False, overwrite: bool = False
    ) -> RunFolder:
        """Prepare a new or empty folder, or one that an earlier run of the same job left.

        resume : go on from the checkpoints there, if there are any
        overwrite : also take a folder that a different job wrote, or that holds something else

        Raises InputError when the folder can't be written to, or belongs to something else and
        `overwrite` is false.
        """
        path = make_folder(path)
        record = path / _CHECKPOINTS / "job.json"
        if resume and not record.exists():
            log.info("nothing to resume in %s: starting anew", path)
        if not (overwrite or resume and record.exists()):
            _check_free(path, record, job)
        return cls(path, CheckpointStore.open(path / _CHECKPOINTS, job, resume=resume))


def _check_free(path: Path, record: Path, job: Job) -> None:
    """Raise InputError unless the folder is empty or an earlier run of the same job wrote it.

    A run that ended before its job was recorded leaves nothing but an empty folder for checkpoints.
    """
    content = list(path.iterdir())
    if content == [record.parent]:
        content = [entry for entry in record.parent.iterdir() if not is_temporary(entry)]
    if not content:
        return
    if not record.exists():
        raise OccupiedError(
            "the folder isn't empty and wasn't written by an earlier run: choose another or allow "
            "overwriting",
            source=path,
        )
    difference = Job.load(record).difference(job, code=False)  # results may be renewed
    if difference is not None:
        raise OccupiedError(
            f"the folder holds the results of a different job ({difference}): choose another or "
            "allow overwriting",
            source=path,
        )

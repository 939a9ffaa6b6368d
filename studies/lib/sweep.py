"""A sweep: many computations, some of them after others, in parallel processes or on a Dask
cluster.

Every result is kept as soon as its task ends, under a digest of all that it depends on; a sweep
that was interrupted, or that gets more tasks, computes only what isn't there yet.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any, Protocol

from kop_exudyn import __version__
from kop_exudyn.errors import InputError, SimulationFailure
from kop_exudyn.provenance import code_digest
from kop_exudyn.search.cluster import dask_client

log = logging.getLogger(__name__)

_ATTEMPTS = 3  # of a sweep whose worker processes keep ending
_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


@dataclass(frozen=True)
class Task:
    """One computation: ``function(**settings, **options)``, and ``before=...`` where it comes after
    another task.

    name : within the sweep
    function : of a module, gives plain data (numbers, texts, lists, mappings, arrays)
    settings : plain data on which the result depends; a `Path` in it stands for the content of that
        file
    options : further arguments on which the result doesn't depend, such as numbers of processes
    after : name of the task whose result this one starts from; `before` is None when that one
        failed
    """

    name: str
    function: Callable[..., Mapping[str, Any]]
    settings: Mapping[str, Any] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    after: str | None = None

    def described(self) -> dict[str, Any]:
        """All that the result depends on, but for the task that comes before, as plain data."""
        function = inspect.unwrap(self.function)
        return {
            "kop_exudyn": __version__,
            "code": code_digest(),
            "function": function.__qualname__,
            "settings": _plain(self.settings),
        }


@dataclass(frozen=True)
class TaskResult:
    """What came of a task.

    name, digest : the task's; the digest tells tasks of different settings apart
    value : the function's result as plain data, {"failed": why} where a simulation failed
    seconds : wall time of the task; described : see `Task.described`
    """

    name: str
    digest: str
    value: Mapping[str, Any]
    seconds: float
    described: Mapping[str, Any]

    @property
    def failed(self) -> str | None:
        return self.value.get("failed")


class ResultStore(Protocol):
    """Where results are kept; `kop_exudyn.io.sweep_store.SweepStore` keeps them as files."""

    def load(self, name: str, digest: str) -> TaskResult | None: ...

    def save(self, result: TaskResult) -> TaskResult:
        """Keep a result, and give it back as `load` will."""


def digests(tasks: Sequence[Task]) -> dict[str, str]:
    """By name: SHA-256 of all that each task's result depends on, the tasks before it included.

    Raises InputError for two tasks of one name, and for a task that comes after one that isn't
    before it in the list.
    """
    found: dict[str, str] = {}
    for task in tasks:
        if task.name in found:
            raise InputError("two tasks have the same name", field="tasks", value=task.name)
        if task.after is not None and task.after not in found:
            raise InputError(
                "comes after a task that isn't before it in the list",
                field=task.name,
                value=task.after,
            )
        content = task.described() | {"after": None if task.after is None else found[task.after]}
        found[task.name] = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    return found


def run_sweep(
    tasks: Sequence[Task],
    store: ResultStore,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    observer: Callable[[TaskResult, bool], None] = lambda result, is_new: None,
) -> dict[str, TaskResult]:
    """Results of all tasks by name, in the tasks' order; only those that the store doesn't have are
    computed.

    jobs : processes; 1 works in this one, task by task
    scheduler : address of a Dask scheduler, whose workers are used instead (optional extra
        "cluster"); files that settings name have to be readable there under the same paths
    observer : is told every result as soon as it is there, and whether it is new

    A failed simulation is a result. Raises InputError for impossible tasks and when the cluster
    can't be reached, and whatever else a task raises; results until then stay in the store.
    """
    names = digests(tasks)
    found: dict[str, TaskResult] = {}
    for task in tasks:
        kept = store.load(task.name, names[task.name])
        if kept is not None:
            found[task.name] = kept
            observer(kept, False)

    def keep(task: Task, value: Mapping[str, Any], seconds: float) -> None:
        result = TaskResult(task.name, names[task.name], value, seconds, task.described())
        found[task.name] = store.save(result)
        observer(found[task.name], True)

    if jobs == 1 and scheduler is None:
        for task in tasks:
            if task.name not in found:
                keep(task, *_call(task, _before(task, found)))
    else:
        _run_in_parallel(tasks, found, keep, jobs, scheduler)
    return {task.name: found[task.name] for task in tasks}


def _run_in_parallel(
    tasks: Sequence[Task],
    found: Mapping[str, TaskResult],
    keep: Callable[[Task, Mapping[str, Any], float], None],
    jobs: int,
    scheduler: str | None,
) -> None:
    """Run what isn't found yet; a worker that dies (of too little memory, say) costs the tasks that
    it worked on."""
    for attempt in range(_ATTEMPTS):
        missing = [task for task in tasks if task.name not in found]
        if not missing:
            return
        try:
            with _executor(min(jobs, len(missing)), scheduler) as executor:
                _work_off(missing, found, keep, executor)
        except BrokenExecutor:
            log.warning(
                "a worker process ended unexpectedly (attempt %d of %d)", attempt + 1, _ATTEMPTS
            )
    if any(task.name not in found for task in tasks):
        raise SimulationFailure("worker processes keep ending unexpectedly (out of memory?)")


def _work_off(
    missing: Sequence[Task],
    found: Mapping[str, TaskResult],
    keep: Callable[[Task, Mapping[str, Any], float], None],
    executor: Executor,
) -> None:
    """Start every task as soon as the one before it has ended."""
    waiting, running = list(missing), dict[Future, Task]()
    while waiting or running:
        for task in [t for t in waiting if t.after is None or t.after in found]:
            running[executor.submit(_call, task, _before(task, found))] = task
            waiting.remove(task)
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            keep(running.pop(future), *future.result())


def _call(task: Task, before: Mapping[str, Any] | None) -> tuple[Mapping[str, Any], float]:
    """Run in a worker: the value and the seconds that it took."""
    begin = perf_counter()
    chained = {} if task.after is None else {"before": before}
    try:
        value = task.function(**task.settings, **task.options, **chained)
    except SimulationFailure as failure:
        value = {"failed": str(failure)}
    return value, perf_counter() - begin


def _before(task: Task, found: Mapping[str, TaskResult]) -> Mapping[str, Any] | None:
    if task.after is None or found[task.after].failed is not None:
        return None
    return found[task.after].value


@contextmanager
def _executor(jobs: int, scheduler: str | None) -> Iterator[Executor]:
    """Worker processes of this machine, or those of a cluster; what still runs is given up when an
    error ends it."""
    if scheduler is not None:
        with dask_client(scheduler) as client, client.get_executor(pure=False) as executor:
            yield executor
        return
    from joblib.externals.loky.process_executor import ProcessPoolExecutor

    executor = ProcessPoolExecutor(jobs, env=_ONE_THREAD)
    try:
        yield executor
    except BaseException:
        executor.shutdown(kill_workers=True)
        raise
    executor.shutdown()


def _plain(value: Any) -> Any:
    """Settings as JSON has them; a path as its file's name and digest, a folder's as all of its
    files'."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, Path):
        return {"file": value.name, "sha256": _file_digest(value)}
    if isinstance(value, (str, int, float, bool, type(None))):
        return value
    raise TypeError(f"settings are plain data, not {type(value).__name__}")


def _file_digest(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(
            f"can't be read: {(error.strerror or str(error)).lower()}", source=path
        ) from None

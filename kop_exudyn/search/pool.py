"""Designs solved in parallel processes, of this machine or a cluster: each worker keeps its own
workspaces, tasks carry only states."""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import sleep
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

from ..errors import SimulationFailure
from ..plugins import adopt, registered_elsewhere
from ..structures.base import Design
from .cluster import Cluster
from .memory import peak_memory_mb
from .objective import DesignObjective, Reference, reference_of
from .requirements import Requirements
from .weights import Weights

log = logging.getLogger(__name__)

P = ParamSpec("P")
T = TypeVar("T")

_WATCH_S = 1.0  # between two looks whether the parent is there


class _Workspace:
    """The designs, and the objectives made of them so far."""

    def __init__(self, designs: Sequence[Design] = ()):
        self.designs = list(designs)
        self.objectives: dict[tuple[int, Weights, Requirements], DesignObjective] = {}


_workers = _Workspace()  # of a worker, filled by its initializer


def _start_worker(
    designs: list[Design],
    extensions: Mapping[str, Mapping[str, Any]],
    parent: int | None = None,
) -> None:
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    one_thread()
    adopt(extensions)
    _workers.designs, _workers.objectives = list(designs), {}


def _end_with(parent: int) -> None:
    """End this process when its parent is gone: of one that was killed, workers would wait for
    ever to be rid of their results."""
    while os.getppid() == parent:
        sleep(_WATCH_S)
    os._exit(1)


def one_thread() -> threadpool_limits:
    """One thread for the BLAS, in this process, until the returned object's
    `restore_original_limits` is called.

    The matrices are small, more threads only get in the way; and sums would depend on how many
    cores a machine has.
    """
    import scipy.linalg  # noqa: F401  # which brings a BLAS of its own: limits are set for those that are loaded

    return threadpool_limits(1, user_api="blas")


@dataclass(frozen=True)
class _Task(Generic[T]):
    """A method of one design's objective with its arguments, or (without one) its reference."""

    number: int
    reference: Reference | None = None
    weights: Weights = Weights()
    requirements: Requirements = Requirements.none()
    method: Callable[..., T] | None = None
    arguments: tuple[Any, ...] = ()


def _run_task(
    task: _Task[T], workspace: _Workspace | None = None
) -> T | Reference | SimulationFailure:
    """Run in a worker, or in the pool's own workspace; a failed simulation comes back as data, so
    that it doesn't end the whole batch."""
    own = _workers if workspace is None else workspace
    try:
        if task.reference is None or task.method is None:
            return reference_of(own.designs[task.number])
        key = (task.number, task.weights, task.requirements)
        if key not in own.objectives:
            design = own.designs[task.number]
            own.objectives[key] = DesignObjective(
                design, task.weights, task.reference, task.requirements
            )
        return task.method(own.objectives[key], *task.arguments)
    except SimulationFailure as failure:
        return failure


def _worker_memory() -> tuple[int, float]:
    return os.getpid(), peak_memory_mb()


class DesignPool:
    """Runs the methods of `DesignObjective` for many designs at once.

    designs : the designs, in the order of their numbers
    jobs : processes; 1 works in this process. Results don't depend on it: tasks carry all that they
        start from.
    scheduler : address of a Dask scheduler, whose workers are used instead; see `Cluster`, also for
        what is raised on entering
    """

    def __init__(self, designs: Sequence[Design], jobs: int = 1, scheduler: str | None = None):
        self.designs, self.jobs = list(designs), max(1, min(jobs, len(designs)))
        self.scheduler = scheduler
        self.references: list[Reference] = []
        self._parallel: Any = None  # joblib's Parallel, which is untyped
        self._cluster: Cluster | None = None
        self._threads: threadpool_limits | None = None
        # pools of several threads have designs of their own each
        self._workspace = _Workspace(self.designs)

    def __enter__(self) -> DesignPool:
        if self.scheduler is not None:
            extensions = registered_elsewhere()
            self._cluster = Cluster(self.scheduler, _start_worker, (self.designs, extensions))
        self._threads = one_thread()
        if self._cluster is None and self.jobs > 1:
            self._start()
        return self

    def __exit__(self, *exception: Any) -> None:
        if self._parallel is not None:
            self._parallel.__exit__(*exception)
            self._parallel = None
        if self._cluster is not None:
            self._cluster.close()
            self._cluster = None
        if self._threads is not None:
            self._threads.restore_original_limits()
        self._workspace.objectives.clear()

    def prepare(self) -> list[Reference]:
        """Simulate all input designs. Raises the first SimulationFailure: a kit needs all of
        them."""
        results = self._run([_Task(n) for n in range(len(self.designs))])
        for result in results:
            if isinstance(result, SimulationFailure):
                raise result
        self.references = results
        return results

    def map(
        self,
        method: Callable[Concatenate[DesignObjective, P], T],
        weights: Weights,
        calls: Mapping[int, tuple[Any, ...]],
        requirements: Requirements = Requirements.none(),
    ) -> dict[int, T | SimulationFailure]:
        """A method of the objectives of some designs, as `DesignObjective.evaluate`.

        calls : {number: arguments}

        Returns {number: result or failure}.
        """
        tasks = [
            _Task(n, self.references[n], weights, requirements, method, arguments)
            for n, arguments in calls.items()
        ]
        return dict(zip(calls, self._run(tasks)))

    def peak_memory_mb(self) -> float:
        """Largest memory of this process and of every worker that is alive, added up; MB."""
        found = {os.getpid(): peak_memory_mb()}
        if self._parallel is not None:
            from joblib import delayed

            found |= dict(self._parallel(delayed(_worker_memory)() for _ in range(4 * self.jobs)))
        if self._cluster is not None:
            return sum(found.values()) + sum(
                mb for _, mb in self._cluster.everywhere(_worker_memory)
            )
        return sum(found.values())

    def _run(self, tasks: Sequence[_Task]) -> list[Any]:
        if self._cluster is not None:
            return self._cluster.run(_run_task, tasks)
        if self._parallel is None or len(tasks) < 2:
            return [_run_task(task, self._workspace) for task in tasks]
        from joblib import delayed
        from joblib.externals.loky.process_executor import TerminatedWorkerError

        for attempt in range(3):
            try:
                return self._parallel(delayed(_run_task)(task) for task in tasks)
            except TerminatedWorkerError:
                log.warning(
                    "a worker process ended unexpectedly; starting anew (attempt %d)", attempt + 1
                )
                self._start()
        raise SimulationFailure("worker processes keep ending unexpectedly (out of memory?)")

    def _start(self) -> None:
        from joblib import Parallel

        self._parallel = Parallel(
            n_jobs=self.jobs,
            backend="loky",
            initializer=_start_worker,
            initargs=(self.designs, registered_elsewhere(), os.getpid()),
            batch_size=1,
            pre_dispatch="all",
        )
        self._parallel.__enter__()

"""The workers of a Dask cluster, on any number of machines, in place of processes of this one."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import InputError, SimulationFailure
from ..provenance import code_digest

if TYPE_CHECKING:
    from distributed import Client

T = TypeVar("T")
_TIMEOUT = 20  # s, for the scheduler to answer

# In every worker: whose start it has run, and that only one thread works.
_started: list[str] = []
_lock = threading.Lock()


def dask_client(scheduler: str) -> Client:
    """A client of a running scheduler.

    scheduler : its address, as "tcp://127.0.0.1:8786"

    Raises InputError where Dask is not installed (optional extra "cluster"), or no scheduler
    answers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            "needs Dask: install kop_exudyn[cluster]", field="scheduler", value=scheduler
        ) from None
    try:
        return Client(scheduler, timeout=_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"no Dask scheduler answers: {error}", field="scheduler", value=scheduler
        ) from None


def check_cluster(scheduler: str) -> None:
    """Raises InputError as `Cluster`, before anything is begun."""
    _usable_client(scheduler).close()


class Cluster:
    """All workers that a scheduler has.

    scheduler : its address
    start : run once in every worker before its first task, with these arguments; workers that join
        later run it as well

    Raises InputError as `dask_client`, where there are no workers, for workers of several threads
    (solvers belong to a thread each), and for those that run other code than this process.
    """

    def __init__(self, scheduler: str, start: Callable[..., object], arguments: Sequence[Any]):
        self._client = _usable_client(scheduler)
        self._key = uuid.uuid4().hex
        try:  # once to every worker, not with every task
            [self._given] = self._client.scatter([(start, tuple(arguments))], broadcast=True)
        except BaseException:
            self._client.close()
            raise

    def run(self, function: Callable[[Any], T], tasks: Sequence[Any]) -> list[T]:
        """The function's results, in the tasks' order. Raises what it raises, and SimulationFailure
        where workers keep ending."""
        from distributed import KilledWorker

        futures = self._client.map(
            _run, tasks, function=function, key_of_start=self._key, given=self._given, pure=False
        )
        try:
            found: list[T] = self._client.gather(futures)
        except KilledWorker as error:
            raise SimulationFailure(f"workers of the cluster keep ending: {error}") from None
        finally:
            self._client.cancel(futures)
        return found

    def everywhere(self, function: Callable[[], T]) -> list[T]:
        """The function's result in every worker."""
        return list(self._client.run(function).values())

    def close(self) -> None:
        """Leave the cluster; it goes on running."""
        self._client.close()


def _usable_client(scheduler: str) -> Client:
    """A client of workers that can be worked with; see `Cluster`."""
    client = dask_client(scheduler)
    try:
        threads = client.nthreads()
        codes = list(client.run(code_digest).values())
    except BaseException:
        client.close()
        raise
    several = sum(count != 1 for count in threads.values())
    other = sum(code != code_digest() for code in codes)
    if not threads:
        wrong = (
            "the Dask scheduler has no workers: start some with `dask worker ADDRESS --nthreads 1`"
        )
    elif several:
        wrong = (
            f"{several} of {len(threads)} workers of the Dask scheduler have more than one thread: "
            f"start them with --nthreads 1"
        )
    elif other:
        wrong = (
            f"{other} of {len(threads)} workers of the Dask scheduler run another version of "
            f"kop_exudyn than this one"
        )
    else:
        return client
    client.close()
    raise InputError(wrong, field="scheduler", value=scheduler)


def _run(
    task: Any,
    function: Callable[[Any], T],
    key_of_start: str,
    given: tuple[Callable[..., object], tuple[Any, ...]],
) -> T:
    """Run in a worker."""
    with _lock:
        if _started != [key_of_start]:
            start, arguments = given
            start(*arguments)
            _started[:] = [key_of_start]
        return function(task)

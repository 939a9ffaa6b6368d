"""Limits of time and memory for what may hang or grow: both show up as exceptions in the code that
is limited."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator


class TimeOut(BaseException):
    """The time is over. No `Exception`, so that no handler of the limited code takes it for its
    own."""


_PATIENCE = 30  # times the limit: what waits for something uses no processor


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeOut after so many seconds of processor time, however busy the machine is, or after
    30 times as long by the clock; without effect where there are no alarms, or outside of the main
    thread."""
    if (
        not hasattr(signal, "setitimer")
        or threading.current_thread() is not threading.main_thread()
    ):
        yield
        return

    def give_up(signum, frame):
        raise TimeOut

    timers = (
        (signal.ITIMER_PROF, signal.SIGPROF, seconds),
        (signal.ITIMER_REAL, signal.SIGALRM, _PATIENCE * seconds),
    )
    before = [signal.signal(number, give_up) for _, number, _ in timers]
    for timer, _, limit in timers:
        signal.setitimer(timer, limit)
    try:
        yield
    finally:
        for timer, _, _ in timers:
            signal.setitimer(timer, 0)
        for (_, number, _), handler in zip(timers, before):
            signal.signal(number, handler)


@contextlib.contextmanager
def memory_limit(megabytes: float) -> Iterator[None]:
    """Let the process grow by so much at most, beyond which it meets MemoryError; without effect
    outside of Linux."""
    try:
        import resource

        with open("/proc/self/statm", encoding="ascii") as file:
            pages = int(file.read().split()[0])
    except (ImportError, OSError):
        yield
        return
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(
        resource.RLIMIT_AS, (int(pages * resource.getpagesize() + megabytes * 2**20), before[1])
    )
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)

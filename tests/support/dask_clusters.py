"""Small Dask clusters on this machine, and clients that don't wait long for one."""

from __future__ import annotations

from functools import wraps

import distributed


def local_cluster(workers: int, threads: int = 1) -> distributed.LocalCluster:
    """A cluster of that many worker processes, each of so many threads."""
    return distributed.LocalCluster(
        n_workers=workers,
        threads_per_worker=threads,
        processes=True,
        dashboard_address=None,
        host="127.0.0.1",
    )


def hurried(client):
    """The client's class, which gives a scheduler one second to answer."""

    @wraps(client)
    def connect(address, timeout, **options):
        return client(address, timeout=1, **options)

    return connect

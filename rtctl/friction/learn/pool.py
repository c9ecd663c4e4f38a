"""Workers of a search: processes or threads of this machine, or a cluster."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from rtctl.errors import DataError


@contextlib.contextmanager
def workers(backend: str, n_jobs: int) -> Iterator[Any]:
    """Pool of joblib workers.

    Dask: the cluster of the current client, else the one that DASK_SCHEDULER_ADDRESS names, else a local one
    for the time of the search.

    Raises
    ------
    DataError
        When dask is asked for and not installed."""
    import joblib

    with contextlib.ExitStack() as stack:
        # first: joblib's dask backend takes the client that is there, and begins none
        if backend == "dask":
            _enter_dask(stack, n_jobs if n_jobs > 0 else joblib.cpu_count())
        stack.enter_context(joblib.parallel_config(backend=backend, n_jobs=n_jobs))
        yield stack.enter_context(joblib.Parallel(return_as="generator"))


def _enter_dask(stack: contextlib.ExitStack, n_workers: int) -> None:
    try:
        import dask.config
        from distributed import Client, LocalCluster, get_client
    except ImportError as error:
        raise DataError("--backend dask needs dask: pip install 'rtctl[dask]'") from error
    client: Any = Client
    cluster: Any = LocalCluster
    address = dask.config.get("scheduler-address", None)
    try:
        # a cluster that the caller opened goes before any other: it is the one that was meant
        get_client()
    except ValueError:  # no client yet
        if not address:
            local = cluster(n_workers=n_workers, threads_per_worker=1, dashboard_address=None)
            address = stack.enter_context(local)
        stack.enter_context(client(address))

"""Who works: threads, processes of our own, or the workers of a dask scheduler."""

from __future__ import annotations

import gc
import logging
import os
import warnings
from contextlib import contextmanager, suppress
from functools import partial
from importlib import metadata
from platform import python_version
from typing import TYPE_CHECKING

from sparsor.core.cluster import ONE_THREAD, Cluster
from sparsor.core.workers import Workers, workers_of
from sparsor.errors import SchedulerError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from distributed import Client

LOCAL = "local"
_ANSWER_S = 5  # a scheduler that is there answers at once
_START_S = 60  # processes of our own, on a busy machine
# What has to be the same for the same answer.
_SAME = ("sparsor", "numpy", "scipy", "numba", "scikit-learn")
_SETTINGS = {
    "distributed.scheduler.allowed-failures": 3,  # a part that took three workers down with it is at fault
    "distributed.admin.large-graph-warning-threshold": "1GB",  # what is shared travels in the graph, on purpose
    "distributed.scheduler.active-memory-manager.start": False,  # what is shared stays with all workers
    "distributed.worker.profile.enabled": False,
    # A worker that died is started again; if that takes longer, dask gives up the worker for good. A busy machine does.
    "distributed.deploy.lost-worker-timeout": "1h",
    # Without dask's MALLOC_TRIM_THRESHOLD_, with which memory goes back to the system and is asked for again all the
    # time.
    "distributed.nanny.pre-spawn-environ": ONE_THREAD,
    # A Ctrl-C goes to all processes of a terminal: it is for us, who may still want what the workers have found.
    "distributed.worker.preload": ["import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)"],
    "distributed.comm.timeouts.connect": _ANSWER_S,
}


@contextmanager
def workers_at(scheduler: str | None, count: int | None = None) -> Iterator[Workers]:
    """Yield who works: threads, worker processes of our own, or those of a dask scheduler.

    Parameters
    ----------
    scheduler : str, optional
        None for threads; "local" for processes of one thread each on this machine, ended when the context is left;
        else the address of a dask scheduler, e.g. ``tcp://192.168.1.5:8786``.
    count : int, optional
        Threads or processes, one a core by default. A scheduler elsewhere has as many as it has.

    Raises
    ------
    SchedulerError
        When nobody answers at the address, it has no workers, or what they run is not what is run here.
    """
    if scheduler is None:
        yield workers_of(count)
        return
    import dask
    import distributed  # noqa: F401 # it fills the configuration that is changed here for a while

    if scheduler != LOCAL and count is not None:
        raise SchedulerError(
            f"--workers {count}: the scheduler at {scheduler} has workers of its own; leave --workers out"
        )
    # A client that never reached anybody closes itself when it is collected. While another one starts that would wait,
    # for good, for a lock of dask's which the start holds.
    gc.collect()
    reached = _processes(count) if scheduler == LOCAL else _client(scheduler)
    with dask.config.set(_SETTINGS), _quiet(), reached as client:
        yield Cluster(client, scheduler)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep dask's own words off the terminal: what matters of them, our errors say."""
    logger = logging.getLogger("distributed")
    before = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module="distributed")
            yield
    finally:
        logger.setLevel(before)


@contextmanager
def _processes(count: int | None) -> Iterator[Client]:
    """Yield the client of processes on this machine, which end with the context."""
    from distributed import Client, LocalCluster

    cluster = LocalCluster(
        n_workers=count or os.cpu_count() or 1,
        threads_per_worker=1,
        memory_limit=0,  # the system's own limit; dask's would end a worker that learns from a large field
        dashboard_address=None,
        silence_logs=logging.CRITICAL + 1,
    )
    try:
        with Client(cluster, timeout=_START_S, set_as_default=False) as client:
            yield client
    finally:
        with suppress(AssertionError):  # of dask, when a worker that died is just being started again
            cluster.close()


@contextmanager
def _client(address: str) -> Iterator[Client]:
    """Yield the client of a scheduler whose workers run what is run here."""
    from distributed import Client

    connect = partial(Client, address, timeout=_ANSWER_S, set_as_default=False)
    try:
        try:
            client = connect()
        except AssertionError:  # dask's own thread did not start within its ten seconds: a machine that stood still
            client = connect()
    except (OSError, ValueError, ImportError, TypeError) as error:
        raise SchedulerError(
            f"no dask scheduler answers at '{address}' ({error}): is it started ('dask scheduler'), and is the "
            "address the one it prints, such as tcp://192.168.1.5:8786? '--scheduler local' needs none"
        ) from error
    with client:
        _check(client, address)
        yield client


def _check(client: Client, address: str) -> None:
    """Refuse workers that are not there, or that would give another answer."""
    try:
        client.wait_for_workers(1, timeout=_ANSWER_S)
    except TimeoutError:
        raise SchedulerError(
            f"the scheduler at '{address}' has no workers: start some with 'dask worker {address} --nthreads 1'"
        ) from None
    for what in ("Python", *_SAME):
        here = _here(what)
        # Functions of the standard library: it is not known yet whether the other side has ours.
        asked = (python_version,) if what == "Python" else (metadata.version, what)
        try:
            found = {"its scheduler": client.run_on_scheduler(*asked), **client.run(*asked)}
        except metadata.PackageNotFoundError:
            raise SchedulerError(
                f"the scheduler at '{address}', or a worker of it, has no {what}: install sparsor {_here('sparsor')} "
                "where they run"
            ) from None
        for where, there in found.items():
            if there != here:
                raise SchedulerError(
                    f"{where} of '{address}' runs {what} {there}, here it is {here}: the answer could differ; install "
                    "the same version"
                )


def _here(what: str) -> str:
    return python_version() if what == "Python" else metadata.version(what)

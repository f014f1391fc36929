"""Workers that are processes of their own, on this machine or others, by dask.distributed."""

from __future__ import annotations

import logging
import os
import pickle
import uuid
import warnings
from contextlib import contextmanager, suppress
from functools import cache, lru_cache, partial
from importlib import metadata
from itertools import count as numbers
from itertools import islice
from platform import python_version
from typing import TYPE_CHECKING, Any, TypeVar, cast

from threadpoolctl import threadpool_limits

from sparsor.core.workers import Shared, Workers, workers_of
from sparsor.errors import SchedulerError, WorkersLostError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from distributed import Client, Future

Given = TypeVar("Given")
Part = TypeVar("Part")
Result = TypeVar("Result")

LOCAL = "local"
_ANSWER_S = 5  # a scheduler that is there answers at once
_PATIENCE_S = 60  # with a scheduler whose workers all died
_START_S = 60  # processes of our own, on a busy machine
_AHEAD = 2  # parts handed out for each worker, so that none waits for the next
_KEPT = 8  # shared values that a worker process keeps unpacked
_GRAIN = 8  # a part and its result take some milliseconds to a worker and back
# What has to be the same for the same answer.
_SAME = ("sparsor", "numpy", "scipy", "numba", "scikit-learn")
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
_SETTINGS = {
    "distributed.scheduler.allowed-failures": 3,  # a part that took three workers down with it is at fault
    "distributed.admin.large-graph-warning-threshold": "1GB",  # what is shared travels in the graph, on purpose
    "distributed.scheduler.active-memory-manager.start": False,  # what is shared stays with all workers
    "distributed.worker.profile.enabled": False,
    # Without dask's MALLOC_TRIM_THRESHOLD_, with which memory goes back to the system and is asked for again all the
    # time: a third more seconds for Algorithm 1.
    "distributed.nanny.pre-spawn-environ": _ONE_THREAD,
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
    reached = _processes(count) if scheduler == LOCAL else _client(scheduler)
    with dask.config.set(_SETTINGS), _quiet(), reached as client:
        yield Cluster(client, scheduler)


class Cluster:
    """The workers of a dask scheduler.

    Parameters
    ----------
    client : distributed.Client
    address : str
        As the user knows it.
    """

    grain = _GRAIN

    def __init__(self, client: Client, address: str) -> None:
        self._client, self._address = client, address
        self.count = max(1, sum(client.nthreads().values()))

    def share(self, given: Given) -> Shared[Given]:
        """Send to the workers, once, what all parts are given.

        As the result of a task, not as scattered data: those are lost with the only worker that holds them, a result
        is made again.
        """
        import cloudpickle

        name, held = uuid.uuid4().hex, self._submit(_as_it_is, cloudpickle.dumps(given))
        with self._failures():
            self._client.replicate([held])  # else the first parts all go to the worker that has it
        return Shared((name, held))

    def processes(self) -> list[int]:
        """Return the numbers of the workers' processes."""
        return list(self._client.run(os.getpid).values())

    def map(
        self, function: Callable[[Given, Part], Result], shared: Shared[Given], parts: Iterable[Part]
    ) -> Iterator[Result]:
        """Yield ``function(shared, part)`` in the order of the parts.

        Whoever is ready gets the next part, also when one before it takes longer: its worker may have died.
        """
        from distributed import wait

        left, order, room = iter(parts), numbers(), self.count * _AHEAD
        place: dict[Future, int] = {}
        finished: dict[int, Result] = {}
        due = 0
        try:
            with self._failures():
                while True:
                    for part in islice(left, room - len(place)):
                        place[self._hand_out(function, shared, part)] = next(order)
                    if not place:
                        return
                    ready, _ = self._patiently(partial(wait, list(place), return_when="FIRST_COMPLETED"))
                    for future in ready:
                        finished[place.pop(future)] = pickle.loads(future.result())
                    while due in finished:
                        yield finished.pop(due)
                        due += 1
        finally:
            self._forget(list(place))

    def call(self, function: Callable[[Given, Part], Result], shared: Shared[Given], part: Part) -> Result:
        """Return ``function(shared, part)``, worked out by a worker."""
        with self._failures():
            result: Result = pickle.loads(self._patiently(self._hand_out(function, shared, part).result))
        return result

    def _hand_out(self, function: Callable[[Given, Part], Result], shared: Shared[Given], part: Part) -> Future:
        name, given = cast("tuple[str, Future]", shared.held)
        return self._submit(_work, function, name, given, pickle.dumps(part))

    def _submit(self, function: Callable[..., Any], *given: object) -> Future:
        # A key of its own: work given twice is work done twice, and what was cancelled is not taken for it.
        key = f"sparsor-{function.__name__.strip('_')}-{uuid.uuid4().hex}"
        return self._client.submit(function, *given, key=key, pure=False)

    def _patiently(self, ask: Callable[..., Any]) -> Any:  # noqa: ANN401 # whatever it answers
        """Wait for an answer as long as there are workers; for a while also without, as new ones may be starting."""
        while True:
            try:
                with self._client.as_current():
                    return ask(timeout=_PATIENCE_S)
            except TimeoutError:
                if not self._client.nthreads():
                    raise WorkersLostError(
                        f"the scheduler '{self._address}' has had no worker for {_PATIENCE_S} s: the last one died"
                    ) from None

    def _forget(self, futures: list[Future]) -> None:
        """Cancel what nobody waits for any more."""
        if futures:
            with suppress(Exception):  # the scheduler may be gone, which is why there is something left
                self._client.cancel(futures, force=True)

    @contextmanager
    def _failures(self) -> Iterator[None]:
        """Say in a sentence that the workers or their scheduler are gone."""
        from asyncio import CancelledError
        from concurrent.futures import CancelledError as ThreadCancelledError

        from distributed import KilledWorker
        from distributed.comm import CommClosedError

        try:
            yield
        except KilledWorker as error:
            raise WorkersLostError(
                f"several workers of the scheduler '{self._address}' died over the same part of the work: have they "
                "enough memory?"
            ) from error
        except (CancelledError, ThreadCancelledError, CommClosedError) as error:
            raise WorkersLostError(f"the scheduler '{self._address}' is gone, and the work with it") from error


def _as_it_is(packed: bytes) -> bytes:
    return packed


@lru_cache(_KEPT)
def _unpacked(name: str) -> list[Any]:
    """Return the place of a worker process for what its parts are given under a name."""
    del name
    return []


def _work(function: Callable[[Any, Part], Result], name: str, given: bytes, part: bytes) -> bytes:
    """Work out a part as it would be here.

    Everything is pickled by us: arrays that dask unpacks cannot be written to, which to numba is another type, and
    would be compiled for anew.
    """
    _keep_to_one_thread()
    held = _unpacked(name)
    if not held:
        held.append(pickle.loads(given))
    return pickle.dumps(function(held[0], pickle.loads(part)))


@cache
def _keep_to_one_thread() -> None:
    """Let linear algebra in this worker sum in one order from now on: in what is loaded, and what will be.

    For good, as a worker of several threads may be at several parts at a time.
    """
    os.environ.update(_ONE_THREAD)
    threadpool_limits(1)


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
    with cluster, Client(cluster, timeout=_START_S, set_as_default=False) as client:
        yield client


@contextmanager
def _client(address: str) -> Iterator[Client]:
    """Yield the client of a scheduler whose workers run what is run here."""
    from distributed import Client

    try:
        client = Client(address, timeout=_ANSWER_S, set_as_default=False)
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

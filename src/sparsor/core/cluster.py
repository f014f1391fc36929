"""Workers that are processes of their own, on this machine or others, by dask.distributed; see `core.schedulers`."""

from __future__ import annotations

import os
import pickle
import uuid
from contextlib import contextmanager, suppress
from functools import cache, lru_cache, partial
from itertools import count as numbers
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar, cast

from threadpoolctl import threadpool_limits

from sparsor.core.workers import Shared
from sparsor.errors import WorkersLostError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from distributed import Client, Future

Given = TypeVar("Given")
Part = TypeVar("Part")
Result = TypeVar("Result")

_PATIENCE_S = 60  # with a scheduler whose workers all died
_AHEAD = 2  # parts handed out for each worker, so that none waits for the next
_KEPT = 8  # shared values that a worker process keeps unpacked
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
_GRAIN = 32  # a part and its result take some milliseconds to a worker and back


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
        from distributed import wait

        name, held = uuid.uuid4().hex, self._submit(_as_it_is, cloudpickle.dumps(given))
        with self._failures(), self._client.as_current():
            self._patiently(partial(wait, [held]))
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
                    # Not in `call`: it sets dask's configuration, which threads would leave behind set.
                    with self._client.as_current():
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
    os.environ.update(ONE_THREAD)
    threadpool_limits(1)

"""Work on several cores, or machines, that gives the same answer on any number of them.

Work is cut into parts that depend on nothing but what they are given, and what the parts give is put together in the
order of the parts. `core.cluster` has the workers that are processes of their own.
"""

from __future__ import annotations

import os
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar, cast

from threadpoolctl import threadpool_limits

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from concurrent.futures import Future
    from contextlib import AbstractContextManager

Given = TypeVar("Given")
Part = TypeVar("Part")
Result = TypeVar("Result")

_AHEAD = 2  # parts handed out for each worker, so that none waits for the next


@dataclass(frozen=True)
class Shared(Generic[Given]):
    """What every part of a piece of work is given, held where the workers are."""

    held: object


class Workers(Protocol):
    """Who does work that is cut into parts.

    What is handed to them are functions of modules and values that can be pickled; a function may be run again when
    a worker is lost, so it changes nothing but what it returns.
    """

    @property
    def count(self) -> int:
        """How many parts are worked on at a time."""
        ...

    @property
    def grain(self) -> int:
        """How many of the smallest parts are best handed out together: the more, the longer the way to a worker."""
        ...

    def share(self, given: Given) -> Shared[Given]:
        """Take to the workers, once, what all parts are given."""
        ...

    def map(
        self, function: Callable[[Given, Part], Result], shared: Shared[Given], parts: Iterable[Part]
    ) -> Iterator[Result]:
        """Yield ``function(shared, part)`` in the order of the parts.

        A part is taken from the iterable when a worker has room for it, by the thread that consumes the results: so
        an iterable may look at the results so far.
        """
        ...

    def call(self, function: Callable[[Given, Part], Result], shared: Shared[Given], part: Part) -> Result:
        """Return ``function(shared, part)``; may be called by several threads."""
        ...


class Threads:
    """Workers that are threads of this process: for compiled functions, which release the interpreter's lock.

    Parameters
    ----------
    count : int

    Examples
    --------
    >>> two = Threads(2)
    >>> list(two.map(pow, two.share(2), range(5)))
    [1, 2, 4, 8, 16]
    """

    grain = 1

    def __init__(self, count: int) -> None:
        self.count = count

    def share(self, given: Given) -> Shared[Given]:
        """Keep it: threads see it as it is."""
        return Shared(given)

    def map(
        self, function: Callable[[Given, Part], Result], shared: Shared[Given], parts: Iterable[Part]
    ) -> Iterator[Result]:
        """Yield ``function(shared, part)`` in the order of the parts."""
        waiting: deque[Future[Result]] = deque()
        with ThreadPoolExecutor(self.count) as pool:
            try:
                for part in parts:
                    waiting.append(pool.submit(self.call, function, shared, part))
                    if len(waiting) >= self.count * _AHEAD:
                        yield waiting.popleft().result()
                while waiting:
                    yield waiting.popleft().result()
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise

    def call(self, function: Callable[[Given, Part], Result], shared: Shared[Given], part: Part) -> Result:
        """Return ``function(shared, part)``, worked out by the thread that asks."""
        return function(shared.held, part)  # type: ignore[arg-type] # share() held what it was given


def workers_of(asked: Workers | int | None) -> Workers:
    """Return the workers asked for: themselves, so many threads, or a thread for each core."""
    if asked is None:
        return Threads(os.cpu_count() or 1)
    return Threads(asked) if isinstance(asked, int) else asked


def one_blas_thread() -> AbstractContextManager[object]:
    """Return the context in which linear algebra sums in one order, whatever the number of cores."""
    return cast("AbstractContextManager[object]", threadpool_limits(1))

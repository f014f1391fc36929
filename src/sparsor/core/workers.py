"""Work on several cores that gives the same answer on any number of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from threadpoolctl import threadpool_limits

if TYPE_CHECKING:
    from contextlib import AbstractContextManager


def one_blas_thread() -> AbstractContextManager[object]:
    """Return the context in which linear algebra sums in one order, whatever the number of cores."""
    return cast("AbstractContextManager[object]", threadpool_limits(1))

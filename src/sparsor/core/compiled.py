"""numba's `njit`, with names of compiled functions that no other process gives.

numba numbers functions as it compiles them and keeps the number in the names of what it caches. Functions that two
processes compiled, in another order or for other arguments, may so have one name; the process that loads both from the
cache then runs one in the place of the other, until the files are deleted (numba issue 10486). PyTensor mends it alike.
"""

from __future__ import annotations

import uuid

from numba import njit
from numba.core.bytecode import FunctionIdentity

__all__ = ["njit"]

FunctionIdentity._unique_ids = iter(lambda: uuid.uuid4().int, None)  # type: ignore[assignment]  # noqa: SLF001

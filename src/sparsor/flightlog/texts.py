"""Texts of a fixed length, as MAVLink and the vehicles' logs hold them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray


def text_of(raw: bytes) -> str:
    r"""Return the text up to its first zero byte; what follows that is rubbish, and it may be missing.

    Examples
    --------
    >>> text_of(b"NO2\x00\xfe\x12"), text_of(b"0123456789")
    ('NO2', '0123456789')
    """
    return raw.partition(b"\x00")[0].decode("utf-8", "replace").strip()


def rows_by_text(raw: np.ndarray) -> Iterator[tuple[str, slice | NDArray[np.intp]]]:
    r"""Yield every text among some of a fixed length, and the rows in which it stands.

    Examples
    --------
    >>> for text, rows in rows_by_text(np.array([b"a", b"b", b"a\x00\xfe"])):
    ...     print(text, rows)
    a [0 2]
    b [1]
    """
    if raw.size == 0:
        return
    if (raw == raw[0]).all():
        yield text_of(bytes(raw[0])), slice(None)
        return
    numbers: dict[str, int] = {}
    known: dict[bytes, int] = {}
    which = np.empty(raw.size, dtype=np.uint32)
    for row, one in enumerate(raw.tolist()):
        number = known.get(one)
        if number is None:  # what stands behind a text's end may differ
            number = known[one] = numbers.setdefault(text_of(one), len(numbers))
        which[row] = number
    rows = np.argsort(which, kind="stable")
    ends = np.cumsum(np.bincount(which)).tolist()
    for text, start, end in zip(numbers, [0, *ends], ends, strict=False):
        yield text, rows[start:end]

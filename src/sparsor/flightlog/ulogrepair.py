"""A damaged .ulg without the bytes that belong to no message.

pyulog finds its way behind damage only where a synchronisation message stands, which many logs lack. A message has no
checksum: it is believed when its length leads to another one. The messages of a topic are all of one length, so that
few false ones pass.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sparsor.core.compiled import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

_FILE_HEAD: Final = 16
_HEAD: Final = 3
_DATA, _SUBSCRIPTION = ord("D"), ord("A")
_ANY, _NONE = -1, -2
_KINDS: Final = b"BFIMPQADRLCSOU"  # https://docs.px4.io/main/en/dev_log/ulog_file_format.html
_LONGEST = 4096  # of what is no data: texts, descriptions
_SHORT = 512
_APPENDED = slice(_FILE_HEAD + _HEAD + 16, _FILE_HEAD + _HEAD + 40)


def mended(contents: bytes) -> tuple[bytes, int, int]:
    """Return a .ulg in which every message leads to the next, how many bytes were left out, and in how many places.

    A whole log is returned as it is. So is one whose first message says that more was appended to it, and where: that
    would move.
    """
    data = np.frombuffer(contents, dtype=np.uint8)
    if data.size < _FILE_HEAD or any(contents[_APPENDED]):
        return contents, 0, 0
    kinds = np.zeros(256, dtype=np.bool_)
    kinds[list(_KINDS)] = True
    edges = _edges(data, kinds, np.full(1 << 16, _ANY, dtype=np.int32))
    if edges.size <= 2:  # whole, or broken off
        return contents, 0, 0
    edges = _edges(data, kinds, _usual_lengths(data, edges))
    pieces = [contents[start:end] for start, end in edges.reshape(-1, 2).tolist()]
    whole = contents[:_FILE_HEAD] + b"".join(pieces)
    return whole, len(contents) - len(whole), max(len(pieces) - 1, 1)


def _usual_lengths(data: NDArray[np.uint8], edges: NDArray[np.int64]) -> NDArray[np.int32]:
    """Return the length that most messages of a topic have, for topics that the log says it holds."""
    kind, topic, length = _topics(data, edges).T
    usual = np.full(1 << 16, _NONE, dtype=np.int32)
    for known in np.unique(topic[kind == _SUBSCRIPTION]).tolist():
        own = length[(kind == _DATA) & (topic == known)]
        usual[known] = np.bincount(own).argmax() if own.size else _ANY
    return usual


@njit(cache=True, nogil=True)
def _size(data: NDArray[np.uint8], at: int, kinds: NDArray[np.bool_], lengths: NDArray[np.int32]) -> int:
    """Return the size of the message whose head may stand at a place, -1 when none does."""
    if at + _HEAD > data.size or not kinds[data[at + 2]]:
        return -1
    size = np.int64(data[at]) | np.int64(data[at + 1]) << 8
    if data[at + 2] != _DATA:
        return int(size) if 0 < size <= _LONGEST else -1
    if size < 2 or at + _HEAD + 2 > data.size:
        return -1
    usual = lengths[np.int64(data[at + 3]) | np.int64(data[at + 4]) << 8]
    return int(size) if usual == _ANY or usual == size else -1  # noqa: SIM109 - the compiler knows no `in` here


@njit(cache=True, nogil=True)
def _leads(data: NDArray[np.uint8], after: int, kinds: NDArray[np.bool_], lengths: NDArray[np.int32]) -> bool:
    """Return whether a message may end at a place: another one begins there, or the file ends with it."""
    rest = data.size - after
    return 0 <= rest < _HEAD + 2 or (rest > 0 and _size(data, after, kinds, lengths) >= 0)


@njit(cache=True, nogil=True)
def _edges(data: NDArray[np.uint8], kinds: NDArray[np.bool_], lengths: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return where the stretches of messages that lead to each other begin and end."""
    edges = np.empty(2 + data.size // _HEAD, dtype=np.int64)
    count = 0
    at = _FILE_HEAD
    searching = False
    edges[0], count = at, 1
    while at < data.size:
        size = _size(data, at, kinds, lengths)
        after = at + _HEAD + size
        # Out of step a message of data is believed by its length, another one when it is short.
        if (
            size >= 0
            and not (searching and data[at + 2] != _DATA and size > _SHORT)
            and _leads(data, after, kinds, lengths)
        ):
            if searching:
                edges[count] = at
                count += 1
                searching = False
            at = after
            continue
        if not searching:
            edges[count] = at
            count += 1
            searching = True
        at += 1
    if not searching:
        edges[count] = data.size
        count += 1
    return edges[:count].copy()


@njit(cache=True, nogil=True)
def _topics(data: NDArray[np.uint8], edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return kind, topic and size of all subscriptions and messages of data in the stretches."""
    found = np.empty((data.size // (_HEAD + 2) + 1, 3), dtype=np.int64)
    count = 0
    for stretch in range(edges.size // 2):
        at = edges[2 * stretch]
        while at + _HEAD + 3 <= edges[2 * stretch + 1]:
            kind = data[at + 2]
            if kind == _DATA or kind == _SUBSCRIPTION:  # noqa: SIM109
                place = at + _HEAD + (kind == _SUBSCRIPTION)  # behind the number of the instance
                size = np.int64(data[at]) | np.int64(data[at + 1]) << 8
                found[count, 0] = kind
                found[count, 1] = np.int64(data[place]) | np.int64(data[place + 1]) << 8
                found[count, 2] = size
                count += 1
            at += _HEAD + (np.int64(data[at]) | np.int64(data[at + 1]) << 8)
    return found[:count].copy()

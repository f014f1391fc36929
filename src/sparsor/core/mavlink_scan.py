"""The frames of a .tlog found in blocks of bytes, compiled: a hundred times faster than one frame at a time.

A .tlog is a row of records: 8 bytes of big-endian microseconds since 1970, then a frame. What `mavlink_frames` says
about frames holds here too; what differs is the space between them, and that frames of messages which the dialect
does not know are only counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sparsor.core.mavlink_compiled import (
    DAMAGED,
    FRAMES,
    IDS,
    LOST,
    RECORD,
    SKIPPED,
    STAMP,
    STRANGE,
    checksum_tables,
    extras_table,
    gather,
    grouped,
    scan,
)
from sparsor.core.mavlink_frames import CHECKSUM, HEADER_V1

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from numpy.typing import NDArray

__all__ = ["RECORD", "STAMP", "Block", "Group", "TlogScanner"]


@dataclass(frozen=True, eq=False)
class Group:
    """The frames of one kind of message from one sender.

    Parameters
    ----------
    message, system, component : int
    block : Block
    rows : array of int32 (n,)
        Which of the block's records they are, in the order of the file.
    """

    message: int
    system: int
    component: int
    block: Block
    rows: NDArray[np.int32]

    def fields(self, layout: np.dtype[np.void]) -> np.ndarray:
        """Return the payloads as a structured array (n,); missing bytes at the end are zeros."""
        fields = np.zeros((self.rows.size, layout.itemsize), dtype=np.uint8)
        gather(self.block.data, self.block.records, self.rows, fields)
        return fields.view(layout)[:, 0]


@dataclass(frozen=True, eq=False)
class Block:
    """The wanted frames of a block of the file.

    Parameters
    ----------
    data : array of uint8
    records : array of RECORD
        Their `at` points into `data`. The next block is written over them.
    """

    data: NDArray[np.uint8]
    records: np.ndarray


class TlogScanner:
    """Takes a .tlog block by block and finds the frames in it.

    What is found does not depend on how the file was cut into blocks. Behind damage every byte may begin a frame, and
    every frame whose checksum is right is taken: a frame that survived is found, and one in 65 536 false
    beginnings passes for one.

    Parameters
    ----------
    wanted : collection of int
        Message ids that are returned; all others are only counted.

    Examples
    --------
    >>> beat = bytes.fromhex("fd0900000001010000000000000002030003034f5b")
    >>> scanner = TlogScanner({0})
    >>> scanner.feed(b"damage" + bytes(8) + beat, ended=True).records["system"]
    array([1], dtype=uint8)
    >>> scanner.frames, scanner.skipped
    (1, 6)
    """

    def __init__(self, wanted: Collection[int]) -> None:
        self._kinds = len(wanted)
        self._slots = np.full(IDS, -1, dtype=np.int16)
        self._slots[list(wanted)] = np.arange(self._kinds)
        self._numbers = np.zeros((1 << 16) * self._kinds, dtype=np.int32)
        self._rest = np.zeros(0, dtype=np.uint8)
        self._records = np.empty(0, dtype=RECORD)
        self._totals = np.zeros(5, dtype=np.int64)
        self._heard = np.zeros((256, 256), dtype=np.int64)
        self._sequence = np.full((256, 256), -1, dtype=np.int16)
        self._stamp = np.zeros(1, dtype=np.uint64)
        self._searching = False

    def feed(self, data: bytes, *, ended: bool) -> Block:
        """Take the next block, the last one if `ended`; return what is complete now."""
        block = np.concatenate((self._rest, np.frombuffer(data, dtype=np.uint8)))
        most = block.size // (HEADER_V1 + CHECKSUM) + 1
        if most > self._records.size:
            self._records = np.empty(most, dtype=RECORD)
        at, count, self._searching = scan(
            block,
            ended,
            self._searching,
            checksum_tables(),
            extras_table(),
            self._slots,
            self._totals,
            self._heard,
            self._sequence,
            self._stamp,
            self._records,
        )
        self._rest = block[at:].copy()
        return Block(block, self._records[:count])

    def groups(self, block: Block) -> Iterator[Group]:
        """Yield the frames of a block apart by message and sender, in the order in which they first come."""
        rows, firsts, ends = grouped(block.records, self._slots, self._numbers, self._kinds)
        start = 0
        for first, end in zip(block.records[firsts], ends.tolist(), strict=True):
            yield Group(int(first["message"]), int(first["system"]), int(first["component"]), block, rows[start:end])
            start = end

    @property
    def frames(self) -> int:
        """Frames of known messages so far, wanted or not."""
        return int(self._totals[FRAMES])

    @property
    def skipped(self) -> int:
        """Bytes that belonged to no record."""
        return int(self._totals[SKIPPED])

    @property
    def damaged(self) -> int:
        """Places where a record was due and none stood."""
        return int(self._totals[DAMAGED])

    @property
    def unknown(self) -> int:
        """Frames of messages that the dialect lacks."""
        return int(self._totals[STRANGE])

    @property
    def lost(self) -> int:
        """Frames that the senders' counters say are missing (a gap of more than 255 counts for less)."""
        return int(self._totals[LOST])

    def heard(self) -> dict[tuple[int, int], int]:
        """Return system and component of every sender to the number of its frames."""
        return {(int(s), int(c)): int(self._heard[s, c]) for s, c in zip(*np.nonzero(self._heard), strict=True)}

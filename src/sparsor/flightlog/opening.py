"""A file's bytes block by block, unpacked on the way, with progress."""

from __future__ import annotations

import gzip
import lzma
import zlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from sparsor.core.progress import silent
from sparsor.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from io import BufferedIOBase, BufferedReader
    from pathlib import Path

    from sparsor.core.progress import Progress

BLOCK: Final = 1 << 20
MOST_AT_ONCE: Final = 1 << 30
_GZIP, _XZ = b"\x1f\x8b", b"\xfd7zXZ\x00"
_BROKEN = (EOFError, gzip.BadGzipFile, lzma.LZMAError, zlib.error)


@dataclass(eq=False)
class LogFile:
    """A log on the disk, perhaps packed by gzip or xz.

    Parameters
    ----------
    path : Path
    progress : Progress

    Attributes
    ----------
    cut_short : bool
        Whether the packed file broke off; what came before was read.
    """

    path: Path
    progress: Progress = silent
    cut_short: bool = field(default=False, init=False)

    def blocks(self, size: int = BLOCK) -> Iterator[bytes]:
        """Yield the contents in blocks of at most `size` bytes.

        Raises
        ------
        LogError
            When the file cannot be read.
        """
        try:
            total = self.path.stat().st_size
            with self.path.open("rb") as raw:
                for block in self._unpacked(_unpacker(raw), size):
                    self.progress(f"reading {self.path.name}", min(raw.tell(), total), total)
                    yield block
        except OSError as error:
            raise LogError(f"cannot read '{self.path}': {error.strerror or error}; give a flight log") from error

    def head(self, size: int) -> bytes:
        """Return the first bytes."""
        return next(LogFile(self.path).blocks(size), b"")

    def contents(self, most: int = MOST_AT_ONCE) -> bytes:
        """Return all of it, for readers that need it at once.

        Raises
        ------
        LogError
            When it is longer than `most` bytes, or the file cannot be read.
        """
        blocks: list[bytes] = []
        size = 0
        for block in self.blocks():
            size += len(block)
            if size > most:
                raise LogError(
                    f"'{self.path}' is longer than {most / 1e9:.1f} GB (unpacked), and a log of this kind is read at "
                    "once; give the logs of single flights"
                )
            blocks.append(block)
        return b"".join(blocks)

    def _unpacked(self, stream: BufferedIOBase, size: int) -> Iterator[bytes]:
        block = bytearray()
        while not self.cut_short:
            try:
                piece = stream.read1(size - len(block))  # not `read`, which forgets what came before a break
            except _BROKEN:
                self.cut_short = True
                piece = b""
            if len(piece) == size:  # the whole block at once: nothing to put together
                yield piece
                continue
            block += piece
            if block and (not piece or len(block) == size):
                yield bytes(block)
                block.clear()
            if not piece:
                return


def _unpacker(raw: BufferedReader) -> BufferedIOBase:
    head = raw.read(6)
    raw.seek(0)
    if head.startswith(_GZIP):
        return gzip.GzipFile(fileobj=raw)
    return lzma.LZMAFile(raw) if head == _XZ else raw

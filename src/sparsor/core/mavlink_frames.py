"""A byte stream cut into MAVLink 1 and 2 frames, without decoding what is in them.

The frame layouts are those of https://mavlink.io/en/guide/serialization.html; the checksum is CRC-16/MCRF4XX
over everything after the first byte, plus one byte that the dialect gives every message (CRC_EXTRA).
"""

from __future__ import annotations

import binascii
from dataclasses import dataclass
from functools import cache
from typing import Final

MAGIC_V1: Final = 0xFE
MAGIC_V2: Final = 0xFD
HEADER_V1: Final = 6
HEADER_V2: Final = 10
CHECKSUM: Final = 2
SIGNATURE: Final = 13
SIGNED: Final = 0x01  # MAVLINK_IFLAG_SIGNED, the one incompatibility flag that exists
LONGEST: Final = HEADER_V2 + 255 + CHECKSUM + SIGNATURE
_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


@dataclass(frozen=True)
class Frame:
    """One frame as it was on the wire.

    Parameters
    ----------
    raw : bytes
        All of it: header, payload, checksum, signature.
    """

    raw: bytes

    @property
    def version(self) -> int:
        """MAVLink 1 or 2."""
        return 1 if self.raw[0] == MAGIC_V1 else 2

    @property
    def sequence(self) -> int:
        """The sender's frame counter, 0..255."""
        return self.raw[2] if self.version == 1 else self.raw[4]

    @property
    def system_id(self) -> int:
        """Which vehicle or ground station sent it."""
        return self.raw[3] if self.version == 1 else self.raw[5]

    @property
    def component_id(self) -> int:
        """Which part of the system sent it."""
        return self.raw[4] if self.version == 1 else self.raw[6]

    @property
    def message_id(self) -> int:
        """Which message it carries."""
        return self.raw[5] if self.version == 1 else int.from_bytes(self.raw[7:10], "little")

    @property
    def payload(self) -> bytes:
        """The message's fields as sent; MAVLink 2 leaves out zeros at the end."""
        header = HEADER_V1 if self.version == 1 else HEADER_V2
        return self.raw[header : header + self.raw[1]]

    @property
    def signed(self) -> bool:
        """Whether a signature follows the checksum."""
        return self.version == 2 and bool(self.raw[2] & SIGNED)


class FrameReader:
    """Takes bytes as they come and gives back the whole frames in them.

    What comes out does not depend on how the stream was cut into pieces. A frame with a wrong checksum, or with
    an incompatibility flag that nobody knows, is passed over byte by byte, so that a true frame inside what
    looked like one is found. The checksum of a message that the dialect lacks cannot be verified; such a frame
    is taken when it lies between frames without a gap: right behind a good one, and the next one begins
    right behind it, or nothing does (`flush`).

    This is for live links. The compiled scanner (`mavlink_scan`) is faster on files, but its compiler takes about a
    second to load and five the first time, during which a link would not be read; here a frame takes some 6
    microseconds, which is far more frames than any link carries. Constants and checksum are those of this module.

    Attributes
    ----------
    skipped : int
        Bytes that belonged to no frame.

    Examples
    --------
    >>> reader = FrameReader()
    >>> beat = bytes.fromhex("fd0900000001010000000000000002030003034f5b")
    >>> [frame.message_id for frame in reader.feed(b"noise" + beat[:7])], reader.skipped
    ([], 5)
    >>> [frame.raw == beat for frame in reader.feed(beat[7:])]
    [True]
    """

    def __init__(self) -> None:
        self.skipped = 0
        self._buffer = bytearray()
        self._in_step = False  # whether the byte before belonged to a frame

    def feed(self, data: bytes) -> list[Frame]:
        """Take more of the stream; return the frames that are complete now."""
        self._buffer += data
        return self._frames(ended=False)

    def flush(self) -> list[Frame]:
        """Say that nothing follows; return what can still be read and forget the rest."""
        frames = self._frames(ended=True)
        self.skipped += len(self._buffer)
        self._buffer.clear()
        return frames

    def _frames(self, *, ended: bool) -> list[Frame]:
        found: list[Frame] = []
        buffer, at = self._buffer, 0
        while at < len(buffer):
            length = _frame_length(buffer, at, in_step=self._in_step, ended=ended)
            if length is None:
                break
            self._in_step = length > 0
            if length == 0:
                at += 1
                self.skipped += 1
                continue
            found.append(Frame(bytes(buffer[at : at + length])))
            at += length
        del buffer[:at]
        return found


def checksum(data: bytes, start: int = 0xFFFF) -> int:
    """Return CRC-16/MCRF4XX.

    Python's own CRC-CCITT runs over the bits in the other direction, so bytes and result are reversed.

    Parameters
    ----------
    data : bytes
    start : int
        The checksum of what comes before, 0..65535.

    Examples
    --------
    >>> hex(checksum(b"123456789"))
    '0x6f91'
    """
    return _mirrored(binascii.crc_hqx(data.translate(_REVERSED), _mirrored(start)))


def _mirrored(crc: int) -> int:
    return _REVERSED[crc & 0xFF] << 8 | _REVERSED[crc >> 8]


@cache
def checksum_extras() -> dict[int, int]:
    """Return message id to CRC_EXTRA, of the ardupilotmega dialect (which holds the common one)."""
    from pymavlink.dialects.v20 import ardupilotmega

    return {number: int(kind.crc_extra) for number, kind in ardupilotmega.mavlink_map.items()}


def _frame_length(buffer: bytearray, at: int, *, in_step: bool, ended: bool) -> int | None:
    """Return how long the frame at a place is: 0 when there is none, None when more bytes have to tell."""
    magic = buffer[at]
    if magic not in (MAGIC_V1, MAGIC_V2):
        return 0
    header = HEADER_V1 if magic == MAGIC_V1 else HEADER_V2
    if len(buffer) < at + header:
        return 0 if ended else None
    flags = buffer[at + 2] if magic == MAGIC_V2 else 0
    if flags & ~SIGNED:
        return 0
    unsigned = header + buffer[at + 1] + CHECKSUM
    length = unsigned + (SIGNATURE if flags else 0)
    if len(buffer) < at + length:
        return 0 if ended else None
    body = bytes(buffer[at + 1 : at + unsigned])
    number = body[4] if magic == MAGIC_V1 else int.from_bytes(body[6:9], "little")
    extra = checksum_extras().get(number)
    if extra is not None:
        right = checksum(body[:-CHECKSUM] + bytes([extra])) == int.from_bytes(body[-CHECKSUM:], "little")
        return length if right else 0
    if not in_step:
        return 0
    if len(buffer) == at + length:
        return length if ended else None
    return length if buffer[at + length] in (MAGIC_V1, MAGIC_V2) else 0

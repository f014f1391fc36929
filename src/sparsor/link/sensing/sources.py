"""Where a sensor's lines come from while it measures: a serial port, or standard input."""

from __future__ import annotations

import queue
import threading
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from sparsor.errors import InputError, LinkError, LinkFailureError
from sparsor.link.ports.addresses import Address, parse_address
from sparsor.link.ports.serialport import SerialEndpoint
from sparsor.link.sensing.backoff import Backoff
from sparsor.link.sensing.clock import SensorClock
from sparsor.link.sensing.lines import TICK_S, Line, nothing_for
from sparsor.link.sensing.readings import read_line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import TextIO

    from sparsor.link.sensing.readings import LineFormat

SENSOR_BAUD: Final = 9600  # of most gas sensors; telemetry radios are faster
LONGEST_LINE: Final = 4096


class SensorPort:
    """A sensor on a serial port; opened again when it was unplugged.

    Parameters
    ----------
    device : str
        As in an address of a link, with or without a baud rate: `/dev/ttyUSB1`, `COM4:115200`.
    form : LineFormat
    say : callable
        Told that the port is gone, and that it is back.

    Raises
    ------
    InputError
        When columns are named.
    LinkError
        When it is no device, or cannot be opened in the beginning.
    """

    live, waits = True, False

    def __init__(self, device: str, form: LineFormat, say: Callable[[str], None]) -> None:
        self.address = sensor_address(device)
        if form.needs_header:
            raise InputError("a serial line has no first line with names; give the columns' numbers, from 1")
        self._form, self._say = form, say
        self._clock = SensorClock()
        self._port: SerialEndpoint | None = SerialEndpoint(self.address)

    def lines(self) -> Iterator[Line | None]:
        """Yield lines until the iterator is closed."""
        backoff = Backoff()
        try:
            while True:
                try:
                    self._port = self._port or SerialEndpoint(self.address)
                    if backoff.tried:
                        self._say(f"{self.address.place} is back")
                    backoff = Backoff()
                    yield from self._while_open(self._port)
                except (LinkError, LinkFailureError) as error:
                    if not backoff.tried:
                        self._say(f"{error} (trying again)")
                    self._close()
                    yield from nothing_for(backoff.next_s())
        finally:
            self._close()

    def _while_open(self, port: SerialEndpoint) -> Iterator[Line | None]:
        waiting, whole = b"", False
        while True:
            data = port.receive(TICK_S)
            arrived_s = time.monotonic()
            *texts, waiting = (waiting + data).replace(b"\r", b"\n").split(b"\n")
            if texts and not whole:  # the port was opened in the middle of a line: half a number is a wrong number
                whole, texts = True, texts[1:]
            waiting = waiting[:LONGEST_LINE]
            for text in texts:
                if text.strip():
                    yield _live_line(text.decode("ascii", "replace"), self._form, self._clock, arrived_s)
            yield None

    def _close(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            port.close()


class PipedLines:
    """Standard input, or any text stream; ends where that ends.

    Parameters
    ----------
    stream : TextIO
    form : LineFormat
    """

    live = waits = True

    def __init__(self, stream: TextIO, form: LineFormat) -> None:
        self._form = form
        self._clock = SensorClock()
        self._queue: queue.SimpleQueue[tuple[str, float] | None] = queue.SimpleQueue()
        # A thread, because not every system can wait for a pipe with a timeout; it ends with the stream.
        threading.Thread(target=self._take, args=(stream,), name="sensor input", daemon=True).start()

    def lines(self) -> Iterator[Line | None]:
        """Yield lines until the stream ends."""
        while True:
            try:
                came = self._queue.get(timeout=TICK_S)
            except queue.Empty:
                yield None
                continue
            if came is None:
                return
            text, arrived_s = came
            yield _live_line(text, self._form, self._clock, arrived_s)

    def _take(self, stream: TextIO) -> None:
        try:
            for text in stream:
                if text.strip():
                    self._queue.put((text.strip(), time.monotonic()))
        except (OSError, ValueError):  # closed under our hands
            pass
        self._queue.put(None)


def sensor_address(device: str) -> Address:
    """Return the port and baud of a sensor, 9600 when no baud is given; LinkError when it is no device."""
    address = parse_address(f"serial:{device.strip()}")
    given = device.strip().lower().endswith((f":{address.number}", f",{address.number}"))
    return address if given else replace(address, number=SENSOR_BAUD)


def _live_line(text: str, form: LineFormat, clock: SensorClock, arrived_s: float) -> Line | None:
    reading = read_line(form, text)
    return None if reading is None else Line(text, reading, clock.ours(reading.time_s, arrived_s))

"""Serial links."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Final

from sparsor.errors import LinkError, LinkFailureError

if TYPE_CHECKING:
    from sparsor.link.ports.addresses import Address

WRITE_TIMEOUT_S: Final = 2.0


class SerialEndpoint:
    """A serial port, by pyserial."""

    def __init__(self, address: Address) -> None:
        try:
            serial = importlib.import_module("serial")
        except ImportError as error:
            raise LinkError(
                f"'{address.url}' needs the package pyserial, which is not installed: pip install pyserial"
            ) from error
        try:
            self._port = serial.Serial(
                address.place, address.number, timeout=0.1, write_timeout=WRITE_TIMEOUT_S, exclusive=True
            )
        except (OSError, ValueError) as error:  # SerialException is an OSError
            raise LinkError(
                f"cannot open {address.url}: {error}. Is it plugged in, may you use it, and is no other program on it?"
            ) from error

    def receive(self, timeout_s: float) -> bytes:
        """Return what has come."""
        try:
            self._port.timeout = timeout_s
            first: bytes = self._port.read(1)
            waiting = self._port.in_waiting if first else 0
            return first + bytes(self._port.read(waiting)) if waiting else first
        except OSError as error:
            raise LinkFailureError(f"the serial port is gone: {error}") from error

    def send(self, data: bytes) -> None:
        """Send all of it."""
        try:
            self._port.write(data)
        except OSError as error:
            raise LinkFailureError(f"the serial port is gone: {error}") from error

    def close(self) -> None:
        """Close the port."""
        self._port.close()

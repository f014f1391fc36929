"""A sensor's lines out as NAMED_VALUE_FLOAT, counted: what went out, what could not be read, what was lost."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from sparsor.errors import InputError, LinkFailureError

if TYPE_CHECKING:
    from collections.abc import Callable

    from sparsor.link.sensing.lines import Line, Source
    from sparsor.link.sensing.outlet import Outlet

SILENT_S: Final = 10.0
WAIT_S: Final = 0.05


@dataclass
class Sent:
    """What became of a sensor's values.

    Parameters
    ----------
    sent : int
        Values that went out while the vehicle was heard.
    skipped : int
        Lines and values that could not be read.
    first_skipped : str or None
        The first of them, and why.
    lost : int
        Values that came while the link was down; a value that is sent late would lie in the wrong place.
    left_out : int
        Values beyond the rate that was asked for.
    names : dict of str to int
        Values sent under each name.
    seconds : float
    """

    sent: int = 0
    skipped: int = 0
    first_skipped: str | None = None
    lost: int = 0
    left_out: int = 0
    names: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0


def send_samples(
    source: Source,
    outlet: Outlet,
    *,
    rate_hz: float | None = None,
    timeout_s: float = 10.0,
    say: Callable[[str], None] = lambda _: None,
) -> Sent:
    """Send a sensor's values until its lines end or Ctrl-C.

    `time_boot_ms` is what the field says, the time since this computer was started (`time.monotonic`), which only
    goes forward and goes on when the program is started again: the moment at which a line came, or the sensor's
    own time brought onto that clock (`SensorClock`). It is not the vehicle's clock. What standard input says while
    the vehicle is looked for in the beginning is sent when it is found, with the time at which it came.

    Parameters
    ----------
    source : Source
    outlet : Outlet
    rate_hz : float, optional
        At most so many values of each name a second; the others are left out.
    timeout_s : float
        How long a recorded file waits for the vehicle, and standard input before values count as lost.
    say : callable
        Told that the sensor is silent, and that it is back.

    Raises
    ------
    InputError
        When there are several vehicles and none was chosen, or no line at all could be read.
    LinkFailureError
        When no vehicle is there to replay a file to, or nothing could be sent.
    """
    tally = _Tally(outlet, rate_hz)
    try:
        if source.waits:
            _wait_for_vehicle(outlet, timeout_s, needed=not source.live)
        heard_s, silent = time.monotonic(), False
        for line in source.lines():
            outlet.check()
            outlet.beat()
            if line is None:
                if source.live and not silent and time.monotonic() - heard_s > SILENT_S:
                    silent = True
                    say(f"the sensor has been silent for {SILENT_S:g} s")
                continue
            if silent:
                say("the sensor is back")
            heard_s, silent = time.monotonic(), False
            tally.take(line)
    except KeyboardInterrupt:
        return tally.result()
    result = tally.result()
    if result.sent == 0:
        raise _nothing_sent(result)
    return result


class _Tally:
    def __init__(self, outlet: Outlet, rate_hz: float | None) -> None:
        from pymavlink.dialects.v20 import ardupilotmega as mavlink

        self._message = mavlink.MAVLink_named_value_float_message
        self._outlet = outlet
        self._interval_s = 1 / rate_hz if rate_hz else 0.0
        self._next_s: dict[str, float] = {}
        self._begun_s = time.monotonic()
        self._sent = Sent()

    def take(self, line: Line) -> None:
        """Send a line's values and count them."""
        count = self._sent
        if line.reading.faults:
            count.skipped += len(line.reading.faults)
            count.first_skipped = count.first_skipped or f"'{line.text[:80]}' ({line.reading.faults[0]})"
        boot_ms = round(line.time_s * 1000) & 0xFFFFFFFF
        for name, value in line.reading.values:
            if not self._is_due(name, line.time_s):
                count.left_out += 1
            elif self._outlet.send(self._message(boot_ms, name.encode(), value)):
                count.sent += 1
                count.names[name] = count.names.get(name, 0) + 1
            else:
                count.lost += 1

    def result(self) -> Sent:
        """Return the counts until now."""
        self._sent.seconds = time.monotonic() - self._begun_s
        return self._sent

    def _is_due(self, name: str, time_s: float) -> bool:
        if not self._interval_s:
            return True
        due_s = self._next_s.get(name, time_s)
        if due_s - self._interval_s <= time_s < due_s:
            return False
        self._next_s[name] = (due_s if time_s - due_s < self._interval_s else time_s) + self._interval_s
        return True


def _wait_for_vehicle(outlet: Outlet, timeout_s: float, *, needed: bool) -> None:
    deadline_s = time.monotonic() + timeout_s
    while not outlet.is_up:
        outlet.check()
        outlet.beat()
        if time.monotonic() > deadline_s:
            if needed:
                raise LinkFailureError(f"no vehicle was heard within {timeout_s:g} s; nothing was sent")
            return
        time.sleep(WAIT_S)


def _nothing_sent(result: Sent) -> InputError | LinkFailureError:
    if result.lost:
        return LinkFailureError(f"nothing was sent: the link was down for all {result.lost} values")
    if result.skipped:
        return InputError(f"nothing was sent: no line could be read, the first was {result.first_skipped}")
    return LinkFailureError("nothing was sent: the sensor's lines ended before the first")

"""The parameters of the practice autopilot and their protocol."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.exchange import Message, Outgoing, Peer, status_text
from sparsor.link.practice.storage import FENCE, MISSION, RALLY

if TYPE_CHECKING:
    from sparsor.link.practice.flavour import Flavour
    from sparsor.link.practice.transfer import MissionStore

COUNTS = {"MIS_TOTAL": MISSION, "FENCE_TOTAL": FENCE, "RALLY_TOTAL": RALLY}


class Parameters:
    """A small set of real parameters.

    ArduPilot sends every value as a float; PX4 puts the bits of an integer into the float field, which
    MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE says.

    Parameters
    ----------
    flavour : Flavour
    store : MissionStore
        What MIS_TOTAL, FENCE_TOTAL and RALLY_TOTAL count.
    system : int
        The vehicle's system id.
    """

    def __init__(self, flavour: Flavour, store: MissionStore, system: int) -> None:
        self._bytewise = flavour.is_px4
        self._store = store
        self._types = {name: kind for name, _, kind in flavour.parameters}
        self._values = {name: float(value) for name, value, _ in flavour.parameters}
        for name in {"SYSID_THISMAV", "MAV_SYS_ID"} & set(self._values):
            self._values[name] = float(system)

    def __getitem__(self, name: str) -> float:
        """Return a value."""
        if name in COUNTS:
            return float(len(self._store.items[COUNTS[name]]))
        return self._values[name]

    def get(self, name: str, default: float) -> float:
        """Return a value, or `default` where this flavour has no such parameter."""
        return self[name] if name in self._values else default

    def set(self, name: str, value: float) -> None:
        """Change a value, as the vehicle itself does; KeyError where this flavour has no such parameter."""
        if name not in self._values:
            raise KeyError(name)
        self._values[name] = value

    def receive(self, message: Message, peer: Peer) -> list[Outgoing]:
        """Return the answers to PARAM_REQUEST_LIST, PARAM_REQUEST_READ and PARAM_SET."""
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            return [self._value(name, peer) for name in self._values]
        if kind == "PARAM_REQUEST_READ":
            names = list(self._values)
            named = message.param_index < 0
            name = _text(message.param_id) if named else dict(enumerate(names)).get(message.param_index, "")
            return [self._value(name, peer)] if name in self._values else []
        return self._set(message, peer)

    def _set(self, message: Message, peer: Peer) -> list[Outgoing]:
        name = _text(message.param_id)
        if name not in self._values:
            return []  # both autopilots stay silent
        value = self._decoded(message.param_value, self._types[name])
        if not math.isfinite(value):
            return [self._value(name, peer)]
        if name in COUNTS:
            return [status_text(f"{name} is read-only", mavlink.MAV_SEVERITY_WARNING), self._value(name, peer)]
        self._values[name] = value if self._types[name] == mavlink.MAV_PARAM_TYPE_REAL32 else float(round(value))
        # A change is told to everybody on the link.
        return [Outgoing(self._value(name, peer).message)]

    def _value(self, name: str, peer: Peer) -> Outgoing:
        names, kind = list(self._values), self._types[name]
        value = self._encoded(self[name], kind)
        message = mavlink.MAVLink_param_value_message(name.encode(), value, kind, len(names), names.index(name))
        return Outgoing(message, peer.link)

    def _encoded(self, value: float, kind: int) -> float:
        if self._bytewise and kind != mavlink.MAV_PARAM_TYPE_REAL32:
            return float(struct.unpack("<f", struct.pack("<i", round(value)))[0])
        return value

    def _decoded(self, value: float, kind: int) -> float:
        if self._bytewise and kind != mavlink.MAV_PARAM_TYPE_REAL32:
            return float(struct.unpack("<i", struct.pack("<f", value))[0])
        return float(value)


def _text(param_id: str | bytes) -> str:
    text = param_id.decode("ascii", "replace") if isinstance(param_id, bytes) else param_id
    return text.partition("\0")[0]

"""The mission protocol, as far as both flavours share it.

A transfer is a pure state machine: messages and the time go in, messages come out, nothing sleeps and nothing
knows of sockets. Times are seconds of the wall clock, also when the flight is sped up: clients' timeouts are.
Source: https://mavlink.io/en/services/mission.html and the sources of both autopilots.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.exchange import Message, Outgoing, Peer
from sparsor.link.practice.storage import FENCE, KINDS, MISSION, RALLY, StoredItem

if TYPE_CHECKING:
    from sparsor.vehicle import Autopilot

ITEM_MESSAGES = frozenset({"MISSION_ITEM", "MISSION_ITEM_INT"})
REQUEST_MESSAGES = frozenset({"MISSION_REQUEST", "MISSION_REQUEST_INT"})
ALL = mavlink.MAV_MISSION_TYPE_ALL


@dataclass
class MissionStore:
    """Mission, fence and rally points on the vehicle.

    Parameters
    ----------
    limits : Autopilot
        How many of each fit.
    home : StoredItem
        Where the vehicle is at home; item 0 of ArduPilot's missions.
    """

    limits: Autopilot
    home: StoredItem
    items: dict[int, list[StoredItem]] = field(default_factory=lambda: {kind: [] for kind in KINDS})
    changes: dict[int, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    """How often each kind was replaced or cleared."""
    first: int = 0
    """Item to begin with, as the last upload marked it (PX4)."""
    current: int = 0
    """Item of the mission that is flown or comes next."""

    def most(self, kind: int) -> int:
        """Return how many items of a kind fit; none of a kind that there is not."""
        limits = self.limits
        most = {MISSION: limits.max_items, FENCE: limits.max_fence_points, RALLY: limits.max_rally_points}
        return most.get(kind, 0)

    def item(self, kind: int, seq: int) -> StoredItem | None:
        """Return one item as it is read back, None where there is none; ArduPilot's home is always there."""
        if kind == MISSION and seq == 0 and self.limits.home_is_item_0:
            return self.home
        items = self.items[kind]
        return items[seq] if seq < len(items) else None

    def replace(self, kind: int, items: list[StoredItem]) -> None:
        """Put other items in the place of those of a kind."""
        self.items[kind] = items
        self.changes[kind] += 1


class Transfers(Protocol):
    """The vehicle's side of the mission protocol."""

    @property
    def busy(self) -> bool:
        """Whether an upload is under way."""

    def receive(self, message: Message, peer: Peer, now_s: float) -> list[Outgoing]:
        """Return the answers to a message that is meant for this vehicle."""

    def advance(self, now_s: float) -> list[Outgoing]:
        """Return what time alone makes the vehicle send: repeated requests, and giving up."""


def ack(peer: Peer, result: int, kind: int) -> Outgoing:
    """Return MISSION_ACK with a MAV_MISSION_RESULT."""
    return Outgoing(mavlink.MAVLink_mission_ack_message(peer.system, peer.component, result, kind), peer.link)


def count(peer: Peer, items: int, kind: int) -> Outgoing:
    """Return MISSION_COUNT."""
    return Outgoing(mavlink.MAVLink_mission_count_message(peer.system, peer.component, items, kind), peer.link)


def item_out(peer: Peer, seq: int, kind: int, item: StoredItem, *, integers: bool, current: bool = False) -> Outgoing:
    """Return MISSION_ITEM_INT, or MISSION_ITEM for who asked with the old MISSION_REQUEST.

    The frame is the stored one.
    """
    target = (peer.system, peer.component)
    if integers:
        place: tuple[float, float] = (item.x, item.y)
        make = mavlink.MAVLink_mission_item_int_message
    else:
        scale = 1.0 if item.frame == mavlink.MAV_FRAME_MISSION else 1e-7
        place = (item.x * scale, item.y * scale)
        make = mavlink.MAVLink_mission_item_message
    flags = (int(current), item.autocontinue)
    message = make(*target, seq, item.frame, item.command, *flags, *item.params, *place, item.z, kind)
    return Outgoing(message, peer.link)

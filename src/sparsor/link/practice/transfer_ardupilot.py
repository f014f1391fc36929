"""ArduPilot's side of the mission protocol: each kind apart, missions overwritten in place.

It acks an item other than the one it asked for with MAV_MISSION_INVALID_SEQUENCE and goes on waiting; it asks
with the old MISSION_REQUEST and takes integers. Source: ArduPilot's MissionItemProtocol.cpp.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.exchange import Message, Outgoing, Peer, same_sender, status_text
from sparsor.link.practice.storage import FENCE, KINDS, MISSION, RALLY, StoredItem, fence_is_whole, item_in, judge
from sparsor.link.practice.transfer import ALL, ITEM_MESSAGES, REQUEST_MESSAGES, MissionStore, ack, count, item_out

if TYPE_CHECKING:
    from sparsor.link.practice.flavour import Flavour

TITLES = {MISSION: "Flight plan", FENCE: "Fence", RALLY: "Rally points"}


@dataclass
class _Upload:
    """An upload that is under way."""

    peer: Peer
    total: int
    wanted: int
    received_s: float
    requested_s: float
    pending: list[StoredItem] | None
    """Fences are kept aside until they are whole; missions and rally points are not."""


class ArduPilotTransfers:
    """Mission protocol of the ArduPilot flavour; see `sparsor.link.practice.transfer.Transfers`."""

    def __init__(self, flavour: Flavour, store: MissionStore) -> None:
        self._flavour = flavour
        self._store = store
        self._uploads: dict[int, _Upload] = {}

    @property
    def busy(self) -> bool:
        """Whether an upload is under way."""
        return bool(self._uploads)

    def receive(self, message: Message, peer: Peer, now_s: float) -> list[Outgoing]:
        """Return the answers to a message that is meant for this vehicle."""
        name, kind = message.get_type(), getattr(message, "mission_type", MISSION)
        if name == "MISSION_CLEAR_ALL":
            return self._clear(peer, kind)
        if name == "MISSION_ACK":
            return []
        if kind not in KINDS:
            return [ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        if name == "MISSION_COUNT":
            return self._begin(message.count, kind, peer, now_s)
        if name in ITEM_MESSAGES:
            return self._take(message, kind, peer, now_s)
        if name in REQUEST_MESSAGES or name == "MISSION_REQUEST_LIST":
            return self._give(message, kind, peer)
        return []

    def advance(self, now_s: float) -> list[Outgoing]:
        """Repeat requests after a second; give up after eight without an item."""
        out: list[Outgoing] = []
        for kind, upload in list(self._uploads.items()):
            if now_s - upload.received_s > self._flavour.give_up_s:
                del self._uploads[kind]
                out += [
                    status_text("Mission upload timeout", mavlink.MAV_SEVERITY_WARNING),
                    ack(upload.peer, mavlink.MAV_MISSION_OPERATION_CANCELLED, kind),
                ]
            elif now_s - upload.requested_s > self._flavour.retry_s:
                out.append(self._request(kind, upload, now_s))
        return out

    def _clear(self, peer: Peer, kind: int) -> list[Outgoing]:
        kinds = KINDS if kind == ALL else (kind,)
        if not set(kinds) <= set(KINDS):
            return [ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        if any(one in self._uploads for one in kinds):
            return [ack(peer, mavlink.MAV_MISSION_ERROR, kind)]
        for one in kinds:
            self._store.replace(one, [])
        return [ack(peer, mavlink.MAV_MISSION_ACCEPTED, kind)]

    def _begin(self, total: int, kind: int, peer: Peer, now_s: float) -> list[Outgoing]:
        running = self._uploads.get(kind)
        if running and not same_sender(running.peer, peer):
            return [ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        most = self._store.most(kind)
        if total > most:
            text = f"Only {most} items are supported"
            return [ack(peer, mavlink.MAV_MISSION_NO_SPACE, kind), status_text(text, mavlink.MAV_SEVERITY_WARNING)]
        self._uploads.pop(kind, None)
        if total == 0:
            self._store.replace(kind, [])
            return [ack(peer, mavlink.MAV_MISSION_ACCEPTED, kind)]
        if kind != FENCE:
            self._store.replace(kind, self._store.items[kind][:total])
        upload = _Upload(peer, total, 0, now_s, now_s, [] if kind == FENCE else None)
        self._uploads[kind] = upload
        return [self._request(kind, upload, now_s)]

    def _take(self, message: Message, kind: int, peer: Peer, now_s: float) -> list[Outgoing]:
        upload = self._uploads.get(kind)
        if upload is None:
            return [ack(peer, mavlink.MAV_MISSION_ERROR, kind)]
        if message.seq != upload.wanted:
            return [ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, kind)]
        if not same_sender(upload.peer, peer):
            return [ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        result, item = judge(item_in(message), kind, px4=False)
        if item is None:
            del self._uploads[kind]
            return [ack(peer, result, kind)]
        self._put(upload, kind, item)
        upload.wanted += 1
        upload.received_s = now_s
        if upload.wanted < upload.total:
            return [self._request(kind, upload, now_s)]
        del self._uploads[kind]
        return self._complete(upload, kind, peer)

    def _put(self, upload: _Upload, kind: int, item: StoredItem) -> None:
        items = self._store.items[kind] if upload.pending is None else upload.pending
        items[upload.wanted : upload.wanted + 1] = [item]

    def _complete(self, upload: _Upload, kind: int, peer: Peer) -> list[Outgoing]:
        if upload.pending is not None:
            if not fence_is_whole(upload.pending):
                return [ack(peer, mavlink.MAV_MISSION_ERROR, kind)]
            self._store.replace(kind, upload.pending)
        else:
            self._store.changes[kind] += 1
        return [ack(peer, mavlink.MAV_MISSION_ACCEPTED, kind), status_text(f"{TITLES[kind]} received")]

    def _request(self, kind: int, upload: _Upload, now_s: float) -> Outgoing:
        upload.requested_s = now_s
        peer = upload.peer
        message = mavlink.MAVLink_mission_request_message(peer.system, peer.component, upload.wanted, kind)
        return Outgoing(message, peer.link)

    def _give(self, message: Message, kind: int, peer: Peer) -> list[Outgoing]:
        if kind in self._uploads:
            return [ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        items = self._store.read(kind)
        if message.get_type() == "MISSION_REQUEST_LIST":
            return [count(peer, len(items), kind)]
        if message.seq >= len(items):
            return [ack(peer, mavlink.MAV_MISSION_ERROR, kind)]
        integers = message.get_type() == "MISSION_REQUEST_INT"
        return [item_out(peer, message.seq, kind, items[message.seq], integers=integers, px4=False)]

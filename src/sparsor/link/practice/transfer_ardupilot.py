"""ArduPilot's side of the mission protocol: each kind apart, missions overwritten in place.

It acks an item other than the one it asked for with MAV_MISSION_INVALID_SEQUENCE and goes on waiting; it asks
with the old MISSION_REQUEST and takes integers. MISSION_WRITE_PARTIAL_LIST replaces some items; for parts of a
download it has nothing (MISSION_REQUEST_PARTIAL_LIST). Source: ArduPilot's MissionItemProtocol.cpp, _Waypoints,
_Fence and _Rally, and GCS_Common.cpp (handle_mission_item), as of 2025.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.exchange import Message, Outgoing, Peer, same_sender, status_text
from sparsor.link.practice.items_ardupilot import fence_fault, judge
from sparsor.link.practice.storage import FENCE, KINDS, MISSION, RALLY, StoredItem, item_in
from sparsor.link.practice.transfer import ALL, ITEM_MESSAGES, REQUEST_MESSAGES, MissionStore, ack, count, item_out

if TYPE_CHECKING:
    from sparsor.link.practice.flavour import Flavour

OTHER_MESSAGES = frozenset({"MISSION_COUNT", "MISSION_CLEAR_ALL", "MISSION_REQUEST_LIST", "MISSION_WRITE_PARTIAL_LIST"})
DO_JUMP = 177
RECEIVED = {MISSION: "Flight plan received", RALLY: "Rally points received"}
TITLES = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally"}


@dataclass
class _Upload:
    """An upload that is under way."""

    peer: Peer
    wanted: int
    last: int
    room: int
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
        known = name in ITEM_MESSAGES | REQUEST_MESSAGES | OTHER_MESSAGES
        if known and kind not in KINDS and (name, kind) != ("MISSION_CLEAR_ALL", ALL):
            return [ack(peer, mavlink.MAV_MISSION_UNSUPPORTED, kind)]
        if name == "MISSION_CLEAR_ALL":
            return self._clear(peer, kind)
        if name == "MISSION_COUNT":
            return self._begin(message.count, kind, peer, now_s)
        if name == "MISSION_WRITE_PARTIAL_LIST":
            return self._begin_partial(message, kind, peer, now_s)
        if name in ITEM_MESSAGES:
            return self._take(message, kind, peer, now_s)
        if name == "MISSION_REQUEST_LIST":
            return self._list(kind, peer)
        return self._give(message, kind, peer) if name in REQUEST_MESSAGES else []

    def advance(self, now_s: float) -> list[Outgoing]:
        """Repeat requests after a second; give up after eight without an item."""
        out: list[Outgoing] = []
        for kind, upload in list(self._uploads.items()):
            if now_s - upload.received_s > self._flavour.give_up_s:
                del self._uploads[kind]
                out += [
                    _warning(f"{TITLES[kind]} upload timeout"),
                    ack(upload.peer, mavlink.MAV_MISSION_OPERATION_CANCELLED, kind),
                ]
            elif now_s - upload.requested_s > self._flavour.retry_s:
                out.append(self._request(kind, upload, now_s))
        return out

    def _clear(self, peer: Peer, kind: int) -> list[Outgoing]:
        out = []
        for one in KINDS if kind == ALL else (kind,):
            if self._held_by_another(one, peer):
                out.append(ack(peer, mavlink.MAV_MISSION_DENIED, one))
                continue
            self._uploads.pop(one, None)
            self._store.replace(one, [])
        return [*out, ack(peer, mavlink.MAV_MISSION_ERROR if out else mavlink.MAV_MISSION_ACCEPTED, kind)]

    def _begin(self, total: int, kind: int, peer: Peer, now_s: float) -> list[Outgoing]:
        if self._held_by_another(kind, peer):
            return [ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        self._uploads.pop(kind, None)
        most = self._store.most(kind)
        if total > most:
            return [ack(peer, mavlink.MAV_MISSION_NO_SPACE, kind), _warning(f"Only {most} items are supported")]
        if kind != FENCE:
            self._store.replace(kind, self._store.items[kind][:total])
        room, pending = (total, list[StoredItem]()) if kind == FENCE else (most, None)
        upload = _Upload(peer, 0, total - 1, room, now_s, now_s, pending)
        if total == 0:
            return self._complete(upload, kind, peer)
        self._uploads[kind] = upload
        return [self._request(kind, upload, now_s)]

    def _begin_partial(self, message: Message, kind: int, peer: Peer, now_s: float) -> list[Outgoing]:
        if kind in self._uploads:
            return [ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        items, first, last = self._store.items[kind], message.start_index, message.end_index
        if not 0 <= first <= last <= len(items):
            return [_warning("Flight plan update rejected"), ack(peer, mavlink.MAV_MISSION_ERROR, kind)]
        room, pending = (len(items), list(items)) if kind == FENCE else (self._store.most(kind), None)
        upload = _Upload(peer, first, last, room, now_s, now_s, pending)
        self._uploads[kind] = upload
        return [self._request(kind, upload, now_s)]

    def _held_by_another(self, kind: int, peer: Peer) -> bool:
        return kind in self._uploads and not same_sender(self._uploads[kind].peer, peer)

    def _take(self, message: Message, kind: int, peer: Peer, now_s: float) -> list[Outgoing]:
        upload = self._uploads.get(kind)
        if upload is None:
            return [ack(peer, mavlink.MAV_MISSION_ERROR, kind)]
        if message.seq != upload.wanted:
            return [ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, kind)]
        if not same_sender(upload.peer, peer):
            return [ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        result = self._keep(upload, kind, item_in(message))
        if result != mavlink.MAV_MISSION_ACCEPTED:
            del self._uploads[kind]
            return [ack(peer, result, kind)]
        upload.wanted += 1
        upload.received_s = now_s
        if upload.wanted <= upload.last:
            return [self._request(kind, upload, now_s)]
        del self._uploads[kind]
        return self._complete(upload, kind, peer)

    def _keep(self, upload: _Upload, kind: int, sent: StoredItem) -> int:
        """Put an item in its place; returns a MAV_MISSION_RESULT."""
        result, item = judge(sent, kind)
        if item is None:
            return result
        items = self._store.items[kind] if upload.pending is None else upload.pending
        if kind == MISSION and item.command == DO_JUMP:
            target = int(item.params[0])
            if target <= 0 or target >= max(len(items), upload.last + 1):
                return int(mavlink.MAV_MISSION_ERROR)
        if upload.wanted >= upload.room:
            return int(mavlink.MAV_MISSION_INVALID_SEQUENCE if kind == FENCE else mavlink.MAV_MISSION_ERROR)
        items[upload.wanted : upload.wanted + 1] = [item]
        return result

    def _complete(self, upload: _Upload, kind: int, peer: Peer) -> list[Outgoing]:
        if upload.pending is not None:
            fault = fence_fault(upload.pending)
            if fault is not None:
                failed = ack(peer, mavlink.MAV_MISSION_ERROR, kind)
                return [_warning(fault), _warning("Fence validation failed"), failed]
            self._store.replace(kind, upload.pending)
        else:
            self._store.changes[kind] += 1
        said = [status_text(RECEIVED[kind])] if kind in RECEIVED else []
        return [ack(peer, mavlink.MAV_MISSION_ACCEPTED, kind), *said]

    def _request(self, kind: int, upload: _Upload, now_s: float) -> Outgoing:
        upload.requested_s = now_s
        peer = upload.peer
        message = mavlink.MAVLink_mission_request_message(peer.system, peer.component, upload.wanted, kind)
        return Outgoing(message, peer.link)

    def _list(self, kind: int, peer: Peer) -> list[Outgoing]:
        if kind in self._uploads:
            return [ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        return [count(peer, len(self._store.items[kind]), kind)]

    def _give(self, message: Message, kind: int, peer: Peer) -> list[Outgoing]:
        integers = message.get_type() == "MISSION_REQUEST_INT"
        if integers and kind in self._uploads:
            return [ack(peer, mavlink.MAV_MISSION_DENIED, kind)]
        item = self._store.item(kind, message.seq)
        if item is not None:
            return [item_out(peer, message.seq, kind, item, integers=integers)]
        # It tells who asks for too much how much there is.
        told = [count(peer, len(self._store.items[kind]), kind)] if integers else []
        return [*told, ack(peer, mavlink.MAV_MISSION_INVALID_SEQUENCE, kind)]


def _warning(text: str) -> Outgoing:
    return status_text(text, mavlink.MAV_SEVERITY_WARNING)

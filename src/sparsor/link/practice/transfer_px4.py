"""PX4's side of the mission protocol: one transfer at a time for all kinds, put in place when it is whole.

Items other than the one it asked for are ignored; a download follows a list request and its order. It asks for
floats (MISSION_REQUEST) until a client sends or asks for integers, or acks with UNSUPPORTED. Lists in parts it does
not know. Source: PX4 v1.15 mavlink_mission.cpp. Not copied from it: that a list request may end an upload under way
and leave it busy, and that the item before the one a broken upload stopped at is acked as ACCEPTED.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from sparsor.link.practice.exchange import Message, Outgoing, Peer, same_sender, status_text
from sparsor.link.practice.fence import leaves_out
from sparsor.link.practice.items_px4 import judge
from sparsor.link.practice.place import FlatMap
from sparsor.link.practice.storage import FENCE, INT_FRAME, KINDS, MISSION, StoredItem, item_in
from sparsor.link.practice.transfer import ALL, ITEM_MESSAGES, REQUEST_MESSAGES, MissionStore, ack, count, item_out

if TYPE_CHECKING:
    from sparsor.link.practice.flavour import Flavour

GET, SEND = "get", "send"


@dataclass
class _Transfer:
    """The transfer that is under way, or the last one."""

    peer: Peer
    kind: int
    direction: str
    total: int
    received_s: float
    sent_s: float
    running: bool = True
    seq: int = 0
    first: int = 0
    items: list[StoredItem] = field(default_factory=list)


class Px4Transfers:
    """Mission protocol of the PX4 flavour; see `sparsor.link.practice.transfer.Transfers`."""

    def __init__(self, flavour: Flavour, store: MissionStore) -> None:
        self._flavour = flavour
        self._store = store
        self._last: _Transfer | None = None
        self._integer_links: set[int] = set()

    @property
    def busy(self) -> bool:
        """Whether an upload is under way."""
        running = self._running
        return running is not None and running.direction == GET

    @property
    def _running(self) -> _Transfer | None:
        return self._last if self._last is not None and self._last.running else None

    def receive(self, message: Message, peer: Peer, now_s: float) -> list[Outgoing]:
        """Return the answers to a message that is meant for this vehicle."""
        name, kind = message.get_type(), getattr(message, "mission_type", MISSION)
        if name in ITEM_MESSAGES | REQUEST_MESSAGES:
            self._speak(peer, integers=name.endswith("_INT"))
        if name == "MISSION_CLEAR_ALL":
            return self._clear(peer, kind)
        if name == "MISSION_COUNT":
            return self._begin(message.count, kind, peer, now_s)
        if name in ITEM_MESSAGES:
            return self._take(message, peer, now_s)
        if name == "MISSION_REQUEST_LIST":
            return self._list(kind, peer, now_s)
        if name in REQUEST_MESSAGES:
            return self._give(message, kind, peer, now_s)
        return self._acknowledged(message, peer, now_s) if name == "MISSION_ACK" else []

    def advance(self, now_s: float) -> list[Outgoing]:
        """Repeat requests after 0.25 s; give up after five seconds of silence, which PX4 says in words only."""
        now = self._running
        if now is None:
            return []
        if now_s - now.received_s > self._flavour.give_up_s:
            now.running = False
            return [_critical("Operation timeout")]
        if now.direction == GET and now_s - now.sent_s > self._flavour.retry_s:
            return [self._request(now, now_s)]
        return []

    def _speak(self, peer: Peer, *, integers: bool) -> None:
        (self._integer_links.add if integers else self._integer_links.discard)(peer.link)

    def _clear(self, peer: Peer, kind: int) -> list[Outgoing]:
        if self._running is not None:
            return [_critical("WPM: IGN CLEAR CMD: Busy")]
        for one in KINDS if kind == ALL else {kind} & set(KINDS):
            self._store.replace(one, [])
        return [ack(peer, mavlink.MAV_MISSION_ACCEPTED, kind)]

    def _begin(self, total: int, kind: int, peer: Peer, now_s: float) -> list[Outgoing]:
        now = self._running
        if now is not None:
            return self._begin_again(now, peer, now_s)
        if total > self._store.most(kind):
            return [ack(peer, mavlink.MAV_MISSION_NO_SPACE, kind)]
        if total == 0:
            if kind in KINDS:
                self._store.replace(kind, [])
            return [ack(peer, mavlink.MAV_MISSION_ACCEPTED, kind)]
        self._last = _Transfer(peer, kind, GET, total, now_s, now_s)
        return [self._request(self._last, now_s)]

    def _begin_again(self, now: _Transfer, peer: Peer, now_s: float) -> list[Outgoing]:
        refused = ack(peer, mavlink.MAV_MISSION_ERROR, now.kind)
        if now.direction == SEND:
            return [_critical("WPM: IGN MISSION_COUNT: Busy"), refused]
        now.received_s = now_s
        if not same_sender(now.peer, peer):
            return [refused]
        if now.seq == 0:  # our request was lost; what the new count says is not looked at
            return [self._request(now, now_s)]
        return [_critical("WPM: REJ. CMD: Busy"), refused]

    def _take(self, message: Message, peer: Peer, now_s: float) -> list[Outgoing]:
        last = self._last
        if last is None or not same_sender(last.peer, peer):
            return [_critical("REJ. MIS ITEM: partner id mismatch")]
        if message.mission_type != last.kind:
            return [ack(peer, mavlink.MAV_MISSION_ERROR, last.kind)]
        if not last.running:
            if last.direction == GET and last.seq == last.total == message.seq + 1:  # our last ack was lost
                return [ack(peer, mavlink.MAV_MISSION_ACCEPTED, last.kind)]
            return [_critical("IGN MISSION_ITEM: No transfer"), ack(peer, mavlink.MAV_MISSION_ERROR, last.kind)]
        if last.direction == SEND:
            return [_critical("IGN MISSION_ITEM: Busy"), ack(peer, mavlink.MAV_MISSION_ERROR, last.kind)]
        last.received_s = now_s
        if message.seq != last.seq:
            return []
        result, item = judge(item_in(message), last.kind)
        if item is None:
            last.running = False
            return [_critical("IGN MISSION_ITEM: Invalid item"), ack(peer, result, last.kind)]
        last.items.append(item)
        last.first = last.seq if message.current else last.first
        last.seq += 1
        return [self._request(last, now_s)] if last.seq < last.total else self._complete(last, peer)

    def _complete(self, done: _Transfer, peer: Peer) -> list[Outgoing]:
        done.running = False
        out = [ack(peer, mavlink.MAV_MISSION_ACCEPTED, done.kind)]
        if done.items == self._store.items[done.kind]:
            return out  # known by its checksum: nothing is reset
        self._store.replace(done.kind, done.items)
        if done.kind == MISSION:
            self._store.first = self._store.current = done.first
        home = self._store.home
        if done.kind == FENCE and leaves_out(done.items, FlatMap(home.lon_deg, home.lat_deg)):
            out.append(_critical("Geofence invalid, doesn't contain Home position"))
        return out

    def _request(self, now: _Transfer, now_s: float) -> Outgoing:
        now.sent_s = now_s
        peer = now.peer
        integers = peer.link in self._integer_links
        make = mavlink.MAVLink_mission_request_int_message if integers else mavlink.MAVLink_mission_request_message
        return Outgoing(make(peer.system, peer.component, now.seq, now.kind), peer.link)

    def _list(self, kind: int, peer: Peer, now_s: float) -> list[Outgoing]:
        now = self._running
        if now is not None:
            mine = now.direction == SEND and same_sender(now.peer, peer) and now.kind == kind
            if not (mine or (now.direction == SEND and now.seq == now.total)):
                return [status_text("Mission download request ignored, already active")]
        total = len(self._store.items.get(kind, []))
        self._last = _Transfer(peer, kind, SEND, total, now_s, now_s)
        return [count(peer, total, kind)]

    def _give(self, message: Message, kind: int, peer: Peer, now_s: float) -> list[Outgoing]:
        now = self._running
        if now is None or (now.direction == SEND and now.kind != kind):
            return []
        if not same_sender(now.peer, peer):
            return [_critical("WPM: REJ. CMD: partner id mismatch")]
        if now.direction == GET:
            return [_critical("WPM: REJ. CMD: Busy")]
        now.received_s = now_s
        item = self._store.item(kind, message.seq) if kind in KINDS else None
        if item is None or message.seq not in (now.seq, now.seq - 1) or message.seq >= now.total:
            now.running = False
            return [ack(peer, mavlink.MAV_MISSION_ERROR, kind), _critical("WPM: REJ. CMD: Req. WP was unexpected")]
        now.seq = message.seq + 1
        integers = message.get_type() == "MISSION_REQUEST_INT"
        if integers:
            item = replace(item, frame=INT_FRAME.get(item.frame, item.frame))
        current = kind == MISSION and message.seq == self._store.current
        return [item_out(peer, message.seq, kind, item, integers=integers, current=current)]

    def _acknowledged(self, message: Message, peer: Peer, now_s: float) -> list[Outgoing]:
        if self._last is None or not same_sender(self._last.peer, peer):
            return [_critical("REJ. WP CMD: partner id mismatch")]
        now = self._running
        if now is None:
            return []
        if now.direction == SEND:
            now.running = now.kind != message.mission_type
        elif message.type == mavlink.MAV_MISSION_OPERATION_CANCELLED:
            now.running = False
        elif message.type == mavlink.MAV_MISSION_UNSUPPORTED:  # the client wants the other kind of numbers
            self._speak(peer, integers=peer.link not in self._integer_links)
            return [self._request(now, now_s)]
        return []


def _critical(text: str) -> Outgoing:
    return status_text(text, mavlink.MAV_SEVERITY_CRITICAL)

"""The practice autopilot on the network."""

from __future__ import annotations

import selectors
import socket
import threading
import time
from typing import TYPE_CHECKING, Any

from sparsor.errors import InputError, SparsorError
from sparsor.link.ports.addresses import Address as UrlAddress
from sparsor.link.ports.sockets import resolved
from sparsor.link.practice.autopilot import STEP_S
from sparsor.link.practice.exchange import Message, Outgoing, Peer
from sparsor.link.practice.links import UDP_SILENT_S, Address, Link, bound, tcp_sender, udp_sender

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from types import TracebackType

    from sparsor.link.practice.autopilot import PracticeAutopilot

Key = Any
"""What names a link: a UDP socket and the address of a peer, or a TCP connection."""
LONGEST_WAIT_S = 0.01
# What one turn of the loop may simulate: beyond it the flight is slower than asked for, never jerky.
MOST_PER_TURN_S = 1.0


class PracticeServer:
    """Serve a practice autopilot over UDP and TCP, in a thread of its own or by `run`.

    Messages between clients are passed on, so that a companion's samples reach the ground station.

    Parameters
    ----------
    autopilot : PracticeAutopilot
    udp, tcp : tuple of str and int, optional
        Host and port to listen on; port 0 takes a free one.
    send_to : sequence of (str, int)
        UDP addresses to send to from the start, as PX4's SITL does to port 14540 and ArduPilot's ``--out`` to 14550.
    speedup : float
        Simulated seconds per second.

    Raises
    ------
    InputError
        When there is nothing to listen on or send to, a host is not known, or the speed-up is out of range.
    OutputError
        When a port is taken.
    """

    def __init__(
        self,
        autopilot: PracticeAutopilot,
        *,
        udp: Address | None = None,
        tcp: Address | None = None,
        send_to: Sequence[Address] = (),
        speedup: float = 1.0,
    ) -> None:
        if udp is None and tcp is None and not send_to:
            raise InputError("the practice autopilot needs a UDP or a TCP port to listen on, or an address to send to")
        if not 0.01 <= speedup <= 1000:
            raise InputError(f"a speed-up of {speedup:g}; allowed are 0.01..1000")
        self.autopilot = autopilot
        self._speedup = speedup
        self._selector = selectors.DefaultSelector()
        self._udp: socket.socket | None = None
        self._tcp: socket.socket | None = None
        self._links: dict[Any, Link] = {}
        self._made = 0
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._lag_s = self._started_s = 0.0
        try:
            self._udp = self._opened(socket.SOCK_DGRAM, udp) if udp else None
            self._tcp = self._opened(socket.SOCK_STREAM, tcp) if tcp else None
            for host, port in send_to:
                self._send_to(UrlAddress("udpout", host, port))
        except SparsorError:
            self.close()
            raise

    @property
    def udp_port(self) -> int:
        """The UDP port it listens on, 0 for none."""
        return int(self._udp.getsockname()[1]) if self._udp else 0

    @property
    def tcp_port(self) -> int:
        """The TCP port it listens on, 0 for none."""
        return int(self._tcp.getsockname()[1]) if self._tcp else 0

    def __enter__(self) -> PracticeServer:
        self._thread = threading.Thread(target=self.run, name="practice-autopilot", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()
        if self._thread:
            self._thread.join()
        self.close()

    def stop(self) -> None:
        """Let `run` end."""
        self._stop.set()

    def close(self) -> None:
        """Close every socket."""
        for key in list(self._selector.get_map().values()):
            self._selector.unregister(key.fileobj)
            key.fileobj.close()  # type: ignore[union-attr]
        self._selector.close()

    def run(self) -> None:
        """Serve until `stop`."""
        self._started_s = time.monotonic()
        wait_s = min(LONGEST_WAIT_S, STEP_S / self._speedup)
        while not self._stop.is_set():
            for key, _ in self._selector.select(wait_s):
                self._read(key.fileobj)
            self._advance(time.monotonic())

    def _advance(self, now_s: float) -> None:
        wanted_s = (now_s - self._started_s) * self._speedup - self._lag_s
        if wanted_s > self.autopilot.time_s + MOST_PER_TURN_S:
            self._lag_s += wanted_s - self.autopilot.time_s - MOST_PER_TURN_S
            wanted_s = self.autopilot.time_s + MOST_PER_TURN_S
        self._send(self.autopilot.advance(wanted_s, now_s), now_s)
        for key, link in list(self._links.items()):
            link.flush(now_s)
            if link.gone(now_s, float("inf") if isinstance(key, socket.socket) else UDP_SILENT_S):
                self._drop(key)
            else:
                self._take(link, now_s)

    def _read(self, ready: Key) -> None:
        now_s = time.monotonic()
        if ready is self._tcp:
            self._accept(now_s)
        elif ready.type == socket.SOCK_DGRAM:
            self._read_datagrams(ready, now_s)
        else:
            try:
                data = ready.recv(65_536)
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                data = b""
            if data:
                self._received(ready, data, now_s)
            else:
                self._drop(ready)

    def _accept(self, now_s: float) -> None:
        assert self._tcp is not None  # only asked for when it is ready
        try:
            connection, _ = self._tcp.accept()
        except OSError:
            return
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._selector.register(connection, selectors.EVENT_READ)
        self._join(connection, tcp_sender(connection), now_s)

    def _read_datagrams(self, server: socket.socket, now_s: float) -> None:
        for _ in range(200):
            try:
                data, address = server.recvfrom(65_536)
            except (BlockingIOError, InterruptedError):
                return
            except OSError:  # Windows reports a closed peer here
                continue
            key = (server, address)
            if key not in self._links:
                self._join(key, udp_sender(server, address), now_s)
            self._received(key, data, now_s)

    def _send_to(self, address: UrlAddress) -> None:
        """Open a link to an address that has not been heard yet, from a port of our own."""
        family, target = resolved(address, socket.SOCK_DGRAM)
        server = socket.socket(family, socket.SOCK_DGRAM)
        server.setblocking(False)
        self._selector.register(server, selectors.EVENT_READ)
        self._join((server, target), udp_sender(server, target), time.monotonic(), stays=True)

    def _join(self, key: Key, send: Callable[[bytes], int], now_s: float, *, stays: bool = False) -> None:
        self._made += 1
        self._links[key] = Link(self._made, self.autopilot.settings, send, now_s, stays=stays)
        self.autopilot.join(self._made)
        if not stays:
            self.autopilot.narrator.say(f"client {self._made} joined ({_words(key)})")

    def _drop(self, key: Key) -> None:
        link = self._links.pop(key)
        self.autopilot.leave(link.number)
        self.autopilot.narrator.say(f"client {link.number} left")
        if isinstance(key, socket.socket):
            self._selector.unregister(key)
            key.close()

    def _received(self, key: Key, data: bytes, now_s: float) -> None:
        link = self._links[key]
        link.parse(data, now_s)
        self._take(link, now_s)

    def _take(self, link: Link, now_s: float) -> None:
        """Act on the messages that have arrived on a link."""
        for message in link.arrived(now_s):
            self._pass_on(message, link, now_s)
            peer = Peer(message.get_srcSystem(), message.get_srcComponent(), link.number)
            self._send(self.autopilot.receive(message, peer, now_s), now_s)

    def _pass_on(self, message: Message, source: Link, now_s: float) -> None:
        """Forward what is not for the vehicle alone: to everybody, or to where its target was heard."""
        target = getattr(message, "target_system", 0)
        if self.autopilot.link_lost or (target == self.autopilot.settings.system and self.autopilot.is_for_me(message)):
            return
        for link in self._links.values():
            if link is not source and (target == 0 or target in link.systems):
                link.forward(bytes(message.get_msgbuf()), now_s)

    def _send(self, out: Iterable[Outgoing], now_s: float) -> None:
        links = list(self._links.values())
        for one in out:
            for link in links:
                if one.link is None or one.link == link.number:
                    link.send(one.message, now_s)

    def _opened(self, kind: socket.SocketKind, address: Address) -> socket.socket:
        server = bound(kind, address)
        self._selector.register(server, selectors.EVENT_READ)
        return server


def _words(key: Key) -> str:
    """Return who is at the other end of a link, as people write it."""
    tcp = isinstance(key, socket.socket)
    try:
        host, port, *_ = key.getpeername() if tcp else key[1]
    except OSError:  # gone already
        return "TCP"
    return f"{'TCP' if tcp else 'UDP'} {host}:{port}"

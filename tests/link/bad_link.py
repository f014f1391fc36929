"""A UDP link that loses, repeats and delays datagrams in both directions, from a seed."""

from __future__ import annotations

import heapq
import random
import select
import socket
import threading
import time


class BadLink:
    """Stands between a client, who sends to `url`, and a UDP port of this computer."""

    def __init__(self, port, *, loss=0.0, twice=0.0, delay_s=0.0, seed=1):
        self.target, self.loss, self.twice, self.delay_s = ("127.0.0.1", port), loss, twice, delay_s
        self.random = random.Random(seed)
        self.near, self.far = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        for one in (self.near, self.far):
            one.bind(("127.0.0.1", 0))
        self.client = None
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)

    @property
    def url(self):
        return f"udpout://127.0.0.1:{self.near.getsockname()[1]}"

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.stop.set()
        self.thread.join()
        self.near.close()
        self.far.close()

    def run(self):
        waiting, count = [], 0
        while not self.stop.is_set():
            for one in select.select([self.near, self.far], [], [], 0.005)[0]:
                data, sender = one.recvfrom(4096)
                if one is self.near:
                    self.client = sender
                for _ in range(1 + (self.random.random() < self.twice)):
                    if self.random.random() >= self.loss:
                        count += 1
                        heapq.heappush(waiting, (time.monotonic() + self.delay_s, count, one is self.near, data))
            while waiting and waiting[0][0] <= time.monotonic():
                _, _, outward, data = heapq.heappop(waiting)
                if outward:
                    self.far.sendto(data, self.target)
                elif self.client:
                    self.near.sendto(data, self.client)

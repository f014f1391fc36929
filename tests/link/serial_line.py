"""A serial line without hardware: a pseudo-terminal, whose other end the test holds. POSIX only."""

from __future__ import annotations

import os
import select
import socket
import threading


class SerialLine:
    """A device that can be opened, unplugged and plugged in again under the same name."""

    def __init__(self, path):
        self.path = path
        self.near = self.far = None
        self.plug()

    def plug(self):
        import tty

        self.near, self.far = os.openpty()
        tty.setraw(self.far)  # else what is written before the port is opened comes back as an echo
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(self.far))

    def unplug(self):
        self.path.unlink(missing_ok=True)
        for end in (self.near, self.far):
            if end is not None:
                os.close(end)
        self.near = self.far = None

    def write(self, data):
        os.write(self.near, data)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.unplug()


class Bridge:
    """Carries bytes between a serial line and a TCP port of this computer, as a radio does."""

    def __init__(self, line, port):
        self.line = line
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.run, name="serial bridge", daemon=True)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.stop.set()
        self.thread.join()
        self.socket.close()

    def run(self):
        while not self.stop.is_set():
            for end in select.select([self.line.near, self.socket], [], [], 0.02)[0]:
                if end is self.socket:
                    self.pass_on(self.socket.recv(4096))
                else:
                    self.socket.sendall(os.read(self.line.near, 4096))

    def pass_on(self, data):
        while data and not self.stop.is_set():
            if select.select([], [self.line.near], [], 0.02)[1]:
                data = data[os.write(self.line.near, data) :]

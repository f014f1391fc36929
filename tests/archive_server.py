"""A server of files on this machine, with the faults that archives have."""

from __future__ import annotations

import re
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


class Archive:
    """Files by path, and how they are served.

    `breaks_after` ends the next answer that early, once; `ranges`: whether a part may be asked for; `asked` is what
    was: path and Range.
    """

    def __init__(self):
        self.files, self.tags, self.asked = {}, {}, []
        self.breaks_after, self.ranges = None, True
        self.url = ""


def handler(archive):
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):  # the name that http.server calls
            wanted = self.headers.get("Range")
            archive.asked.append((self.path, wanted))
            content = archive.files.get(self.path)
            if content is None:
                self.send_error(404)
                return
            tag = archive.tags.get(self.path, '"one"')
            begin = 0
            if wanted and archive.ranges and self.headers.get("If-Range") == tag:
                begin = int(re.match(r"bytes=(\d+)-", wanted)[1])
            if begin >= len(content):
                self.send_error(416)
                return
            self.send_response(206 if begin else 200)
            if begin:
                self.send_header("Content-Range", f"bytes {begin}-{len(content) - 1}/{len(content)}")
            self.send_header("Content-Length", str(len(content) - begin))
            self.send_header("ETag", tag)
            self.send_header("Last-Modified", "Thu, 01 Oct 2020 00:00:00 GMT")
            self.end_headers()
            stop, archive.breaks_after = archive.breaks_after, None
            self.wfile.write(content[begin:] if stop is None else content[begin : begin + stop])

        def log_message(self, *_):
            pass

    return Handler


@contextmanager
def serving():
    archive = Archive()
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler(archive))
    archive.url = f"http://127.0.0.1:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield archive
    finally:
        server.shutdown()
        server.server_close()
        thread.join()

"""Serves the page, and the lines that it shows, to browsers of this machine, or to those that know the token."""

from __future__ import annotations

import hmac
import ipaddress
import socket
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, urlsplit

from haptic_lab.view.history import History
from haptic_lab.view.page import page

HERE = ("127.0.0.1", "localhost", "::1")
OURS = ("same-origin", "none")  # what a browser says of what the page asks, or a person; a page of others: another
STILL = 1.0  # s after which a reader that has gone is noticed
AT_ONCE = 32  # readers


class PageServer(ThreadingHTTPServer):
    """Listens at a port; each browser has a thread."""

    daemon_threads = True

    def __init__(self, listener: socket.socket, token: str | None, history: History) -> None:
        """Take over a socket.

        Args:
            listener: that listens.
            token: without which nothing is told; None: none is asked for.
            history: what is told.
        """
        self.token, self.history = token, history
        self.readers = 0
        self._counting = threading.Condition()
        super().__init__(("", 0), _Handler, bind_and_activate=False)
        self.socket.close()
        self.socket = listener

    def enter(self) -> bool:
        """Count a reader in.

        Returns:
            Whether there is room for it.
        """
        with self._counting:
            room = self.readers < AT_ONCE
            self.readers += room
            return room

    def leave(self) -> None:
        """Count a reader out."""
        with self._counting:
            self.readers -= 1
            self._counting.notify_all()

    def finish(self, seconds: float) -> None:
        """Let readers take what is left, and end.

        Args:
            seconds: that they have at most.
        """
        with self._counting:
            self._counting.wait_for(lambda: not self.readers, seconds)
        self.shutdown()
        self.server_close()

    def handle_error(self, *_: object) -> None:
        """Say nothing of browsers that go away."""


class _Handler(BaseHTTPRequestHandler):
    server: PageServer
    protocol_version = "HTTP/1.0"
    server_version, sys_version = "haptic-slam", ""
    timeout = 30

    def do_GET(self) -> None:
        asked = urlsplit(self.path)
        if not self._known(parse_qs(asked.query)):
            return
        if asked.path == "/":
            self._send(HTTPStatus.OK, page(), "text/html")
        elif asked.path == "/stream" and self.headers.get("Sec-Fetch-Site", OURS[0]) not in OURS:
            self._send(HTTPStatus.FORBIDDEN, "only the page itself is told\n")
        elif asked.path == "/stream":
            self._stream()
        else:
            self._send(HTTPStatus.NOT_FOUND, "there is nothing here but the page itself, /\n")

    def log_message(self, *_: object) -> None:
        pass

    def _known(self, query: dict[str, list[str]]) -> bool:
        """Refuse who does not know the token, and pages of others that had a name of theirs lead here."""
        token = self.server.token
        if token is not None:
            given = query.get("token", [""])[0]
            if not hmac.compare_digest(given.encode(), token.encode()):
                self._send(HTTPStatus.FORBIDDEN, "the address must end with ?token=, as the command has printed it\n")
                return False
        elif not _is_here(self.headers.get("Host", "")):
            self._send(HTTPStatus.FORBIDDEN, "call this page by its address, 127.0.0.1\n")
            return False
        return True

    def _send(self, status: HTTPStatus, text: str, kind: str = "text/plain") -> None:
        content = text.encode()
        self.send_response(status)
        self._headers(kind)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def _headers(self, kind: str) -> None:
        for name, value in (
            ("Content-Type", f"{kind}; charset=utf-8"),
            ("Cache-Control", "no-store"),
            ("Referrer-Policy", "no-referrer"),  # the address has the token
            ("X-Content-Type-Options", "nosniff"),
            ("X-Frame-Options", "DENY"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
        ):
            self.send_header(name, value)

    def _stream(self) -> None:
        """All lines, then each as it comes, until there are no more or the reader is gone."""
        if not self.server.enter():
            self._send(HTTPStatus.SERVICE_UNAVAILABLE, f"{AT_ONCE} browsers look already\n")
            return
        try:
            self.send_response(HTTPStatus.OK)
            self._headers("application/x-ndjson")
            self.end_headers()
            self.wfile.write(b"\n")
            serial = -1
            while True:
                lines = self.server.history.after(serial, STILL)
                if not lines and self.server.history.ended:
                    break
                self.wfile.write("".join(f"{each.text}\n" for each in lines).encode() or b"\n")
                serial = lines[-1].serial if lines else serial
        except OSError:
            pass
        finally:
            self.server.leave()


def _is_here(host: str) -> bool:
    """Whether a browser calls this machine by its address, or as localhost."""
    try:
        name = urlsplit(f"//{host}").hostname or ""
        return name in HERE or ipaddress.ip_address(name).is_loopback
    except ValueError:
        return False

"""The flags of a command that can be watched in the browser, and what is valid."""

from __future__ import annotations

import ipaddress
import re
import secrets
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

from haptic_env import validate
from haptic_lab.files import check_output
from haptic_lab.terminal import as_path

HOST, PORT = "127.0.0.1", 8017
TOKEN = re.compile(r"[\w.~-]{16,200}", re.ASCII)
HTML = (".html", ".htm")
FLAGS = ("view", "view_host", "view_port", "view_token", "view_wait", "save_html")


@dataclass(frozen=True)
class ViewOptions:
    """How an exploration is shown.

    Attributes:
        page: whether there is a page while it runs.
        host: address at which it is.
        port: of it; 0: any that is free.
        token: that browsers must know; None: none, where only this machine reaches it.
        wait: whether the page stays when it is over; None: on a terminal.
        html: path of a file that shows it later; None: none is written.

    Raises:
        ValueError: for a value that makes no sense.
    """

    page: bool = False
    host: str = HOST
    port: int = PORT
    token: str | None = None
    wait: bool | None = None
    html: str | None = None

    def __post_init__(self) -> None:
        validate.integer("--view-port", self.port, 0, 65535)
        try:
            ipaddress.ip_address(self.host)
        except ValueError:
            raise ValueError(
                f"--view-host must be an address of this machine, such as {HOST} (this machine only) or 0.0.0.0 (all "
                f"that reach it and have the token), got {validate.shown(self.host)}"
            ) from None
        if self.token is not None and not TOKEN.fullmatch(self.token):
            told = validate.shown(self.token)
            raise ValueError(f"--view-token must be 16 to 200 letters, digits, '-', '_', '.' or '~', got {told}")
        if self.html is not None and Path(self.html).suffix.lower() not in HTML:
            raise ValueError(f"--save-html must end in {' or '.join(HTML)}, got {validate.shown(self.html)}")

    @classmethod
    def taken(cls, given: dict[str, Any]) -> Self:
        """Take the flags out of those of a command.

        Args:
            given: the flags; those of the view are removed.

        Returns:
            What they say.

        Raises:
            ValueError: for a value that makes no sense, and for a flag of the page where none is asked for.
        """
        page, host, port, token, wait, html = (given.pop(name) for name in FLAGS)
        told = {"view_host": host, "view_port": port, "view_token": token, "view_wait": wait}
        for name, value in told.items():
            if not page and value is not None:
                raise ValueError(f"--{name.replace('_', '-')} is for the page of --view, which is not given")
        host, port = HOST if host is None else host, PORT if port is None else port
        options = cls(page, host, port, token, wait, html)
        if page and token is None and not ipaddress.ip_address(host).is_loopback:
            return replace(options, token=secrets.token_urlsafe(24))
        return options

    @property
    def asked(self) -> bool:
        """Whether anything is to be shown."""
        return self.page or self.html is not None

    def check(self, out: str) -> None:
        """Check that the file can be written.

        Args:
            out: folder of the exploration, which may be made yet.

        Raises:
            ValueError: where it cannot.
        """
        if self.html is not None:
            check_output("--save-html", Path(self.html), Path(out))

    def address(self, port: int) -> str:
        """Say where the page is.

        Args:
            port: at which it listens.

        Returns:
            What a browser is given.
        """
        found = ipaddress.ip_address(self.host)
        host = HOST if found.is_unspecified and found.version == 4 else "::1" if found.is_unspecified else self.host
        told = f"[{host}]" if ":" in host else host
        return f"http://{told}:{port}/" + ("" if self.token is None else f"?token={self.token}")


UNSEEN = ViewOptions()


def add_flags(add: Callable[..., Any]) -> None:
    """Let a command be watched.

    Args:
        add: adds an argument to its parser.
    """
    add("--view", action="store_true", help="show it in the browser while it runs, at the address that is printed")
    add("--view-port", type=int, metavar="PORT", help=f"of that page (default {PORT}); 0: any that is free")
    where = f"address at which it is (default {HOST}: this machine only); any other asks browsers for a token"
    add("--view-host", metavar="ADDRESS", help=where)
    add("--view-token", metavar="TOKEN", help="that token, 16 letters at least (default: a new one, which is printed)")
    stays = "the page stays until Ctrl-C when all is over (default: on a terminal)"
    add("--view-wait", action="store_const", const=True, help=stays)
    ends = "the page ends with the command (default: where that is not on a terminal)"
    add("--no-view-wait", action="store_const", const=False, dest="view_wait", help=ends)
    add("--save-html", type=as_path, metavar="FILE", help="write it as one page that needs no server and no network")

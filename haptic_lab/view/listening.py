"""The port of the page, which is taken before anything is run."""

from __future__ import annotations

import errno
import socket
import sys

from haptic_lab.view.options import HOST, ViewOptions

WAITING = 16  # browsers that are not answered yet


def listen(options: ViewOptions) -> socket.socket:
    """Listen for browsers, which wait until somebody answers.

    Args:
        options: where the page is.

    Returns:
        What listens.

    Raises:
        ValueError: where there can be none at that port or address.
    """
    made = None
    try:
        made = socket.socket(socket.AF_INET6 if ":" in options.host else socket.AF_INET, socket.SOCK_STREAM)
        if sys.platform != "win32":  # where it would share the port with who has it
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind((options.host, options.port))
        made.listen(WAITING)
    except OSError as error:
        if made is not None:
            made.close()
        raise ValueError(_refusal(options, error)) from error
    return made


def _refusal(options: ViewOptions, error: OSError) -> str:
    if error.errno in (errno.EADDRNOTAVAIL, errno.EAFNOSUPPORT):
        return f"--view-host {options.host} is no address of this machine; {HOST} is one, and 0.0.0.0 is all of them"
    why = "is taken" if error.errno == errno.EADDRINUSE else f"cannot be had ({error.strerror or error})"
    valid = "say another from 1024 to 65535, or 0 for any that is free"
    return f"--view-port {options.port} of {options.host} {why}; {valid}"

"""The page, all in one file."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterable
from importlib import resources
from pathlib import Path

from haptic_lab.files import atomic, write_text

SCRIPTS = ("shaders.js", "geometry.js", "camera.js", "drawing.js", "record.js", "panel.js", "main.js")


def page(recorded: Iterable[str] | None = None) -> str:
    """Put the page together.

    Args:
        recorded: lines that it shows; None: it asks who sent it.

    Returns:
        HTML that loads nothing else.
    """
    folder = resources.files("haptic_lab.view") / "web"

    def text(name: str) -> str:
        return (folder / name).read_text(encoding="utf-8")

    kept = ""
    if recorded is not None:
        # Base64 has no letter that could end the element.
        packed = base64.b64encode(zlib.compress("\n".join(recorded).encode(), 9)).decode()
        kept = f'<script id="recorded" type="text/plain">{packed}</script>'
    html = text("page.html").replace("/*STYLE*/", text("style.css").rstrip())
    html = html.replace("/*SCRIPT*/", "\n".join(map(text, SCRIPTS)).rstrip())
    return html.replace("<!--RECORDED-->", kept)


def write(path: Path, recorded: Iterable[str]) -> None:
    """Write a page that needs no server, whole or not at all.

    Args:
        path: of the file.
        recorded: lines that it shows.

    Raises:
        OSError: where it cannot be written.
    """
    with atomic(path) as place:
        write_text(place, page(recorded))

"""Where the page of a match is, and whether a browser can be opened on it here."""

import os
import sys
import webbrowser
from pathlib import Path

import msgspec

FILE = "page.json"


class _Place(msgspec.Struct):
    url: str
    pid: int


def read_page_url(folder: Path) -> str | None:
    """Return the address of the page of the match in a folder; None while there is none."""
    try:
        place = msgspec.json.decode((folder / FILE).read_bytes(), type=_Place)
        os.kill(place.pid, 0)
    except (OSError, ValueError, RecursionError, OverflowError):
        return None
    return place.url


def has_browser() -> bool:
    """Return whether a browser can be opened here: a screen, or somebody's choice of one."""
    if sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or os.environ.get("BROWSER")
    ):
        return False
    try:
        webbrowser.get()
    except webbrowser.Error:
        return False
    return True

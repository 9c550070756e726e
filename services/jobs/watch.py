"""`riposte watch [RUN]`: the live view of a run that goes on, or the recording of one ended."""

import argparse
import contextlib
import os
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path

from shared.clock import SystemClock
from shared.errors import ConfigError, RiposteError
from shared.runtime.stop import stop_on_signals
from shared.telemetry.door import FrontDoor, LiveView, read_live_view
from shared.telemetry.rrd import recordings
from shared.telemetry.viewer import WebViewer

POLL_SECONDS = 0.1
READY_SECONDS = 20.0


def main(argv: Sequence[str] | None = None) -> int:
    """Show a run; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="riposte watch", description="Look at a run: live while it goes, else its recording."
    )
    parser.add_argument(
        "run", nargs="?", type=Path, default=Path("runs/latest"), metavar="RUN",
        help="folder of the run (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--port", type=int, default=9090, help="of the page (%(default)s)")
    parser.add_argument("--no-browser", action="store_true", help="only print the address")
    found = parser.parse_args(argv)
    if not found.run.is_dir():
        raise ConfigError(f"there is no run {found.run}; name its folder")
    view = running_view(found.run)
    if view is not None:
        print(f"live view of {found.run}: {view.url}")
        if not found.no_browser:
            webbrowser.open(view.url)
        return 0
    return _show_recordings(found.run, found.port, browser=not found.no_browser)


def running_view(folder: Path) -> LiveView | None:
    """Return where a run can be watched live, None when the process that shows it is gone."""
    view = read_live_view(folder)
    if view is None:
        return None
    try:
        os.kill(view.pid, 0)
    except ProcessLookupError:
        return None
    except PermissionError:
        pass  # somebody else's, and there
    return view


def _show_recordings(folder: Path, port: int, *, browser: bool) -> int:
    """Serve a run's recordings until interrupted.

    Raises:
        RiposteError: there are none, or the viewer cannot be started.
    """
    files = [str(path) for path in recordings(folder)]
    if not files:
        raise ConfigError(
            f"{folder} has no recording (recording.rrd); it was made with train.record = false, "
            "play.record = false or recorder.file = false"
        )
    clock = SystemClock()
    with (
        stop_on_signals() as stop,
        contextlib.closing(WebViewer(files)) as viewer,
        contextlib.closing(FrontDoor(viewer.url, port, clock)) as door,
    ):
        if not viewer.wait_ready(READY_SECONDS):
            raise RiposteError("Rerun's viewer did not start; see riposte doctor")
        print(f"recording of {folder}: {door.url}   (Ctrl-C ends)")
        if browser:
            webbrowser.open(door.url)
        while not stop.wait(POLL_SECONDS):
            door.tick()
            if not viewer.alive:
                raise RiposteError("Rerun's viewer has ended by itself; start riposte watch again")
    return 0


if __name__ == "__main__":
    sys.exit(main())

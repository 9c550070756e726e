"""What recording live bouts costs: CPU of the recorder, bytes of a bout.

A match between two policies in real time, once recorded in full (live view, recording.rrd,
archive) and once by a recorder that only hears: what is between the two is the recording.
"""

import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

import psutil

from benchmarks.control import Site
from benchmarks.harness import cpu_seconds
from services.jobs.bench import Check, Measurement
from shared.errors import RiposteError
from shared.telemetry.archive import archived_bouts, load_bout

QUESTION = "CPU and bytes that recording live bouts takes, all streams at 100 Hz"
GOAL = 0.15
"""Share of a core."""
FULL = ("recorder.web_port=0",)
HEARING = ("recorder.live=false", "recorder.file=false", "recorder.archive=false")
BOUT_SECONDS = 20.0
SMOKE_STEPS = 200
BOUTS = 3
END_SECONDS = 60.0


def recorded(settings: tuple[str, ...], bouts: int) -> dict[str, Any]:
    """Return what a recorder used while so many bouts were fenced."""
    folder = Path(tempfile.mkdtemp(prefix="riposte-record-"))
    site = Site(folder, settings)
    try:
        site.until_fencing()
        recorder = site.pids["recorder-0"]
        viewers = [child.pid for child in psutil.Process(recorder).children(recursive=True)]
        first, began_at = site.match.finished, time.monotonic()
        used, shown = cpu_seconds([recorder]), cpu_seconds(viewers)
        until = began_at + (bouts + 1) * (BOUT_SECONDS + END_SECONDS)
        while site.match.finished < first + bouts:
            if time.monotonic() > until:
                raise RiposteError(f"{bouts} bouts did not end: {site.match.waits_for}")
            site.tick()
        seconds = time.monotonic() - began_at
        used, shown = cpu_seconds([recorder]) - used, cpu_seconds(viewers) - shown
        memory = psutil.Process(recorder).memory_info().rss
    finally:
        site.close()  # the recorder finishes archive and recording
    run = folder / "match"
    found = [load_bout(path) for path in archived_bouts(run)]
    whole = [bout for bout in found if bout.info.outcome == "finished"]
    result = {
        "share": used / seconds,
        "viewer_share": shown / seconds,
        "seconds": seconds,
        "rss_mib": memory / 2**20,
        "bouts": len(whole),
        "rrd_bytes": sum(path.stat().st_size for path in run.glob("recording*.rrd")),
        "archive_bytes": [
            sum(path.stat().st_size for path in bout.folder.iterdir()) for bout in whole
        ],
        "game_seconds": [bout.info.steps * bout.info.control_timestep for bout in whole],
        "dropped": sum(s.dropped for bout in whole for s in bout.info.streams.values()),
        "missing": sum(bout.info.streams["bats"].missing for bout in whole),
    }
    shutil.rmtree(folder, ignore_errors=True)
    return result


def measure(smoke: bool) -> Measurement:
    """Return the recorder's share of a core."""
    rules = (f"game.bout_steps={SMOKE_STEPS}",) if smoke else ()
    bouts = 1 if smoke else BOUTS
    full, hearing = (recorded((*settings, *rules), bouts) for settings in (FULL, HEARING))
    scale = BOUT_SECONDS / max(sum(full["game_seconds"]), 1e-9)
    return Measurement(
        value=full["share"],
        unit="of a core",
        limit=hearing["share"],
        ratio=Check(
            name="the recorder's share of a core", value=full["share"], goal=GOAL,
            goal_is="at most",
        ),
        runs=(full, hearing),
        checks=(
            Check(name="only hearing the streams", value=hearing["share"], unit="of a core"),
            Check(name="the server of the live page", value=full["viewer_share"], unit="of a core"),
            Check(
                name="archive of a bout of 20 s",
                value=1e-6 * scale * sum(full["archive_bytes"]), unit="MB",
            ),
            Check(
                name="recording.rrd of a bout of 20 s",
                value=1e-6 * scale * full["rrd_bytes"], unit="MB",
            ),
            Check(name="memory of the recorder", value=full["rss_mib"], unit="MiB"),
            Check(name="messages dropped", value=full["dropped"], goal=0.0, goal_is="at most"),
            Check(name="ticks that are not in the archive", value=full["missing"]),
        ),
    )  # fmt: skip

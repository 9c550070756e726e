"""The recorder's work: bus in, recording out, without ever waiting for anything."""

import contextlib
import hashlib
import os
import shutil
import sys
from pathlib import Path

import msgspec
import structlog

from services.recorder.config import RecorderConfig
from services.recorder.live import Live, about_of
from services.recorder.narrator import Narrator
from services.recorder.playback import Playback
from shared.bus.base import Bus
from shared.bus.ports import free_port
from shared.clock import Clock
from shared.errors import RiposteError
from shared.messages.live import BoutFrames
from shared.messages.topics import FRAMES, PROGRESS, SCHEDULE, STATUS
from shared.runtime.files import MIB, atomic_write
from shared.runtime.service import Health
from shared.sim.model import FencingModel
from shared.telemetry.archive import BoutInfo
from shared.telemetry.bout import BoutDrawer, BoutRows, draw_scene
from shared.telemetry.door import VIEWER_FILE, FrontDoor, LiveView
from shared.telemetry.layout import training_layout
from shared.telemetry.recording import LivePorts, Recording
from shared.telemetry.rrd import next_recording, recordings, trim
from shared.telemetry.scene import Scene
from shared.telemetry.viewer import WebViewer

DISK_PERIOD = 5.0
"""Seconds from one look at the free space to the next."""
TAKE_MOST = 64
"""Messages of one topic taken in one tick, so that a flood cannot hold up the rest."""

log = structlog.get_logger()


class Recorder:
    """Draws what it hears into a recording; a service that ticks."""

    def __init__(
        self, cfg: RecorderConfig, bus: Bus, clock: Clock, directory: Path, model: FencingModel,
        about: BoutInfo | None = None,
    ) -> None:  # fmt: skip
        """Open the file, the ports and the page.

        Args:
            cfg: what to record and where to show it.
            bus: where to listen.
            clock: paces the bout on show.
            directory: folder of the run.
            model: the simulator model the bouts are played in; frames of another are not drawn.
            about: what the archive says of every live bout; by default only the model.

        Raises:
            RiposteError: the folder cannot be written or the viewer cannot be started.
        """
        self._cfg = cfg
        self._clock = clock
        self._directory = directory
        self._scene = scene = scene_of(model)
        self._model = model.hash
        self._counters = {"frames": 0, "frames_unshown": 0, "frames_refused": 0, "rows": 0}
        self._last_error = ""
        self._viewer: WebViewer | None = None
        self._door: FrontDoor | None = None
        try:
            live = self._start_viewer() if cfg.live else None
            self._recording = self._open(live)
        except OSError as error:
            self._close_viewer()
            raise RiposteError(f"cannot record into {directory}: {error.strerror}") from error
        draw_scene(self._recording, scene)
        self._recording.flush()
        self._narrator = Narrator(self._recording, clock, cfg.status_period)
        self._playback = Playback(scene.control_timestep, cfg.frames_per_second, cfg.bout_steps)
        self._live = BoutDrawer(self._recording, scene, "live")
        self._filed = BoutDrawer(self._recording, scene, "file")
        self._file_rows: list[BoutRows] = []
        self._live_bouts = Live(
            cfg, bus, clock, directory, model, self._recording, scene,
            about or about_of(directory, model, {}, ""), self._narrator.say,
        )  # fmt: skip
        self._frames = bus.subscribe(FRAMES)
        self._progress = bus.subscribe(PROGRESS)
        self._schedule = bus.subscribe(SCHEDULE)
        self._status = bus.subscribe(STATUS)
        now = clock.now()
        self._bout_due = self._disk_due = now
        self._file_due = now + cfg.file_period

    @property
    def url(self) -> str:
        """Return the address of the live view; empty without one."""
        return self._door.url if self._door is not None else ""

    def tick(self) -> bool:
        """Take what has arrived and record what is due; return whether anything arrived."""
        did = self._listen()
        now = self._clock.now()
        if self._door is not None:
            self._door.tick()
        if now >= self._bout_due:
            self._bout_due = now + self._cfg.live_period
            self._show_bout(now)
        self._narrator.tick(now)
        self._live_bouts.tick(now)
        if now >= self._disk_due:
            self._disk_due = now + DISK_PERIOD
            self._look_at_disk()
        if now >= self._file_due:
            self._file_due = now + self._cfg.file_period
            self._write_bout()
            self._recording.flush()
            self._notice_file_error()
        return did

    def health(self) -> Health:
        """Return what it records and what it could not."""
        places = [
            place
            for place, there in (
                ("file", self._recording.has_file),
                ("live view", self._recording.has_live),
            )
            if there
        ]
        rates, counters, trouble = self._live_bouts.health()
        bout = f", bout {self._live_bouts.bout}" if self._live_bouts.bout else ""
        return Health(
            state="recording: " + (" and ".join(places) or "nothing") + bout,
            rates=rates,
            counters=self._counters | counters,
            last_error=self._last_error or trouble,
        )

    def close(self) -> None:
        """Write what is held and the footer; take the live view down."""
        self._listen()
        self._live_bouts.close()
        self._write_bout()
        self._recording.close()
        for subscription in (self._frames, self._progress, self._schedule, self._status):
            subscription.close()
        self._close_viewer()
        log.info("recording_closed", rows=self._counters["rows"], file_error=self._last_error)

    def _listen(self) -> bool:
        did = self._live_bouts.listen()
        for _ in range(TAKE_MOST):
            if (frames := self._frames.take()) is None:
                break
            did = True
            self._take_frames(frames)
        for _ in range(TAKE_MOST):
            if (status := self._status.take()) is None:
                break
            did = True
            self._narrator.on_status(status)
            self._live_bouts.on_status(status)
        if (schedule := self._schedule.take()) is not None:
            did = True
            self._narrator.on_schedule(schedule)
        if (progress := self._progress.take()) is not None:
            did = True
            self._narrator.on_progress(progress)
        return did

    def _take_frames(self, frames: BoutFrames) -> None:
        bodies = len(self._scene.body_names)
        if frames.model != self._model or frames.positions.shape[1] != bodies:
            self._counters["frames_refused"] += len(frames.steps)
            self._last_error = (
                f"frames of {frames.actor} are of model {frames.model[:12]} with "
                f"{frames.positions.shape[1]} bodies, not of {self._model[:12]} with {bodies}; "
                "give the recorder and the actors one [sim] section"
            )
            return
        shown = self._playback.offer(frames)
        self._counters["frames" if shown else "frames_unshown"] += len(frames.steps)

    def _show_bout(self, now: float) -> None:
        if self._live_bouts.is_on:
            return
        rows = self._playback.due(now, self._clock.wall_ns())
        if (started := self._playback.take_started()) is not None:
            self._narrator.on_bout(started)
        if rows is None:
            return
        self._counters["rows"] += len(rows)
        self._live.draw(rows)
        if self._recording.has_file:
            self._file_rows.append(rows)

    def _write_bout(self) -> None:
        has_room = self._recording.file_size < self._cfg.file_bouts_mib * MIB
        self._live_bouts.write(has_room=has_room)
        if self._file_rows:
            rows, self._file_rows = BoutRows.join(self._file_rows), []
            if has_room:
                self._filed.draw(rows)

    def _look_at_disk(self) -> None:
        if not self._recording.has_file:
            return
        free = shutil.disk_usage(self._directory).free
        if free < self._cfg.min_free_mib * MIB:
            self._recording.give_up_file(
                f"{free // MIB} MiB free on its disk, {self._cfg.min_free_mib} MiB are kept free"
            )

    def _notice_file_error(self) -> None:
        if self._recording.file_error and not self._last_error.startswith("recording.rrd ended"):
            self._last_error = (
                f"recording.rrd ended early ({self._recording.file_error}); the live view goes on"
            )
            self._file_rows.clear()
            self._live_bouts.forget_file()
            self._narrator.say("recorder", self._last_error, "ERROR")
            log.warning("recording_file_lost", reason=self._recording.file_error)

    def _open(self, live: LivePorts | None) -> Recording:
        self._directory.mkdir(parents=True, exist_ok=True)
        for path in recordings(self._directory):
            self._mend(path)
        file = next_recording(self._directory) if self._cfg.file else None
        identity = recording_id(self._directory)
        layout = training_layout(self._scene)
        recording = Recording(identity, file, live, layout, name=self._directory.resolve().name)
        if self._viewer is not None:
            view = LiveView(url=self.url, page=self._viewer.url, pid=self._viewer.pid)
            atomic_write(self._directory / VIEWER_FILE, msgspec.json.encode(view))
        log.info("recording_opened", file=str(file or ""), url=self.url)
        return recording

    def _mend(self, path: Path) -> None:
        try:
            if lost := trim(path):
                log.warning("recording_mended", path=str(path), cut_bytes=lost)
        except (RiposteError, OSError) as error:
            log.warning("recording_unreadable", path=str(path), reason=str(error))

    def _start_viewer(self) -> LivePorts:
        live = LivePorts(
            bout=free_port(), curves=free_port(), bout_memory=f"{self._cfg.bout_memory_mib}MiB"
        )
        self._viewer = WebViewer(live.urls, launcher=_launcher())
        self._door = FrontDoor(self._viewer.url, self._cfg.web_port, self._clock)
        return live

    def _close_viewer(self) -> None:
        if self._door is not None:
            self._door.close()
            self._door = None
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None
            with contextlib.suppress(OSError):
                (self._directory / VIEWER_FILE).unlink()


def scene_of(model: FencingModel) -> Scene:
    """Return what there is to draw of a simulator model."""
    return Scene(
        body_names=model.body_names,
        shapes=model.shapes,
        target_centre=model.target_centre,
        target_radius=model.target_radius,
        control_timestep=model.cfg.control_timestep,
    )


def recording_id(directory: Path) -> str:
    """Return the id that all recordings in a folder share, so that viewers merge them."""
    folder = directory.resolve()
    name = f"{folder}:{folder.stat().st_ino}"
    return f"{folder.name}-{hashlib.sha256(name.encode()).hexdigest()[:12]}"


def _launcher() -> tuple[str, ...]:
    """Return the command that starts a program so that it dies with this process."""
    launch = Path(__file__).parents[1] / "launch.py"
    return sys.executable, "-I", "-S", str(launch), str(os.getpid())

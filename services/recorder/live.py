"""Records live bouts: hears all streams, draws them and hands them to the archive."""

from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path

import msgspec
import numpy as np
import structlog

from services.recorder.archivist import LEAD_IN, LEAD_OUT, LONG_PAUSE, Archivist
from services.recorder.config import RecorderConfig
from services.recorder.tap import Heard, Tap
from shared.bus.base import Bus
from shared.clock import Clock
from shared.messages.live import ServiceStatus
from shared.policy.action import ACTION_SCHEMA
from shared.policy.observation import OBSERVATION_SCHEMA
from shared.runtime.build import commit
from shared.runtime.rate import Rate
from shared.runtime.service import version
from shared.sim.kinematics import Kinematics
from shared.sim.model import FencingModel
from shared.telemetry.archive import BoutInfo
from shared.telemetry.live import Blade, LiveDrawer, draw_live_scene
from shared.telemetry.live_layout import live_layout
from shared.telemetry.recording import Level, Recording
from shared.telemetry.scene import Scene
from shared.telemetry.streams import ARMS, BATS, GATE, HEART_RATE, REFEREE, TICK, Rows

QUIET_SECONDS = 2.0
"""Without bat states for so long, sampled bouts of training may be shown again."""
LEVELS: dict[str, Level] = {"tripped": "ERROR", "holding": "WARN", "void": "WARN"}

log = structlog.get_logger()

_Piece = dict[str, Rows]
"""Rows by stream."""
Say = Callable[[str, str, Level], None]
"""Adds a line to the log of events: source, text, level."""


class Live:
    """Everything about live bouts; costs nothing while there are none."""

    def __init__(
        self, cfg: RecorderConfig, bus: Bus, clock: Clock, directory: Path, model: FencingModel,
        recording: Recording, scene: Scene, about: BoutInfo, say: Say,
    ) -> None:  # fmt: skip
        """Begin to listen.

        Args:
            cfg: what to record, and how finely.
            bus: where to listen.
            clock: paces.
            directory: folder of the run.
            model: to draw.
            recording: where to draw.
            scene: of ``model``.
            about: what is the same of every bout archived here.
            say: the log of events.
        """
        self._cfg = cfg
        self._clock = clock
        self._recording = recording
        self._scene = scene
        self._say = say
        self._stride = max(1, round(1.0 / (cfg.frames_per_second * scene.control_timestep)))
        self._tap = Tap(bus, clock, scene.control_timestep)
        self._kinematics = Kinematics(model)
        self._shown = LiveDrawer(recording, scene, "live")
        self._filed = LiveDrawer(recording, scene, "file")
        self._blade = Blade(model.bat_back, model.bat_front, model.bat_radius)
        self._archivist = Archivist(cfg, directory, about) if cfg.archive else None
        self._rates = {stream: Rate(clock) for stream in (BATS.name, GATE.name, REFEREE.name)}
        self._rows: list[_Piece] = []
        self._before: deque[_Piece] = deque(maxlen=max(1, round(LEAD_IN / cfg.live_period)))
        """Pieces that the file gets if a bout begins now."""
        self._files_until = -1e9
        self._has_begun = False
        self._due = clock.now()
        self._phase = self._mode = ""
        self._is_recorded = True
        self.rows = 0
        """Drawn since the start, all streams."""

    @property
    def is_on(self) -> bool:
        """Return whether bat states arrive."""
        return self._clock.now() - self._tap.heard_at < QUIET_SECONDS

    def listen(self) -> bool:
        """Take what has arrived; return whether anything has."""
        return self._tap.listen()

    def on_status(self, status: ServiceStatus) -> None:
        """Hear how a process is."""
        if self._has_begun:
            self._tap.add_status(status)

    def tick(self, now: float) -> None:
        """Draw and archive what is due."""
        if self._archivist is not None:
            self._archivist.tick()
        if now < self._due:
            return
        self._due = now + self._cfg.live_period
        heard = self._tap.take()
        if not self._has_begun and BATS.name in heard.rows:
            self._begin()
        self._narrate(heard)
        self._draw(heard, now)
        if self._archivist is not None:
            self._archivist.offer(heard, now)

    def write(self, *, has_room: bool) -> None:
        """Send to the file what was gathered for it.

        Args:
            has_room: whether the file takes more of bouts.
        """
        pieces, self._rows = self._rows, []
        if not has_room:
            return
        for rows in pieces:
            self._filed.curves(rows)
            self._filed.states(rows)
            self._scene_of(self._filed, rows)

    def forget_file(self) -> None:
        """Let go of what was gathered for a file that has ended."""
        self._rows.clear()

    def health(self) -> tuple[dict[str, float], dict[str, int], str]:
        """Return rates, counters and the latest trouble."""
        if not self._has_begun:
            return {}, {}, ""
        rates = {f"{name}_rows_per_s": rate.per_second() for name, rate in self._rates.items()}
        dropped = {f"dropped_{name}": count for name, count in self._tap.dropped.items()}
        counters = {"live_rows": self.rows} | dropped
        if self._archivist is None:
            return rates, counters, ""
        return rates, counters | self._archivist.counters, self._archivist.last_error

    @property
    def bout(self) -> str:
        """Return the bout that is archived now; empty where none is."""
        return self._archivist.bout if self._archivist is not None else ""

    def close(self) -> None:
        """Take, draw and archive the rest, finish every bout's files, stop listening."""
        self._tap.listen()
        self._due = self._clock.now()
        self.tick(self._due)
        if self._archivist is not None:
            self._archivist.close(self._tap.dropped)
        self._tap.close()

    def _begin(self) -> None:
        """The first bat states: from now on the page is that of a live bout."""
        self._has_begun = True
        draw_live_scene(self._recording, self._blade)
        self._recording.arrange(live_layout(self._scene))
        log.info("live_recording_begun")

    def _draw(self, heard: Heard, now: float) -> None:
        if not heard.rows:
            return
        for name, rate in self._rates.items():
            rate.add(len(heard.rows.get(name, ())))
        self.rows += sum(map(len, heard.rows.values()))
        if self._recording.has_file:
            self._gather(heard, now)
        if self._recording.has_live:
            thin = {name: self._thinned(rows) for name, rows in heard.rows.items()}
            thin = {name: rows for name, rows in thin.items() if len(rows)}
            self._shown.curves(thin)
            self._shown.states(heard.rows)
            self._scene_of(self._shown, heard.rows)

    def _gather(self, heard: Heard, now: float) -> None:
        """Keep for the file what belongs to a bout; of the time between, perhaps the heart rate."""
        if self._phase == "running" and self._is_recorded:
            self._files_until = now + LONG_PAUSE
        elif self._phase != "paused":
            self._files_until = min(self._files_until, now + LEAD_OUT)
        if now < self._files_until:
            self._rows += [*self._before, heard.rows]
            self._before.clear()
            return
        if len(self._before) == self._before.maxlen:
            rows = self._before.popleft()
            beats = rows.get(HEART_RATE.name) if self._cfg.heart_between_bouts else None
            if beats is not None:
                self._rows.append({HEART_RATE.name: beats})
        self._before.append(heard.rows)

    def _scene_of(self, drawer: LiveDrawer, rows: dict[str, Rows]) -> None:
        arms, bats = rows.get(ARMS.name), rows.get(BATS.name)
        has_person = False
        if arms is not None and len(arms := self._thinned(arms)):
            joints = np.stack(
                [arms[f"{agent}_joint_positions"] for agent in self._scene.agents], axis=1
            )
            drawer.bodies(arms, *self._kinematics.poses(joints))
            has_person = not arms[f"{self._scene.agents[0]}_is_there"].any()
        if bats is not None and len(bats := self._thinned(bats)):
            drawer.person(bats, is_there=has_person)

    def _thinned(self, rows: Rows) -> Rows:
        """Return as many rows a second as are shown."""
        if TICK not in rows.columns:
            return rows
        return rows.pick(np.flatnonzero(rows[TICK] % self._stride == 0))

    def _narrate(self, heard: Heard) -> None:
        for state in heard.referee:
            self._is_recorded = state.is_recorded
            if state.phase != self._phase:
                self._phase = state.phase
                text = f"bout {state.bout}: {state.phase}" if state.bout else "ready for a bout"
                if state.phase == "running" and not state.step:
                    text += f", {_short(state.antagonist)} v {_short(state.protagonist)}"
                elif state.bout and state.is_recorded:
                    text += f" after {state.step} steps, score {state.score:+.0f}"
                reason = f" ({state.reason})" if state.reason else ""
                self._say("referee", text + reason, LEVELS.get(state.phase, "INFO"))
        if (gate := heard.rows.get(GATE.name)) is None:
            return
        for mode, reason in zip(gate["mode"].tolist(), gate["reason"].tolist(), strict=True):
            if mode != self._mode:
                self._mode = mode
                why = f": {reason}" if reason else ""
                self._say("gate", f"gate {mode}{why}", LEVELS.get(mode, "INFO"))


def about_of(
    directory: Path, model: FencingModel, sections: Mapping[str, msgspec.Struct], site_hash: str
) -> BoutInfo:
    """Return what is the same of every bout archived by one process.

    Args:
        directory: folder of the run.
        model: the simulator's.
        sections: of the site, as resolved.
        site_hash: of the site file and the command line.
    """
    return BoutInfo(
        bout="", antagonist="", protagonist="", started_at_ns=0,
        run=directory.resolve().name, version=version(), commit=commit(), model=model.hash,
        observation_schema=OBSERVATION_SCHEMA, action_schema=ACTION_SCHEMA, site=site_hash,
        control_timestep=model.cfg.control_timestep,
        sections={name: msgspec.to_builtins(section) for name, section in sections.items()},
    )  # fmt: skip


def _short(player: str) -> str:
    kind, _, rest = player.partition(":")
    return rest[:8] if kind == "sha256" else rest or player

"""A recording of a run: what is logged under which path, into a file and to live viewers.

Every entity path of Riposte is in this file. Timelines: ``wall_time`` (timestamp) is on every
row; a bout's rows are also on ``control_step`` (sequence) and ``bout_time`` (duration), on which
the recorded bouts lie end to end; learning curves are also on ``total_samples`` (sequence).

Three Rerun streams with one recording id carry it, and a viewer merges them: the file, in large
chunks; the live bout, of which the server forgets the oldest part; the live curves, which it
keeps, so that who opens the page late sees the whole run's curves. Nothing here waits.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import rerun as rr

from shared.telemetry.rrd import RecordingFile, compact

APPLICATION = "riposte"
Level = Literal["INFO", "WARN", "ERROR"]

WALL_TIME = "wall_time"
CONTROL_STEP = "control_step"
BOUT_TIME = "bout_time"
TOTAL_SAMPLES = "total_samples"

SCENE = "bout/scene"
POSES = "bout/scene/poses"
"""Every row names the body whose frame it places in the scene."""
TARGET = "bout/scene/target"
BOUT_SCORE = "bout/score"
BOUT_PLAYERS = "bout/players"
EVENTS = "bout/events"
CONTACT = "bout/events/bats"
SCORE = "training/score"
TRAINING = "training"
THROUGHPUT = "training/throughput"
LEAGUE = "league"
LEAGUE_STATE = "league/state"
VERSIONS = "league/version"
SERVICES = "services"
LOG = "log"
PAYOFF = "tournament/payoff"
RATINGS = "tournament/ratings"
STANDINGS = "tournament/standings"
FLUSH_SECONDS = 0.05
"""How long a flush waits for a slow disk; what is not written by then is written later."""
FILE_HOLD = 10.0
"""Seconds that rows for the file are gathered at most, unless it is flushed: few, large chunks."""
LEARNING_CURVES = ("approx_kl", "clip_fraction", "explained_variance", "policy_lag_mean")
"""Drawn for each agent."""


def shape_path(body: str, shape: str) -> str:
    """Return the entity of a shape that is fixed to a body, ``<agent>/<part>``."""
    return f"{SCENE}/{body}/{shape.rsplit('/', 1)[-1]}"


def in_target_path(agent: str) -> str:
    """Return the entity that says when an agent's bat is inside the target."""
    return f"{EVENTS}/{agent}"


def joint_path(agent: str, joint: str) -> str:
    """Return the entity of a joint's angle (rad)."""
    return f"bout/{agent}/joint/{joint}/position"


def score_path(agent: str) -> str:
    """Return the score curve of the stages in which ``agent`` learns: mean, low, high."""
    return f"{SCORE}/{agent}"


def training_path(metric: str, agent: str) -> str:
    """Return a learning curve: ``approx_kl`` of the antagonist, say."""
    return f"{TRAINING}/{metric}/{agent}"


def version_path(agent: str) -> str:
    """Return the entity of an agent's newest version in the ledger."""
    return f"{VERSIONS}/{agent}"


def service_path(quantity: str, name: str) -> str:
    """Return a quantity of a process: ``cpu_percent`` of actor-0, say."""
    return f"{SERVICES}/{quantity}/{name}"


def log_path(source: str) -> str:
    """Return the event log of a source."""
    return f"{LOG}/{source}"


@dataclasses.dataclass(frozen=True)
class LivePorts:
    """Where live viewers connect."""

    bout: int
    curves: int
    host: str = "127.0.0.1"
    bout_memory: str = "192MiB"
    """The server forgets the oldest frames above this."""
    curves_memory: str = "128MiB"

    @property
    def urls(self) -> tuple[str, str]:
        """Return what a viewer must open, both."""
        return self._url(self.curves), self._url(self.bout)

    def _url(self, port: int) -> str:
        return f"rerun+http://{self.host}:{port}/proxy"


class Recording:
    """Writes one recording; a file that fails is given up, the live view goes on."""

    def __init__(
        self,
        recording_id: str,
        file: Path | None,
        live: LivePorts | None,
        blueprint: Any,
        name: str = "",
    ) -> None:
        """Open the file and the ports.

        Raises:
            OSError: the file cannot be made.
        """
        self.file_error = ""
        """Why the file ended before the run did; empty while it is written."""
        self._file: RecordingFile | None = None
        self._file_stream: rr.RecordingStream | None = None
        self._file_bytes: rr.BinaryStream | None = None
        self._curves: rr.RecordingStream | None = None
        self._bout: rr.RecordingStream | None = None
        if file is not None:
            self._file = RecordingFile(file)
            self._file_stream = _stream(recording_id, FILE_HOLD)
            self._file_bytes = self._file_stream.binary_stream()
            if blueprint is not None:
                self._file_stream.send_blueprint(blueprint)
        if live is not None:
            self._curves, self._bout = _stream(recording_id), _stream(recording_id)
            self._curves.set_sinks(
                rr.GrpcServerSink(
                    bind_ip=live.host,
                    port=live.curves,
                    server_memory_limit=live.curves_memory,
                    newest_first=True,
                ),
                default_blueprint=blueprint,
            )
            self._bout.set_sinks(
                rr.GrpcServerSink(
                    bind_ip=live.host,
                    port=live.bout,
                    server_memory_limit=live.bout_memory,
                    newest_first=True,
                ),
                default_blueprint=blueprint,
            )
        for stream in self._both(self._curves):
            stream.send_recording_name(name or recording_id)

    def arrange(self, blueprint: Any) -> None:
        """Lay the page out anew, for every viewer."""
        streams = (self._file_stream, self._curves, self._bout)
        for stream in (stream for stream in streams if stream is not None):
            stream.send_blueprint(blueprint)

    def static(self, path: str, *archetypes: Any) -> None:
        """Log what never changes, for every viewer."""
        for stream in self._both(self._curves):
            stream.log(path, *archetypes, static=True)

    def curve(
        self, path: str, values: float | Sequence[float], wall_ns: int, samples: int | None = None
    ) -> None:
        """Log one point of a curve, or of several that share a path."""
        self._log(path, rr.Scalars(values), wall_ns, samples)

    def end_curve(self, path: str, wall_ns: int) -> None:
        """Let a curve's next point not be joined to its last one."""
        self._log(path, rr.Clear(recursive=False), wall_ns)

    def document(self, path: str, markdown: str, wall_ns: int) -> None:
        """Replace a text."""
        text = rr.TextDocument(markdown, media_type=rr.MediaType.MARKDOWN)
        self._log(path, text, wall_ns)

    def event(self, source: str, text: str, wall_ns: int, level: Level = "INFO") -> None:
        """Add a line to the event log."""
        self._log(log_path(source), rr.TextLog(text, level=level), wall_ns)

    def columns(
        self, to: Literal["file", "live"], path: str, times: list[rr.TimeColumn], columns: Any
    ) -> None:
        """Send rows of the shown bout, one chunk, to the file or to live viewers."""
        stream = self._file_stream if to == "file" else self._bout
        if stream is not None:
            stream.send_columns(path, indexes=times, columns=columns)

    def flush(self, timeout: float = FLUSH_SECONDS) -> None:
        """Write to the file what was logged; it is gathered in memory until then."""
        if self._file is None or self._file_bytes is None:
            return
        try:
            stream = self._file_bytes.read(flush_timeout_sec=timeout)
        except RuntimeError:
            return  # not encoded in time: the next flush has it
        if stream:
            try:
                self._file.write(stream)
            except OSError as error:
                self.give_up_file(error.strerror or str(error))

    def give_up_file(self, reason: str) -> None:
        """End the file here, whole, because it cannot or must not grow further."""
        if self._file is not None:
            self.file_error = reason
            self._end_file()

    def close(self, timeout: float = 2.0) -> None:
        """Write the rest to the file, compact it, and let the live viewers go."""
        self.flush(timeout)
        if self._file is not None:
            path, size = self._file.path, self._file.size
            self._end_file()
            if size:
                compact(path)
        for stream in (self._curves, self._bout):
            if stream is not None:
                stream.disconnect()
        self._curves = self._bout = None

    @property
    def file_size(self) -> int:
        """Return how many bytes the file has."""
        return self._file.size if self._file is not None else 0

    @property
    def has_live(self) -> bool:
        """Return whether live viewers can connect."""
        return self._bout is not None

    @property
    def has_file(self) -> bool:
        """Return whether the file is still written."""
        return self._file_stream is not None

    def _end_file(self) -> None:
        if self._file is not None:
            self._file.close()
        if self._file_stream is not None:
            self._file_stream.disconnect()
        self._file = self._file_stream = self._file_bytes = None

    def _log(self, path: str, archetype: Any, wall_ns: int, samples: int | None = None) -> None:
        for stream in self._both(self._curves):
            stream.set_time(WALL_TIME, timestamp=np.datetime64(wall_ns, "ns"))
            if samples is None:
                stream.disable_timeline(TOTAL_SAMPLES)
            else:
                stream.set_time(TOTAL_SAMPLES, sequence=samples)
            stream.log(path, archetype)

    def _both(self, live: rr.RecordingStream | None) -> list[rr.RecordingStream]:
        return [stream for stream in (self._file_stream, live) if stream is not None]


def _stream(recording_id: str, hold_seconds: float = 0.2) -> rr.RecordingStream:
    """Return a stream that gathers rows of one entity for so long before it sends them on."""
    batching = rr.ChunkBatcherConfig(flush_tick=hold_seconds)
    return rr.RecordingStream(APPLICATION, recording_id=recording_id, batcher_config=batching)

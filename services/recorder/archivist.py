"""Archives live bouts: journals while they go on, finished files after they have ended."""

import re
import shutil
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
import structlog

from services.recorder.config import RecorderConfig
from services.recorder.tap import Heard
from shared.errors import RiposteError
from shared.messages.play import RefereeState
from shared.runtime.files import MIB, atomic_write
from shared.runtime.process import release_memory
from shared.telemetry.archive import (
    FINISHED,
    INFO_FILE,
    JOURNAL,
    BoutInfo,
    Journal,
    Outcome,
    StreamInfo,
    archived_bouts,
    missing_ticks,
    parquet_of,
    read_info,
    read_journal,
    release_buffers,
)
from shared.telemetry.streams import BY_NAME, REFEREE, TICK, TIME, Rows

LEAD_IN = 1.0
"""Seconds before a bout that are archived with it: how the bats came to where they start."""
LEAD_OUT = 0.5
"""Seconds after it."""
LONG_PAUSE = 5.0
"""A bout that pauses for longer is not archived further until it goes on (s)."""
SILENCE = 5.0
"""A bout of which the referee says nothing for longer is over (s)."""
IN_BOUT = ("running", "paused")

log = structlog.get_logger()


class _Piece(NamedTuple):
    """What was said in one stretch."""

    serial: int
    at: float
    """When it ended (s)."""
    rows: dict[str, Rows]
    dropped: dict[str, int]
    """Of each stream, before it."""


class _Bout:
    """A bout that is being archived."""

    def __init__(self, folder: Path, info: BoutInfo, dropped: dict[str, int], serial: int) -> None:
        self.folder = folder
        self.info = info
        self.dropped = dropped
        """Of each stream before it began."""
        self.next_serial = serial
        """Of the first piece that it has not got."""
        self.journals: dict[str, Journal] = {}
        self.pending: list[dict[str, Rows]] = []
        self.last: RefereeState | None = None
        self.paused_at: float | None = None
        self.ends_at: float | None = None

    def write(self) -> None:
        """Bring what waits into the journals.

        Raises:
            OSError: the disk is full or gone.
        """
        pieces, self.pending = self.pending, []
        for name, stream in BY_NAME.items():
            parts = [piece[name] for piece in pieces if name in piece]
            if not parts:
                continue
            if name not in self.journals:
                self.journals[name] = Journal(self.folder, stream)
            self.journals[name].write(Rows.join(parts))

    def close(self) -> None:
        for journal in self.journals.values():
            journal.close()


class Archivist:
    """Follows the referee from bout to bout; one piece of work at a time, none of them long."""

    def __init__(self, cfg: RecorderConfig, directory: Path, about: BoutInfo) -> None:
        """Look for bouts that a killed recorder left behind, to be finished bit by bit.

        Args:
            cfg: how often, and how much room the disk must have.
            directory: folder of the run.
            about: what is the same for every bout of this process.
        """
        self._cfg = cfg
        self._folder = directory / "bouts"
        self._about = about
        self._bout: _Bout | None = None
        self._ring: deque[_Piece] = deque()
        self._dropped: dict[str, int] = {}
        """Of each stream, at the latest piece."""
        self._serial = 0
        self._given_up = ""
        """A bout that cannot be archived, or no further."""
        self._write_due = 0.0
        self._work: deque[Iterator[None]] = deque()
        self.counters = {"bouts_archived": 0, "bouts_unarchived": 0, "archive_bytes": 0}
        self.last_error = ""
        self._find_unfinished(directory)

    @property
    def bout(self) -> str:
        """Return the name of the bout that is archived now; empty between bouts."""
        return self._bout.info.bout if self._bout is not None else ""

    def offer(self, heard: Heard, now: float) -> None:
        """Take what was said since the last call.

        Args:
            heard: rows of all streams.
            now: the monotonic clock (s).
        """
        self._ring.append(_Piece(self._serial, now, heard.rows, self._dropped))
        self._serial += 1
        self._dropped = heard.dropped
        while self._ring[0].at < now - LEAD_IN:
            self._ring.popleft()
        for state in heard.referee:
            self._follow(state, heard, now)
        bout = self._bout
        if bout is None:
            return
        if now - heard.referee_at > SILENCE and bout.ends_at is None:
            self._end(bout, "interrupted", "the referee fell silent", now)
        is_asleep = bout.paused_at is not None and now - bout.paused_at > LONG_PAUSE
        if not is_asleep:
            fresh = (piece for piece in self._ring if piece.serial >= bout.next_serial)
            bout.pending += [piece.rows for piece in fresh]
            bout.next_serial = self._serial
        if now >= self._write_due:
            self._write_due = now + self._cfg.archive_period
            self._write(bout)
        if bout.ends_at is not None and now >= bout.ends_at:
            self._finish(bout, heard.dropped)

    def tick(self) -> None:
        """Do a little of the work on bouts that have ended: at most one file."""
        if self._work:
            try:
                next(self._work[0])
            except StopIteration:
                self._work.popleft()
            except (OSError, RiposteError) as error:
                self._work.popleft()
                self._note_error(error)

    def close(self, dropped: dict[str, int]) -> None:
        """Finish everything."""
        if (bout := self._bout) is not None:
            if bout.ends_at is None:
                self._end(bout, "interrupted", "the recorder was stopped", 0.0)
            self._finish(bout, dropped)
        while self._work:
            self.tick()

    def _follow(self, state: RefereeState, heard: Heard, now: float) -> None:
        """Begin, go on with or end a bout, as the referee says."""
        bout = self._bout
        is_own = bout is not None and bout.info.bout == state.bout and bout.ends_at is None
        begins = state.phase in IN_BOUT and state.is_recorded and not is_own
        if bout is not None and not is_own and bout.ends_at is None:
            self._end(bout, "interrupted", "the referee was restarted", now)
        if begins and state.bout != self._given_up:
            if bout is not None:
                self._finish(bout, heard.dropped)
            bout = self._begin(state, heard)
        elif not is_own:
            return
        if bout is None:
            return
        bout.last = state
        if state.phase == "paused":
            bout.paused_at = now if bout.paused_at is None else bout.paused_at
        else:
            bout.paused_at = None
        if state.phase in ("finished", "void"):
            self._end(bout, state.phase, state.reason, now)

    def _begin(self, state: RefereeState, heard: Heard) -> _Bout | None:
        self._bout = None
        said = heard.rows[REFEREE.name]
        info = msgspec.structs.replace(
            self._about,
            bout=state.bout,
            antagonist=state.antagonist,
            protagonist=state.protagonist,
            from_step=state.step,
            started_at_ns=int(said[TIME][said["bout"] == state.bout][0]),
            robot_io_boot=heard.boot,
        )
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            free = shutil.disk_usage(self._folder).free
            if free < self._cfg.min_free_mib * MIB:
                raise RiposteError(
                    f"bout {state.bout} is not archived: {free // MIB} MiB free, "
                    f"{self._cfg.min_free_mib} MiB are kept free"
                )
            folder = _new_folder(self._folder, state.bout)
            atomic_write(folder / INFO_FILE, _json(info))
        except (OSError, RiposteError) as error:
            self._given_up = state.bout
            self._note_error(error)
            return None
        oldest = self._ring[0]
        self._bout = _Bout(folder, info, oldest.dropped, oldest.serial)
        self._write_due = 0.0
        log.info("archive_begun", bout=state.bout, folder=str(folder))
        return self._bout

    def _write(self, bout: _Bout) -> None:
        try:
            bout.write()
        except OSError as error:
            bout.close()
            self._bout, self._given_up = None, bout.info.bout
            self._note_error(
                RiposteError(f"the archive of bout {bout.info.bout} ended early: {error.strerror}")
            )

    def _end(self, bout: _Bout, outcome: Outcome, reason: str, now: float) -> None:
        bout.info = msgspec.structs.replace(bout.info, outcome=outcome, reason=reason)
        bout.ends_at = now + LEAD_OUT

    def _finish(self, bout: _Bout, dropped: dict[str, int]) -> None:
        """Let a bout that has ended become files, one after the other."""
        self._write(bout)
        if self._bout is None:
            return
        self._bout = None
        bout.close()
        info, last = bout.info, bout.last
        if last is not None:
            info = msgspec.structs.replace(
                info,
                score=last.score,
                steps=last.step,
                attack_steps=last.attack_steps,
                penalty_steps=last.penalty_steps,
                camping_steps=last.camping_steps,
                missed_ticks=last.missed_ticks,
            )
        lost = {name: count - bout.dropped.get(name, 0) for name, count in dropped.items()}
        self._work.append(self._file(bout.folder, info, lost))

    def _file(self, folder: Path, info: BoutInfo, lost: dict[str, int]) -> Iterator[None]:
        """Turn the journals of a folder into finished files; stops after each of them.

        The journals go last: killed before, it is all done once more, with the same result.
        """
        counts: dict[str, StreamInfo] = {}
        found: dict[str, Rows] = {}
        for name, stream in BY_NAME.items():
            path = folder / f"{name}{JOURNAL}"
            if path.exists() and (rows := read_journal(path, stream)) is not None:
                found[name] = rows
                if stream is REFEREE:  # what it said before the bout is no part of its rate
                    rows = rows.pick(rows["bout"] == info.bout)
                counts[name] = _count(rows, lost.get(name, 0), has_tick=stream.has_tick)
        ended = max((int(rows[TIME].max()) for rows in found.values()), default=info.started_at_ns)
        info = msgspec.structs.replace(info, ended_at_ns=ended, streams=counts)
        yield
        for name, rows in found.items():
            made = parquet_of(BY_NAME[name], rows, info)
            atomic_write(folder / f"{name}{FINISHED}", made)
            self.counters["archive_bytes"] += len(made)
            yield
        atomic_write(folder / INFO_FILE, _json(info))
        _remove_journals(folder)
        self.counters["bouts_archived"] += 1
        log.info(
            "bout_archived",
            bout=info.bout,
            folder=str(folder),
            outcome=info.outcome,
            score=info.score,
            dropped=sum(lost.values()),
        )
        yield
        release_buffers()
        release_memory()

    def _find_unfinished(self, directory: Path) -> None:
        try:
            found = archived_bouts(directory)
        except RiposteError as error:
            self._note_error(error)
            return
        for folder in found:
            info = read_info(folder)
            if info.outcome == "running":
                self._work.append(self._mend(folder, info))
            else:
                _remove_journals(folder)

    def _mend(self, folder: Path, info: BoutInfo) -> Iterator[None]:
        """Finish a bout whose recorder was killed."""
        journal = folder / f"{REFEREE.name}{JOURNAL}"
        rows = read_journal(journal, REFEREE) if journal.exists() else None
        outcome: Outcome = "interrupted"
        reason = "the recorder was killed"
        if rows is not None:
            own = rows.pick(rows["bout"] == info.bout)
            if len(own):
                last = {name: own[name][-1] for name in own.columns}
                if last["phase"] in ("finished", "void"):
                    outcome, reason = last["phase"], str(last["reason"])
                counted = ("attack_steps", "penalty_steps", "camping_steps", "missed_ticks")
                info = msgspec.structs.replace(
                    info,
                    score=float(last["score"]),
                    steps=int(last["step"]),
                    **{name: int(last[name]) for name in counted},
                )
        info = msgspec.structs.replace(info, outcome=outcome, reason=reason)
        log.warning("archive_mended", folder=str(folder), outcome=outcome)
        yield from self._file(folder, info, {})

    def _note_error(self, error: Exception) -> None:
        self.counters["bouts_unarchived"] += 1
        self.last_error = str(error)
        log.warning("archive_failed", reason=str(error))


def _remove_journals(folder: Path) -> None:
    """Delete what finished files were made from."""
    for path in folder.glob(f"*{JOURNAL}"):
        path.unlink(missing_ok=True)


def _count(rows: Rows, dropped: int, *, has_tick: bool) -> StreamInfo:
    seconds = 1e-9 * float(np.ptp(rows[TIME])) if len(rows) else 0.0
    return StreamInfo(
        rows=len(rows),
        dropped=dropped,
        missing=missing_ticks(rows[TICK]) if has_tick else 0,
        rate_hz=round((len(rows) - 1) / seconds, 3) if seconds > 0.0 else 0.0,
    )


def _new_folder(parent: Path, bout: str) -> Path:
    """Make a folder for a bout; a name that is taken gets a number.

    Raises:
        OSError: it cannot be made.
    """
    plain = re.sub(r"[^A-Za-z0-9_-]+", "-", bout).strip("-")[:64] or "bout"
    for number in range(1, 100_000):
        folder = parent / (plain if number == 1 else f"{plain}-{number}")
        try:
            folder.mkdir()
        except FileExistsError:
            continue
        return folder
    raise OSError(f"there are too many bouts called {plain} in {parent}")


def _json(info: BoutInfo) -> bytes:
    return msgspec.json.format(msgspec.json.encode(info), indent=2)

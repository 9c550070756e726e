"""What a match has left: every stream read back from its .rrd and its archive, and counted."""

import dataclasses
import json
from collections import defaultdict
from pathlib import Path

import msgspec
import numpy as np
from rerun.chunk import RrdReader

from shared.game.recount import recount
from shared.game.rules import RuleBook
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig
from shared.telemetry.archive import ArchivedBout, archived_bouts, load_bout
from shared.telemetry.live import SERIES, Series
from shared.telemetry.rrd import recordings
from shared.telemetry.streams import Rows

LOOP = ("bats", "arms", "robot", "gate", "protagonist_offsets", "tracker_raw")
"""Streams with a row for every tick of robot_io."""
OPPOSITE_A_PERSON = ("antagonist_offsets", "tracker")
"""Streams that nobody feeds: the person has no policy, and no page's pointer."""


def is_drawn(series: Series) -> bool:
    """Return whether a robot and a person with a Vive have this."""
    is_second_robot = series.only_with == "antagonist_is_there"
    return series.stream not in OPPOSITE_A_PERSON and not is_second_robot


@dataclasses.dataclass(frozen=True)
class Recorded:
    """A bout, in both records."""

    bout: ArchivedBout
    drawn: dict[str, np.ndarray]
    """Wall clock (ns) of every row of the .rrd within the bout, by entity."""

    @property
    def span(self) -> tuple[int, int]:
        """Return first and last instant judged (ns wall clock)."""
        return span_of(self.bout)

    @property
    def seconds(self) -> float:
        """Return how long it lasted on the wall."""
        begin, end = self.span
        return 1e-9 * (end - begin)

    def within(self, stream: str) -> Rows:
        """Return the archived rows of the bout itself; the archive begins a little before it."""
        rows = self.bout.streams[stream]
        begin, end = self.span
        return rows.pick((rows["t_ns"] >= begin) & (rows["t_ns"] <= end))

    def rate(self, path: str) -> float:
        """Return the rows a second of an entity of the .rrd, from its first to its last."""
        times = self.drawn[path]
        return float(1e9 * (len(times) - 1) / np.ptp(times)) if len(times) > 1 else 0.0

    def ticks(self) -> tuple[int, int]:
        """Return how many ticks the loop had in the bout, and how many of those it lost."""
        ticks = self.within("bats")["tick"]
        whole = int(np.ptp(ticks)) + 1
        return whole, whole - len(ticks)

    def recounted(self) -> tuple[float, int]:
        """Return the score and the steps by the rule book, from the archived poses alone."""
        sim = SimConfig()
        rules = msgspec.convert(self.bout.info.sections["game"], RuleBook)
        scores = recount(self.bout, rules, bat_of(sim), target_of(sim))
        return float(scores.score[0]), int(scores.step[0])

    def loop_counters(self) -> dict[str, float]:
        """Return what robot_io itself has counted by the end of the bout."""
        services = self.bout.streams["services"]
        return json.loads(services["counters"][services["name"] == "robot-io-0"][-1])


def recorded(folder: Path) -> list[Recorded]:
    """Return the bouts of a match, oldest first."""
    found: dict[str, list[np.ndarray]] = defaultdict(list)
    for path in recordings(folder):
        for chunk in RrdReader(path).stream():
            if not chunk.is_static:
                times = chunk.to_record_batch().column("wall_time").cast("int64")
                found[chunk.entity_path.removeprefix("/")].append(times.to_numpy())
    drawn = {path: np.sort(np.concatenate(parts)) for path, parts in found.items()}
    made: list[Recorded] = []
    for folder_of_bout in archived_bouts(folder):
        bout = load_bout(folder_of_bout)
        begin, end = span_of(bout)
        within = {
            path: times[(times >= begin) & (times <= end)] for path, times in drawn.items()
        }  # fmt: skip
        made.append(Recorded(bout, within))
    return made


def span_of(bout: ArchivedBout) -> tuple[int, int]:
    """Return when a bout was started and when its last step was judged (ns wall clock)."""
    said = bout.streams["referee"]
    own = (said["bout"] == bout.info.bout) & (said["step"] <= bout.info.steps)
    steps = said["step"][own]
    last = int(np.argmax(steps == bout.info.steps))
    return bout.info.started_at_ns, int(said["t_ns"][own][last])


def series_drawn() -> list[Series]:
    """Return all that must be in the .rrd."""
    return [series for series in SERIES if is_drawn(series)]

"""Settings of the recorder, section ``[recorder]`` of a site file."""

import msgspec

from shared.config.ranges import check_range


class RecorderConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is recorded, how finely, and where it is shown."""

    file: bool = True
    """Write recording.rrd into the run's folder."""
    live: bool = True
    """Offer the live web view."""
    web_port: int = 9090
    """Port of the live view's page; another one is taken where it is in use."""
    frames_per_second: float = 25.0
    """Instants of the shown bout per second of the bout."""
    live_period: float = 0.25
    """Seconds from one batch of the live bout to the next."""
    heart_between_bouts: bool = True
    """Whether the file has the heart rate of the time between bouts; a study's session never."""
    file_period: float = 5.0
    """Seconds from one write to the file to the next; a kill loses at most this much."""
    archive: bool = True
    """Write live bouts into the run's folder as Parquet."""
    archive_period: float = 1.0
    """Seconds from one write of a live bout to the next; a kill loses this and ``live_period``."""
    status_period: float = 5.0
    """Seconds from one point of a service's health curve to the next."""
    bout_steps: int = 2000
    """Control steps of a whole bout."""
    bout_memory_mib: int = 192
    """What the live view's server keeps of the bouts shown; the oldest part goes first."""
    file_bouts_mib: int = 1024
    """The file gets no more bouts above this size, only curves and events."""
    min_free_mib: int = 256
    """The file ends, and no bout is archived, when the disk has less than this left."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        check_range("recorder.web_port", self.web_port, 0, 65535)
        check_range("recorder.frames_per_second", self.frames_per_second, 1.0, 100.0)
        check_range("recorder.live_period", self.live_period, 0.05, 5.0)
        check_range("recorder.file_period", self.file_period, 0.1, 60.0)
        check_range("recorder.archive_period", self.archive_period, 0.1, 60.0)
        check_range("recorder.status_period", self.status_period, 0.5, 60.0)
        check_range("recorder.bout_steps", self.bout_steps, 1, 1_000_000)
        check_range("recorder.bout_memory_mib", self.bout_memory_mib, 16, 65536)
        check_range("recorder.file_bouts_mib", self.file_bouts_mib, 0, 1 << 20)
        check_range("recorder.min_free_mib", self.min_free_mib, 0, 1 << 20)

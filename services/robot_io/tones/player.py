"""``python -m services.robot_io.tones.player``: a tone on a sound card, in a process of its own.

PortAudio and what lies below it are native code that may hang or abort on a broken set-up, and
Python that fills sound buffers competes with Python that moves a robot. So robot_io starts this
as a child: it reads tones from stdin (float64, Hz; 0 for silence) and writes a line of JSON about
itself to stdout. Without a word from robot_io it falls silent, and at the end of stdin it ends.
"""

import os
import signal
import struct
import sys
import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import msgspec

from services.robot_io.tones.synth import Samples, ToneSynth
from services.robot_io.tones.tones import TonesConfig

if TYPE_CHECKING:
    import sounddevice

WORD = struct.Struct("<d")
"""A tone on its way: Hz."""
REPORT_SECONDS = 0.25
FORGET_SECONDS = 0.5
"""A tone that nobody has confirmed for so long ends."""
SILENT_SECONDS = 3.0
"""A stream that has not asked for samples for so long is dead."""
UNDERRUNS = 4
COUNT_SECONDS = 10.0
"""So many late blocks in so long: the card gets twice as much ahead."""
MAX_LATENCY = 0.16
FADE_SECONDS = 0.03


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """What the player says of itself."""

    problem: str = ""
    """Why nothing sounds; empty when it would."""
    latency_ms: float = 0.0
    """As the card reports it; 0 without a card."""
    underruns: int = 0
    """Blocks that came too late."""
    streams: int = 0
    """Times that a card was opened."""


class Player:
    """Sounds what it is told until it is told to end."""

    def __init__(self, cfg: TonesConfig) -> None:
        self._cfg = cfg
        self._ahead = cfg.latency
        self._hz = 0.0
        self._told_at = 0.0
        self._asked_at = 0.0
        self._report = Report(problem="opening the sound card")
        self._underruns = 0
        self._stop = threading.Event()

    def listen(self) -> None:
        """Take tones from stdin until it ends; runs on a thread of its own."""
        while len(words := os.read(0, 64 * WORD.size)) >= WORD.size:
            whole = len(words) // WORD.size * WORD.size
            (self._hz,) = WORD.unpack_from(words, whole - WORD.size)
            self._told_at = time.monotonic()
        self._stop.set()

    def run(self) -> None:
        """Keep a card open until stdin ends."""
        try:
            import sounddevice
        except (ImportError, OSError) as error:  # OSError: no libportaudio
            advice = "`pip install riposte[play]`, `apt install libportaudio2`"
            self.say(problem=f"{error}; {advice}", latency_ms=0.0)
            self._stop.wait()
            return
        while not self._stop.is_set():
            try:
                self._sound()
                continue
            except (sounddevice.PortAudioError, ValueError, OSError) as error:
                text = " ".join(str(error).split(" [PaErrorCode")[0].split()).rstrip(".")
                advice = "plug a sound card in, or set tones.sink = 'null'"
                self.say(problem=f"{text}; {advice}", latency_ms=0.0)
            if not self._stop.wait(self._cfg.retry):
                # What PortAudio knows of devices is as old as its start.
                sounddevice._terminate()  # pyright: ignore[reportPrivateUsage]
                sounddevice._initialize()  # pyright: ignore[reportPrivateUsage]

    def _sound(self) -> None:
        """Sound until told to end, or until the card needs more ahead.

        Raises:
            PortAudioError: the card cannot be opened.
            OSError: it went away.
            ValueError: no device has that name, or several have.
        """
        import sounddevice

        device = self._cfg.device or None
        channels = min(int(sounddevice.query_devices(device, "output")["max_output_channels"]), 2)
        synth: ToneSynth | None = None

        def fill(
            out: Samples, frames: int, _time: object, status: sounddevice.CallbackFlags
        ) -> None:
            assert synth is not None  # the stream starts after it is made
            now = self._asked_at = time.monotonic()
            self._underruns += bool(status.output_underflow)
            hz = self._hz if now - self._told_at < FORGET_SECONDS else 0.0
            out[:] = synth.render(frames, hz)[:, None]

        stream = sounddevice.OutputStream(
            device=device, channels=channels, dtype="float32", latency=self._ahead, callback=fill
        )
        try:
            synth = ToneSynth(stream.samplerate, self._cfg.volume)
            self._asked_at = time.monotonic()
            stream.start()
            self.say(problem="", latency_ms=1e3 * stream.latency, streams=self._report.streams + 1)
            self._watch(stream)
        finally:
            stream.abort()
            stream.close()

    def _watch(self, stream: "sounddevice.OutputStream") -> None:
        before, since = self._underruns, time.monotonic()
        while not self._stop.wait(REPORT_SECONDS):
            now = time.monotonic()
            if not stream.active or now - self._asked_at > SILENT_SECONDS:
                raise OSError("the sound card went away")
            late = self._underruns - before
            if late >= UNDERRUNS and self._ahead < MAX_LATENCY:
                self._ahead = min(2.0 * self._ahead, MAX_LATENCY)
                return
            if now - since > COUNT_SECONDS:
                before, since = before + late, now
            self.say()
        self._hz = 0.0
        time.sleep(FADE_SECONDS)

    def say(self, **changed: object) -> None:
        """Write what has changed; nobody reads it where nothing has."""
        report = msgspec.structs.replace(self._report, underruns=self._underruns, **changed)
        if report == self._report:
            return
        self._report = report
        try:
            os.write(1, msgspec.json.encode(report) + b"\n")
        except OSError:  # robot_io is gone, and stdin says so too
            self._stop.set()


def main(argv: Sequence[str] | None = None) -> int:
    """Sound tones until stdin ends; the only argument is the section ``[tones]`` as JSON."""
    (text,) = sys.argv[1:] if argv is None else argv
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # ^C is for robot_io, which then closes stdin
    player = Player(msgspec.json.decode(text, type=TonesConfig))
    threading.Thread(target=player.listen, name="listen", daemon=True).start()
    try:
        player.run()
    except Exception as error:  # the edge of the process, whose stderr nobody reads
        player.say(problem=f"bug: {type(error).__name__}: {error}".splitlines()[0], latency_ms=0.0)
        raise
    return 0


if __name__ == "__main__":
    sys.exit(main())

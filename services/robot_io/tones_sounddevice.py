"""Tones on a sound card, through PortAudio; a thread opens it and watches over it.

PortAudio calls for samples on a thread of its own; ``play`` only sets the number that the next
block is made from. A card that is missing, or goes away, is looked for again every few seconds.
"""

import threading
import time
from typing import TYPE_CHECKING

import structlog

from services.robot_io.tones_synth import Samples, ToneSynth
from shared.clock import Clock

if TYPE_CHECKING:
    import sounddevice

WATCH_SECONDS = 0.25
SILENT_SECONDS = 1.5
"""A stream that has not asked for samples for so long is dead."""
FADE_SECONDS = 0.03
CLOSE_SECONDS = 3.0
"""Longest wait for the card to be let go; a thread that hangs in it is left behind."""

log = structlog.get_logger()


class SoundCard:
    """A tone that sounds until it is changed."""

    def __init__(self, device: str, volume: float, retry: float, clock: Clock) -> None:
        """Start the thread.

        Args:
            device: part of the device's name; empty for the default.
            volume: of the tone at full loudness, 0 to 1.
            retry: wait before a missing card is looked for again (s).
            clock: a clock that moves by itself and may be read from any thread.
        """
        self._device = device
        self._volume = volume
        self._retry = retry
        self._clock = clock
        self._hz = 0.0
        self._asked_at = 0.0
        self._latency = 0.0
        self._counts = {"tone_underruns": 0, "tone_streams": 0}
        self._problem = "opening the sound card"
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._work, name="tones", daemon=True)
        self._thread.start()

    def play(self, hz: float) -> None:
        """Sound a tone from the next block on; 0 for silence."""
        self._hz = hz

    def rates(self) -> dict[str, float]:
        """Return the latency that the card reports (ms)."""
        return {"tone_latency_ms": 1e3 * self._latency} if self._latency else {}

    def counters(self) -> dict[str, int]:
        """Return streams opened, and blocks that came too late."""
        return dict(self._counts)

    @property
    def problem(self) -> str:
        """Return why nothing sounds; empty when it would."""
        return self._problem

    def close(self) -> None:
        """Fall silent and let go of the card, in ``CLOSE_SECONDS`` at most."""
        self._hz = 0.0
        self._stop.set()
        self._thread.join(CLOSE_SECONDS)
        if self._thread.is_alive():
            log.warning("tones_left_behind", reason=f"not closed in {CLOSE_SECONDS:g} s")

    def _work(self) -> None:
        try:
            import sounddevice
        except (ImportError, OSError) as error:  # OSError: no libportaudio
            self._fail(f"{error}; `pip install riposte[play]`, `apt install libportaudio2`")
            return
        while not self._stop.is_set():
            try:
                self._sound()
            except (sounddevice.PortAudioError, ValueError, OSError) as error:
                text = str(error).split(" [PaErrorCode")[0].rstrip(".")
                self._fail(f"{text}; plug a sound card in, or set tones.sink = 'null'")
            except Exception:  # the edge of the thread: the loop that moves the robot goes on
                log.exception("tones_crashed")
                self._problem = "a bug, see the log; the rest goes on without sound"
                return
            if not self._stop.wait(self._retry):
                # What PortAudio knows of devices is as old as its start.
                sounddevice._terminate()  # pyright: ignore[reportPrivateUsage]
                sounddevice._initialize()  # pyright: ignore[reportPrivateUsage]

    def _sound(self) -> None:
        """Sound until closed.

        Raises:
            PortAudioError: the card cannot be opened.
            OSError: it went away.
            ValueError: no device has that name, or several have.
        """
        import sounddevice

        device = self._device or None
        channels = min(int(sounddevice.query_devices(device, "output")["max_output_channels"]), 2)
        synth: ToneSynth | None = None

        def fill(
            out: Samples, frames: int, _time: object, status: sounddevice.CallbackFlags
        ) -> None:
            assert synth is not None  # the stream starts after it is made
            self._asked_at = self._clock.now()
            self._counts["tone_underruns"] += bool(status.output_underflow)
            out[:] = synth.render(frames, self._hz)[:, None]

        stream = sounddevice.OutputStream(
            device=device, channels=channels, dtype="float32", latency="low", callback=fill
        )
        try:
            synth = ToneSynth(stream.samplerate, self._volume)
            self._asked_at = self._clock.now()
            stream.start()
            self._latency = stream.latency
            self._counts["tone_streams"] += 1
            self._problem = ""
            log.info("tones_opened", rate_hz=stream.samplerate, latency_ms=1e3 * stream.latency)
            self._watch(stream)
        finally:
            self._latency = 0.0
            stream.abort()
            stream.close()

    def _watch(self, stream: "sounddevice.OutputStream") -> None:
        """Return once closed and faded out.

        Raises:
            OSError: the card stopped asking for samples.
        """
        while not self._stop.wait(WATCH_SECONDS):
            if not stream.active or self._clock.now() - self._asked_at > SILENT_SECONDS:
                raise OSError("the sound card went away")
        time.sleep(FADE_SECONDS)

    def _fail(self, reason: str) -> None:
        """Log a reason once, and keep it for ``riposte status``."""
        if reason != self._problem:
            log.warning("tones_unavailable", reason=reason)
        self._problem = reason

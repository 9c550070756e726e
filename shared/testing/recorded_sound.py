"""A sound card of a test's own: a private PulseAudio whose only device is recorded.

PortAudio plays to it through ALSA's pulse plugin, as it does on a desktop. A process that gets
``RecordedSound.environment`` hears no other sound card. Needs ``pulseaudio``, ``parec`` and
ALSA's plugins.
"""

import os
import shutil
import socket
import subprocess
import threading
import time
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

RATE = 44100
"""The one that ALSA's pulse plugin asks for; any other would be resampled."""
START_SECONDS = 15.0
ASOUND = """\
pcm.!default { type pulse }
ctl.!default { type pulse }
"""
PLUGIN = "libasound_module_pcm_pulse.so"

Samples = NDArray[np.float32]


def lacks_sound() -> str:
    """Return why no sound can be recorded here; empty when it can."""
    for command, package in (("pulseaudio", "pulseaudio"), ("parec", "pulseaudio-utils")):
        if shutil.which(command) is None:
            return f"needs {command}: apt install {package}"
    if not any(folder.glob(f"**/{PLUGIN}") for folder in _plugin_folders()):
        return "needs ALSA's pulse plugin: apt install libasound2-plugins"
    return ""


def _plugin_folders() -> list[Path]:
    return [path for path in Path("/usr").glob("lib*/**/alsa-lib") if path.is_dir()]


class RecordedSound:
    """PulseAudio with a null sink, and a recorder of what it is sent; a context manager."""

    def __init__(self, folder: Path) -> None:
        """Make it; it begins when entered.

        Args:
            folder: its home; the path must be short, for it holds a socket.
        """
        self._folder = folder
        self._socket = folder / "sound"
        asound = folder / "asound.conf"
        asound.write_text(ASOUND)
        self.environment = {
            "HOME": str(folder),
            "XDG_RUNTIME_DIR": str(folder),
            "XDG_CONFIG_HOME": str(folder),
            "PULSE_SERVER": f"unix:{self._socket}",
            "PULSE_COOKIE": str(folder / "cookie"),
            "ALSA_CONFIG_PATH": f"/usr/share/alsa/alsa.conf:{asound}",
        }
        """For the process that is to sound."""
        self._server: subprocess.Popen[bytes] | None = None
        self._recorder: subprocess.Popen[bytes] | None = None
        self._reader: threading.Thread | None = None
        self._chunks: list[tuple[float, bytes]] = []

    def __enter__(self) -> "RecordedSound":
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def start(self) -> None:
        """Start server and recorder; return once sound is recorded.

        Raises:
            RuntimeError: one of them did not start.
        """
        words = ["pulseaudio", "-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1"]
        for module in (
            f"module-native-protocol-unix socket={self._socket} auth-anonymous=1",
            f"module-null-sink sink_name=recorded rate={RATE} channels=2 format=float32le",
        ):
            words += ["-L", module]
        environment = os.environ | self.environment
        del environment["PULSE_SERVER"]  # it would refuse to start where there seems to be one
        self._server = subprocess.Popen(words, env=environment, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + START_SECONDS
        while not self._answers():
            if time.monotonic() > deadline or self._server.poll() is not None:
                self.stop()
                raise RuntimeError("pulseaudio did not start")
            time.sleep(0.02)
        self._recorder = subprocess.Popen(
            [
                "parec", "--device=recorded.monitor", f"--rate={RATE}", "--channels=1",
                "--format=float32le", "--latency-msec=5", "--raw",
            ],
            env=os.environ | self.environment,
            stdout=subprocess.PIPE,
        )  # fmt: skip
        self._chunks = []
        self._reader = threading.Thread(target=self._read, name="recorder", daemon=True)
        self._reader.start()
        while not self._chunks:
            if time.monotonic() > deadline or self._recorder.poll() is not None:
                self.stop()
                raise RuntimeError("parec did not start")
            time.sleep(0.02)

    def stop(self) -> None:
        """Stop both, as when the sound server dies."""
        for process in (self._recorder, self._server):
            if process is not None:
                process.kill()
                process.wait(START_SECONDS)
        if self._reader is not None:
            self._reader.join(START_SECONDS)
        if self._recorder is not None and self._recorder.stdout is not None:
            self._recorder.stdout.close()
        self._server = self._recorder = self._reader = None
        self._socket.unlink(missing_ok=True)

    def samples(self) -> Samples:
        """Return what was recorded so far: float32[n] at ``RATE``."""
        return np.frombuffer(b"".join(chunk for _, chunk in list(self._chunks)), np.float32)

    def began_at(self) -> float:
        """Return when the first sample was recorded, on the machine's monotonic clock (s).

        The earliest that fits all arrivals: a chunk cannot arrive before its last sample.
        """
        chunks = list(self._chunks)
        ends = np.cumsum([len(chunk) for _, chunk in chunks]) / (4.0 * RATE)
        return float(np.min(np.array([at for at, _ in chunks]) - ends))

    def _answers(self) -> bool:
        with socket.socket(socket.AF_UNIX) as probe:
            return probe.connect_ex(str(self._socket)) == 0

    def _read(self) -> None:
        recorder = self._recorder
        assert recorder is not None
        assert recorder.stdout is not None
        while chunk := os.read(recorder.stdout.fileno(), 1 << 16):
            self._chunks.append((time.monotonic(), chunk))

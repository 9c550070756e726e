"""Tones on a sound card: a child process sounds them, and a thread watches over the child."""

import contextlib
import contextvars
import os
import subprocess
import sys
import threading
from typing import IO

import msgspec
import structlog

from services.robot_io.tones.player import WORD, Report
from services.robot_io.tones.tones import TonesConfig
from shared.runtime.process import THREAD_LIMITS

CLOSE_SECONDS = 2.0
"""Longest wait for the child to fall silent and end; then it is killed."""
MAX_LINE = 4096

log = structlog.get_logger()


class SoundCard:
    """A tone that sounds until it is changed, or for half a second after the last word."""

    def __init__(self, cfg: TonesConfig) -> None:
        """Start the thread, and with it the child.

        Args:
            cfg: which card, and how loud.
        """
        self._cfg = cfg
        self._report = Report(problem="opening the sound card")
        self._restarts = 0
        self._lock = threading.Lock()
        """Held while the pipe is written to or taken away."""
        self._pipe: IO[bytes] | None = None
        self._stop = threading.Event()
        self._child: subprocess.Popen[bytes] | None = None
        run = contextvars.copy_context().run  # log lines say whose they are
        self._thread = threading.Thread(target=run, args=(self._work,), name="tones", daemon=True)
        self._thread.start()

    def play(self, hz: float) -> None:
        """Sound a tone; to be said again while it shall go on."""
        # A pipe that is full or broken is the thread's business.
        with self._lock, contextlib.suppress(OSError):
            if self._pipe is not None:
                os.write(self._pipe.fileno(), WORD.pack(hz))

    def rates(self) -> dict[str, float]:
        """Return the latency that the card reports (ms)."""
        latency = self._report.latency_ms
        return {"tone_latency_ms": latency} if latency else {}

    def counters(self) -> dict[str, int]:
        """Return streams opened, blocks that came too late, and children that died."""
        return {
            "tone_streams": self._report.streams,
            "tone_underruns": self._report.underruns,
            "tone_restarts": self._restarts,
        }

    @property
    def problem(self) -> str:
        """Return why nothing sounds; empty when it would."""
        return self._report.problem

    def close(self) -> None:
        """Fall silent and let go of the card, in ``CLOSE_SECONDS`` at most."""
        self._stop.set()
        self._hang_up()
        self._thread.join(CLOSE_SECONDS)
        if self._thread.is_alive() and self._child is not None:
            self._child.kill()
            self._thread.join(CLOSE_SECONDS)

    def _work(self) -> None:
        words = [sys.executable, "-m", "services.robot_io.tones.player"]
        words.append(msgspec.json.encode(self._cfg).decode())
        while not self._stop.is_set():
            # Native libraries write what they like to stderr; what matters comes in a report.
            with subprocess.Popen(
                words,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | THREAD_LIMITS,
            ) as child:
                self._child = child
                self._listen_to(child)
            if self._stop.is_set():
                return
            self._restarts += 1
            self._take(self._report_of_end(child.returncode))
            self._stop.wait(self._cfg.retry)

    def _report_of_end(self, code: int) -> Report:
        """Return what to say of a child that ended by itself."""
        problem = self._report.problem
        if code <= 0 or not problem:
            problem = (
                f"the sound process ended with {f'signal {-code}' if code < 0 else code}; look at "
                "the sound set-up (`aplay -L`), or set tones.sink = 'null'"
            )
        return msgspec.structs.replace(self._report, problem=problem, latency_ms=0.0)

    def _listen_to(self, child: "subprocess.Popen[bytes]") -> None:
        """Take the child's reports until it has ended."""
        assert child.stdin is not None
        assert child.stdout is not None
        os.set_blocking(child.stdin.fileno(), False)
        with self._lock:
            self._pipe = child.stdin
        if self._stop.is_set():
            self._hang_up()
        before = self._report
        for line in iter(lambda: child.stdout.readline(MAX_LINE), b""):  # type: ignore[union-attr]
            with contextlib.suppress(ValueError, RecursionError):
                report = msgspec.json.decode(line, type=Report)
                self._take(
                    msgspec.structs.replace(
                        report,
                        streams=before.streams + report.streams,
                        underruns=before.underruns + report.underruns,
                    )
                )
        self._hang_up()
        try:
            child.wait(CLOSE_SECONDS)
        except subprocess.TimeoutExpired:
            child.kill()

    def _hang_up(self) -> None:
        with self._lock:
            pipe, self._pipe = self._pipe, None
            if pipe is not None:
                pipe.close()

    def _take(self, report: Report) -> None:
        """Keep a report for ``riposte status``, and log what people should know, once."""
        before, self._report = self._report, report
        if report.problem and report.problem != before.problem:
            log.warning("tones_unavailable", reason=report.problem)
        elif report.streams != before.streams:
            log.info(
                "tones_opened",
                latency_ms=round(report.latency_ms, 1),
                underruns=report.underruns,
            )

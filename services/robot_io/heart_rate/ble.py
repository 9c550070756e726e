"""A Bluetooth strap through bleak, on a thread of its own; the loop only looks into a queue.

Straps drop a link for many reasons (a rejected update of connection parameters after 30 s or
150 s, a person who walks off, dry electrodes). So the thread looks for the strap, connects,
listens, and begins again for as long as the process lives, waiting longer after each failure.
Nothing but the last 64 measurements is kept for a loop that does not look.
"""

import asyncio
import contextlib
import contextvars
import threading
from collections import deque

import structlog
from bleak import BleakAdapter, BleakClient, BleakScanner
from bleak.backends.characteristic import BleakGATTCharacteristic
from bleak.backends.device import BLEDevice
from bleak.backends.scanner import AdvertisementData
from bleak.exc import BleakBluetoothNotAvailableError, BleakDBusError, BleakError

from services.robot_io.heart_rate.packet import parse
from services.robot_io.heart_rate.source import Beat, HeartRateConfig
from shared.clock import Clock
from shared.errors import MessageError

HEART_RATE_SERVICE = "0000180d-0000-1000-8000-00805f9b34fb"
MEASUREMENT = "00002a37-0000-1000-8000-00805f9b34fb"
MAX_WAITING = 64
CLOSE_SECONDS = 3.0
"""Longest wait for the link to be let go; a thread that hangs in it is left behind."""
NO_SERVICE = (
    "org.freedesktop.DBus.Error.ServiceUnknown",
    "org.freedesktop.DBus.Error.NameHasNoOwner",
)

log = structlog.get_logger()


class BleStrap:
    """A strap that is looked for, connected and listened to until it is closed."""

    def __init__(self, cfg: HeartRateConfig, clock: Clock) -> None:
        """Start the thread.

        Args:
            cfg: which strap, and how patiently.
            clock: a clock that moves by itself and may be read from any thread.
        """
        self.name = cfg.address or cfg.name or "ble"
        self._cfg = cfg
        self._clock = clock
        self._waiting: deque[Beat] = deque(maxlen=MAX_WAITING)
        self._counts = {
            "heart_rate_connects": 0,
            "heart_rate_drops": 0,
            "heart_rate_refused": 0,
            "heart_rate_lost": 0,
        }
        self._problem = "looking for the strap"
        self._loop: asyncio.AbstractEventLoop | None = None
        self._stop: asyncio.Event | None = None
        self._is_closed = False
        self._heard_at = 0.0
        self._thread = threading.Thread(
            target=contextvars.copy_context().run,  # log lines say whose they are
            args=(self._work,),
            name="heart-rate",
            daemon=True,
        )
        self._thread.start()

    def take(self, now: float) -> Beat | None:
        """Return the oldest measurement that was not taken, or None."""
        del now
        return self._waiting.popleft() if self._waiting else None

    def counters(self) -> dict[str, int]:
        """Return connections made and dropped, and measurements refused or overrun."""
        return dict(self._counts)

    @property
    def problem(self) -> str:
        """Return why nothing can come now; empty when it can."""
        return self._problem

    def close(self) -> None:
        """Let go of the strap, in ``CLOSE_SECONDS`` at most."""
        self._is_closed = True
        loop, stop = self._loop, self._stop
        if loop is not None and stop is not None:
            with contextlib.suppress(RuntimeError):  # it has ended by itself
                loop.call_soon_threadsafe(stop.set)
        self._thread.join(CLOSE_SECONDS)
        if self._thread.is_alive():
            log.warning("heart_rate_left_behind", reason=f"not closed in {CLOSE_SECONDS:g} s")

    def _work(self) -> None:
        try:
            asyncio.run(self._until_closed())
        except Exception:  # the edge of the thread: the loop that moves the robot goes on
            log.exception("heart_rate_crashed")
            self._problem = "a bug, see the log; the rest goes on without it"

    async def _until_closed(self) -> None:
        self._stop = asyncio.Event()
        self._loop = asyncio.get_running_loop()
        wait = self._cfg.retry_first
        while not self._is_closed:
            before = self._heard_at
            session = asyncio.ensure_future(self._session())
            closing = asyncio.ensure_future(self._stop.wait())
            await asyncio.wait((session, closing), return_when=asyncio.FIRST_COMPLETED)
            closing.cancel()
            session.cancel()
            try:
                await session
            except asyncio.CancelledError:
                return
            except (BleakError, OSError, EOFError, TimeoutError) as error:
                self._fail(_reason(error))
            except Exception as error:  # a library's bug costs this try, not the ones to come
                if self._fail(f"bug: {type(error).__name__}: {error}; trying again"):
                    log.exception("heart_rate_crashed")
            if self._heard_at > before:
                wait = self._cfg.retry_first
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._stop.wait(), wait)
            wait = min(2.0 * wait, self._cfg.retry_longest)

    async def _session(self) -> None:
        """Find the strap and listen to it until the link is gone."""
        cfg = self._cfg
        device = await self._find()
        if device is None:
            self._fail(
                f"no {self._wanted()} within {cfg.search_seconds:g} s; wear it with wet "
                "electrodes, and disconnect it from other phones and watches"
            )
            return
        gone = asyncio.Event()
        async with BleakClient(
            device, disconnected_callback=lambda _: gone.set(), timeout=cfg.search_seconds
        ) as client:
            self.name = device.name or device.address
            await client.start_notify(MEASUREMENT, self._hear)
            self._counts["heart_rate_connects"] += 1
            self._problem = ""
            log.info("heart_rate_connected", strap=self.name, address=device.address)
            connected_at = self._clock.now()
            while not gone.is_set():
                silence = self._clock.now() - max(connected_at, self._heard_at)
                if silence > cfg.silent_after:
                    self._counts["heart_rate_drops"] += 1
                    self._fail(f"connected, but silent for {silence:.0f} s")
                    return
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(gone.wait(), cfg.silent_after - silence + 0.01)
        self._counts["heart_rate_drops"] += 1
        self._fail("the link to the strap was lost")

    async def _find(self) -> BLEDevice | None:
        """Return the strap: one that a killed process left connected does not advertise."""
        adapter = await BleakAdapter.get()
        for device in await adapter.get_connected_devices([HEART_RATE_SERVICE]):
            if self._is_wanted(device, device.name):
                return device

        def matches(device: BLEDevice, advertised: AdvertisementData) -> bool:
            is_named = bool(self._cfg.address or self._cfg.name)
            is_strap = is_named or HEART_RATE_SERVICE in advertised.service_uuids
            return is_strap and self._is_wanted(device, advertised.local_name or device.name)

        return await BleakScanner.find_device_by_filter(matches, self._cfg.search_seconds)

    def _is_wanted(self, device: BLEDevice, name: str | None) -> bool:
        if self._cfg.address:
            return device.address.casefold() == self._cfg.address.casefold()
        return self._cfg.name.casefold() in (name or "").casefold()

    def _wanted(self) -> str:
        return f"strap {self._cfg.address or self._cfg.name}".strip()

    def _hear(self, _sender: BleakGATTCharacteristic, value: bytearray) -> None:
        try:
            packet = parse(value)
        except MessageError as error:
            self._counts["heart_rate_refused"] += 1
            if self._counts["heart_rate_refused"] == 1:
                log.warning("heart_rate_refused", reason=str(error))
            return
        self._heard_at = self._clock.now()
        self._counts["heart_rate_lost"] += len(self._waiting) == MAX_WAITING
        beat = Beat(
            at=self._heard_at,
            at_ns=self._clock.wall_ns(),
            beats_per_minute=float(packet.beats_per_minute),
            rr_ms=packet.rr_ms,
            contact=packet.contact is not False,
        )
        self._waiting.append(beat)

    def _fail(self, reason: str) -> bool:
        """Log a reason once, and keep it for ``riposte status``; return whether it is new."""
        reason = " ".join(reason.split())
        is_new = reason != self._problem
        if is_new:
            log.warning("heart_rate_unavailable", reason=reason)
        self._problem = reason
        return is_new


def _reason(error: Exception) -> str:
    """Return in one line what is wrong and what to do."""
    if isinstance(error, BleakBluetoothNotAvailableError):
        return f"{error.args[0].rstrip('.')}; plug one in, or `bluetoothctl power on`"
    if isinstance(error, BleakDBusError) and error.dbus_error in NO_SERVICE:
        return "BlueZ does not run; `systemctl start bluetooth`"
    if isinstance(error, FileNotFoundError | ConnectionError | PermissionError):
        return (
            f"no system message bus ({error.strerror}); Bluetooth needs D-Bus and BlueZ: "
            "`apt install bluez`, `systemctl start bluetooth`"
        )
    if isinstance(error, TimeoutError):
        return "the strap does not answer; is it connected to another phone or watch?"
    text = " ".join(str(error).split()) or type(error).__name__
    return f"{text[:200]}; trying again"

"""The strap as a test sees it: worn, notifying, dropped, out of reach."""

# pyright: basic

import asyncio
import contextlib
import threading
from collections.abc import Callable
from types import TracebackType
from typing import TypeVar

from dbus_fast import DBusError
from dbus_fast.aio import MessageBus

from shared.testing.fake_bluez.objects import (
    ADAPTER_PATH,
    Adapter,
    Characteristic,
    Device,
    Service,
    device_path,
)

ADVERTISING_SECONDS = 0.05
START_SECONDS = 10.0

T = TypeVar("T")


class FakeBluez:
    """``org.bluez`` with one strap, on a thread of its own; a context manager."""

    def __init__(
        self, bus_address: str, *, address: str = "A0:9E:1A:00:00:01", name: str = "Polar OH1 Fake"
    ) -> None:
        """Make it; it begins when entered.

        Args:
            bus_address: of a private message bus.
            address: of the strap.
            name: of the strap.
        """
        self.address = bus_address
        self.connects = 0
        """Connections made."""
        self.refused = 0
        """Connections refused."""
        self.is_advertising = True
        """Whether the strap is worn and in reach."""
        self.refuses = False
        """Whether it refuses connections."""
        self._strap_path = device_path(address)
        self._adapter = Adapter(self)
        self._device = Device(self, address, name)
        self._service = Service(self._strap_path)
        self._service_path = f"{self._strap_path}/service0010"
        self._characteristic = self._new_characteristic()
        self._characteristic_path = f"{self._service_path}/char0011"
        self._discoveries = 0
        self._notifying = threading.Event()
        self._is_ready = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._ended: asyncio.Event | None = None
        self._thread = threading.Thread(target=self._run, name="fake-bluez", daemon=True)

    def __enter__(self) -> "FakeBluez":
        self._thread.start()
        if not self._is_ready.wait(START_SECONDS):
            raise RuntimeError("the fake BlueZ did not start")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        ended = self._ended
        if ended is not None:
            with contextlib.suppress(RuntimeError):  # its bus was taken away, and it ended
                self._loop.call_soon_threadsafe(ended.set)
        self._thread.join(START_SECONDS)

    @property
    def is_connected(self) -> bool:
        """Return whether the strap is connected."""
        return self._device.is_connected

    @property
    def is_discovered(self) -> bool:
        """Return whether somebody looks for straps."""
        return self._discoveries > 0

    def wait_for_listener(self, seconds: float) -> bool:
        """Return whether somebody listens to the measurement within so long."""
        return self._notifying.wait(seconds)

    def notify(self, value: bytes) -> None:
        """Send a measurement, as it is."""
        self._call(lambda: self._characteristic.send(value))

    def drop(self) -> None:
        """Lose the link, as straps do."""
        self._call(self.disconnect)

    def set_powered(self, is_powered: bool) -> None:
        """Turn the adapter on or off."""
        self._adapter.is_powered = is_powered
        self._call(lambda: self._adapter.emit_properties_changed({"Powered": is_powered}))

    def connect_from_elsewhere(self) -> None:
        """Be connected already, as after the death of a process that was."""
        self._call(self.connect)

    def discover(self, is_on: bool) -> None:
        """Begin or end a discovery; on the fake's thread."""
        self._discoveries += 1 if is_on else -1

    def connect(self) -> None:
        """Connect the strap; on the fake's thread."""
        if self.refuses or not self.is_advertising:
            self.refused += 1
            raise DBusError("org.bluez.Error.Failed", "br-connection-page-timeout")
        self.connects += 1
        self._characteristic = self._new_characteristic()
        self._device.set_connected(True)
        self._bus.export(self._service_path, self._service)
        self._bus.export(self._characteristic_path, self._characteristic)
        self._device.set_resolved()

    def disconnect(self) -> None:
        """Disconnect the strap; on the fake's thread."""
        if not self._device.is_connected:
            return
        self._notifying.clear()
        self._bus.unexport(self._characteristic_path, self._characteristic)
        self._bus.unexport(self._service_path, self._service)
        self._device.set_connected(False)

    def _new_characteristic(self) -> Characteristic:
        def on_notifying(is_notifying: bool) -> None:
            (self._notifying.set if is_notifying else self._notifying.clear)()

        return Characteristic(f"{self._strap_path}/service0010", on_notifying)

    def _call(self, what: Callable[[], T]) -> T:
        """Do something on the fake's thread and wait for it."""

        async def do() -> T:
            return what()

        return asyncio.run_coroutine_threadsafe(do(), self._loop).result(START_SECONDS)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.close()

    async def _serve(self) -> None:
        self._bus = await MessageBus(bus_address=self.address).connect()
        self._ended = asyncio.Event()
        self._bus.export(ADAPTER_PATH, self._adapter)
        self._bus.export(self._strap_path, self._device)
        await self._bus.request_name("org.bluez")
        self._is_ready.set()
        while not self._ended.is_set() and self._bus.connected:
            if self._discoveries > 0 and self.is_advertising and not self._device.is_connected:
                self._device.advertise()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._ended.wait(), ADVERTISING_SECONDS)
        self._bus.disconnect()
        with contextlib.suppress(OSError, EOFError):
            await self._bus.wait_for_disconnect()

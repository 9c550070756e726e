"""What BlueZ shows on the message bus: an adapter, a device, its service and characteristic.

Names, signatures and order of events are those of BlueZ 5: a device appears when it advertises
during a discovery, its services when it is connected, and ``ServicesResolved`` after them.
"""

# pyright: basic
# ruff: noqa: D102, N802

from collections.abc import Callable
from typing import Annotated, Any, Protocol

from dbus_fast import DBusError
from dbus_fast.annotations import (
    DBusBool,
    DBusBytes,
    DBusDict,
    DBusInt16,
    DBusObjectPath,
    DBusSignature,
    DBusStr,
)
from dbus_fast.constants import PropertyAccess
from dbus_fast.service import ServiceInterface, dbus_method, dbus_property

HEART_RATE_SERVICE = "0000180d-0000-1000-8000-00805f9b34fb"
MEASUREMENT = "00002a37-0000-1000-8000-00805f9b34fb"
ADAPTER_PATH = "/org/bluez/hci0"

Strings = Annotated[list[str], DBusSignature("as")]
READ = PropertyAccess.READ


def device_path(address: str) -> str:
    """Return the object path of a device."""
    return f"{ADAPTER_PATH}/dev_{address.replace(':', '_')}"


class Radio(Protocol):
    """What the objects ask of the fake that owns them; called on its thread."""

    def discover(self, is_on: bool) -> None:
        """Begin or end a discovery."""
        ...

    def connect(self) -> None:
        """Connect the strap.

        Raises:
            DBusError: it refuses.
        """
        ...

    def disconnect(self) -> None:
        """Disconnect the strap."""
        ...


class Adapter(ServiceInterface):
    """``org.bluez.Adapter1``."""

    def __init__(self, radio: Radio) -> None:
        super().__init__("org.bluez.Adapter1")
        self._radio = radio
        self.is_powered = True

    @dbus_property(READ)
    def Address(self) -> DBusStr:
        return "00:11:22:33:44:55"

    @dbus_property(READ)
    def Name(self) -> DBusStr:
        return "fake"

    @dbus_property(READ)
    def Powered(self) -> DBusBool:
        return self.is_powered

    @dbus_property(READ)
    def Roles(self) -> Strings:
        return ["central", "peripheral"]

    @dbus_method()
    def SetDiscoveryFilter(self, properties: DBusDict) -> None:
        del properties

    @dbus_method()
    def StartDiscovery(self) -> None:
        if not self.is_powered:
            raise DBusError("org.bluez.Error.NotReady", "Resource Not Ready")
        self._radio.discover(True)

    @dbus_method()
    def StopDiscovery(self) -> None:
        self._radio.discover(False)


class Device(ServiceInterface):
    """``org.bluez.Device1``."""

    def __init__(self, radio: Radio, address: str, name: str) -> None:
        super().__init__("org.bluez.Device1")
        self._radio = radio
        self._address = address
        self._name = name
        self.is_connected = False
        self.is_resolved = False

    @dbus_property(READ)
    def Address(self) -> DBusStr:
        return self._address

    @dbus_property(READ)
    def AddressType(self) -> DBusStr:
        return "public"

    @dbus_property(READ)
    def Name(self) -> DBusStr:
        return self._name

    @dbus_property(READ)
    def Alias(self) -> DBusStr:
        return self._name

    @dbus_property(READ)
    def Adapter(self) -> DBusObjectPath:
        return ADAPTER_PATH

    @dbus_property(READ)
    def UUIDs(self) -> Strings:
        return [HEART_RATE_SERVICE]

    @dbus_property(READ)
    def RSSI(self) -> DBusInt16:
        return -60

    @dbus_property(READ)
    def Paired(self) -> DBusBool:
        return False

    @dbus_property(READ)
    def Connected(self) -> DBusBool:
        return self.is_connected

    @dbus_property(READ)
    def ServicesResolved(self) -> DBusBool:
        return self.is_resolved

    @dbus_method()
    def Connect(self) -> None:
        self._radio.connect()

    @dbus_method()
    def Disconnect(self) -> None:
        self._radio.disconnect()

    def advertise(self) -> None:
        """Be heard by whoever discovers."""
        self.emit_properties_changed({"RSSI": -60})

    def set_connected(self, is_connected: bool) -> None:
        """Say whether it is connected."""
        self.is_connected = is_connected
        changed = {"Connected": is_connected}
        if not is_connected and self.is_resolved:
            self.is_resolved = False
            changed["ServicesResolved"] = False
        self.emit_properties_changed(changed)

    def set_resolved(self) -> None:
        """Say that its services are all there."""
        self.is_resolved = True
        self.emit_properties_changed({"ServicesResolved": True})


class Service(ServiceInterface):
    """``org.bluez.GattService1``: heart rate."""

    def __init__(self, device: str) -> None:
        super().__init__("org.bluez.GattService1")
        self._device = device

    @dbus_property(READ)
    def UUID(self) -> DBusStr:
        return HEART_RATE_SERVICE

    @dbus_property(READ)
    def Device(self) -> DBusObjectPath:
        return self._device

    @dbus_property(READ)
    def Primary(self) -> DBusBool:
        return True


class Characteristic(ServiceInterface):
    """``org.bluez.GattCharacteristic1``: the measurement."""

    def __init__(self, service: str, on_notifying: Callable[[bool], None]) -> None:
        super().__init__("org.bluez.GattCharacteristic1")
        self._service = service
        self._on_notifying = on_notifying
        self._value = b""
        self.is_notifying = False

    @dbus_property(READ)
    def UUID(self) -> DBusStr:
        return MEASUREMENT

    @dbus_property(READ)
    def Service(self) -> DBusObjectPath:
        return self._service

    @dbus_property(READ)
    def Value(self) -> DBusBytes:
        return self._value

    @dbus_property(READ)
    def Flags(self) -> Strings:
        return ["notify"]

    @dbus_property(READ)
    def Notifying(self) -> DBusBool:
        return self.is_notifying

    @dbus_method()
    def StartNotify(self) -> None:
        self._set_notifying(True)

    @dbus_method()
    def StopNotify(self) -> None:
        self._set_notifying(False)

    def send(self, value: bytes) -> None:
        """Notify whoever listens."""
        self._value = value
        changed: dict[str, Any] = {"Value": value}
        self.emit_properties_changed(changed)

    def _set_notifying(self, is_notifying: bool) -> None:
        self.is_notifying = is_notifying
        self.emit_properties_changed({"Notifying": is_notifying})
        self._on_notifying(is_notifying)

# pyright: basic
"""The door to openvr: one tracker of a SteamVR that runs, by its serial.

The library is global to a process, and its calls may take long while SteamVR starts or ends:
everything here belongs to one thread, and not to that of the loop.
"""

import ctypes
from typing import Any

import numpy as np
import openvr
from openvr.error_code import InitError

from services.robot_io.poses import is_pose
from services.robot_io.vive.frames import pose_of_rows
from services.robot_io.vive.source import Sighting, SteamVrError

GOOD = 200
"""The result of a pose that is tracked in all six degrees of freedom."""
RAW = 2
"""The base stations' own frame: that of a standing player moves with each room set-up."""
TRACKER = 3

_NOT_INSTALLED = (100, 110)
_DAMAGED = (101, 102, 103, 104, 106)
_TOO_OLD = 105
_NO_HEADSET = (108, 125, 126)
_NOT_RUNNING = (119, 121)


class ViveDevice:
    """SteamVR as a client sees it, and one tracker in it."""

    def __init__(self) -> None:
        self._system: Any = None
        self._poses: Any = None
        self._rows = np.zeros(12, np.float32)
        self._index = -1

    def open(self) -> str:
        """Join a running SteamVR, which is never started from here; return its version.

        Raises:
            SteamVrError: it is not installed, not running, too old, or refuses.
        """
        try:
            self._system = openvr.init(openvr.VRApplication_Background)
            return self._system.getRuntimeVersion()
        except InitError as error:
            self.close()
            raise _explained(int(error.error_value), type(error).__name__) from error
        except openvr.OpenVRError as error:  # the wheel's own word for an unknown interface
            self.close()
            raise _explained(_TOO_OLD, "Init_InterfaceNotFound") from error

    def find(self, serial: str) -> bool:
        """Look for the tracker; return whether it is there."""
        self._index = -1
        for index, found, _ in self._devices():
            if found == serial:
                self._index = index
                self._poses = (openvr.TrackedDevicePose_t * (index + 1))()
                self._rows = np.ctypeslib.as_array(
                    ctypes.cast(
                        ctypes.addressof(self._poses[index].mDeviceToAbsoluteTracking),
                        ctypes.POINTER(ctypes.c_float),
                    ),
                    (12,),
                )
                return True
        return False

    def seen(self) -> tuple[str, ...]:
        """Return serial and model of every tracker that SteamVR knows."""
        return tuple(f"{serial} ({model})" for _, serial, model in self._devices())

    def poll(self) -> Sighting:
        """Return the tracker as it is now; ``find`` must have found it."""
        self._system.getDeviceToAbsoluteTrackingPose(RAW, 0.0, self._poses)
        found = self._poses[self._index]
        result, is_connected = int(found.eTrackingResult), bool(found.bDeviceIsConnected)
        if not (is_connected and found.bPoseIsValid and result == GOOD):
            return Sighting(None, is_connected, result)
        pose = pose_of_rows(self._rows.tolist())
        return Sighting(pose if is_pose(pose) else None, is_connected, result)

    def battery(self) -> float | None:
        """Return the tracker's charge (0 to 1), None where it does not tell."""
        try:
            charge = self._system.getFloatTrackedDeviceProperty(
                self._index, openvr.Prop_DeviceBatteryPercentage_Float
            )
        except openvr.OpenVRError:
            return None
        return float(charge) if 0.0 <= charge <= 1.0 else None

    def is_ending(self) -> bool:
        """Return whether SteamVR has asked its clients to let go, and say that we do."""
        event = openvr.VREvent_t()
        for _ in range(64):
            if not self._system.pollNextEvent(event):
                return False
            if event.eventType == openvr.VREvent_Quit:
                self._system.acknowledgeQuit_Exiting()
                return True
        return False

    def close(self) -> None:
        """Let go of SteamVR; a second call does nothing."""
        self._index, self._system = -1, None
        openvr.shutdown()

    def _devices(self) -> list[tuple[int, str, str]]:
        """Return index, serial and model of every tracker."""
        found = []
        for index in range(openvr.k_unMaxTrackedDeviceCount):
            if self._system.getTrackedDeviceClass(index) == TRACKER:
                serial = self._text(index, openvr.Prop_SerialNumber_String)
                found.append((index, serial, self._text(index, openvr.Prop_ModelNumber_String)))
        return found

    def _text(self, index: int, name: int) -> str:
        try:
            return self._system.getStringTrackedDeviceProperty(index, name)
        except (openvr.OpenVRError, UnicodeDecodeError):
            return "unknown"


def _explained(number: int, symbol: str) -> SteamVrError:
    """Return the error of a refused initialisation, with what to do."""
    which = f"(openvr error {number}, {symbol.removeprefix('InitError_')})"
    if number in _NOT_INSTALLED:
        return SteamVrError(
            f"SteamVR is not installed for this user {which}: install it, start it once",
            is_final=True,
        )
    if number in _DAMAGED:
        return SteamVrError(
            f"SteamVR's installation is damaged {which}: verify its files in Steam", is_final=True
        )
    if number == _TOO_OLD:
        return SteamVrError(
            f"SteamVR is older than this openvr {which}: update SteamVR", is_final=True
        )
    if number in _NOT_RUNNING:
        return SteamVrError(f"SteamVR is not running {which}: start it")
    if number in _NO_HEADSET:
        return SteamVrError(
            f"SteamVR wants a headset {which}: enable its null driver, see docs/robot.md"
        )
    return SteamVrError(f"SteamVR refuses {which}: restart it")

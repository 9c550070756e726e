"""Builds the double of SteamVR in a folder, and says where its trackers are.

The library is ``vrclient.c``, compiled with gcc; the poses go to it through a mapped file, so that
whoever writes them and whoever asks the wheel for them may be different processes.
"""

import json
import mmap
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SOURCE: Final = Path(__file__).with_name("vrclient.c")
OVERRIDE: Final = "VR_PATHREG_OVERRIDE"
"""Environment variable by which the wheel finds a SteamVR that is elsewhere."""
TRACKER: Final = 3
BASE_STATION: Final = 4
MAX_DEVICES: Final = 8

_HEAD = struct.Struct("<Iiii")
_DEVICE = struct.Struct("<iiiifi32s32s18f")
_TAIL = struct.Struct("<IiIIII")
_FIELDS = ("asked", "universe", "initialised", "cleaned", "acknowledged", "unexpected")
_COMPILE_SECONDS = 60.0


def has_compiler() -> bool:
    """Return whether the double can be built here."""
    return shutil.which("gcc") is not None


def compile_client(folder: Path) -> Path:
    """Return the compiled client library.

    Raises:
        RuntimeError: gcc is missing or does not accept the source.
    """
    folder.mkdir(parents=True, exist_ok=True)
    library = folder / "vrclient.so"
    words = ("gcc", "-O2", "-Wall", "-Wextra", "-shared", "-fPIC", "-fvisibility=hidden")
    try:
        subprocess.run(
            [*words, "-o", str(library), str(SOURCE), "-ldl"],
            check=True, capture_output=True, text=True, timeout=_COMPILE_SECONDS,
        )  # fmt: skip
    except FileNotFoundError as error:
        raise RuntimeError("gcc is not installed: apt install gcc libc6-dev") from error
    except subprocess.CalledProcessError as error:
        raise RuntimeError(f"gcc refused {SOURCE}: {error.stderr}") from error
    return library


class FakeVive:
    """One installation with up to eight devices; a tracker is what is put there."""

    def __init__(self, folder: Path, library: Path) -> None:
        """Install it.

        Args:
            folder: of its own, empty or not there.
            library: from ``compile_client``.
        """
        place = folder / "bin" / "linux64"
        place.mkdir(parents=True)
        shutil.copy(library, place / "vrclient.so")
        self.registry = folder / "openvrpaths.vrpath"
        """What the variable ``OVERRIDE`` must name."""
        self.registry.write_text(
            json.dumps(
                {
                    "version": 1, "jsonid": "vrpathreg", "runtime": [str(folder)],
                    "config": [str(folder)], "log": [str(folder)], "external_drivers": None,
                }
            )
        )  # fmt: skip
        size = _HEAD.size + MAX_DEVICES * _DEVICE.size + _TAIL.size
        path = place / "state.bin"
        path.write_bytes(bytes(size))
        with path.open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), size)
        self._sequence = 0
        self._init_error = 0
        self._is_old = False

    @property
    def environment(self) -> dict[str, str]:
        """Return what a process must have in its environment to find this installation."""
        return {OVERRIDE: str(self.registry)}

    def refuse(self, init_error: int) -> None:
        """Let the next initialisations fail with this number; 0 lets them succeed."""
        self._init_error = init_error
        self._write_head()

    def age(self) -> None:
        """Become a SteamVR that is older than the wheel."""
        self._is_old = True
        self._write_head()

    def quit(self) -> None:
        """Tell whoever listens that SteamVR ends."""
        struct.pack_into("<i", self._map, 12, 1)

    def put(
        self, index: int, serial: str, pose: Floats | None = None, *, kind: int = TRACKER,
        model: str = "VIVE Tracker 3.0", result: int = 200, is_valid: bool = True,
        is_connected: bool = True, battery: float = 0.8, velocity: Floats | None = None,
    ) -> None:  # fmt: skip
        """Put a device there.

        Args:
            index: its place, 0 to 7; SteamVR gives 0 to the headset.
            serial: at most 31 letters.
            pose: float64[4, 4], device in the base stations' frame; the identity when None.
            kind: ``TRACKER`` or ``BASE_STATION``.
            model: at most 31 letters.
            result: of tracking; 200 is good.
            is_valid: whether the pose is one.
            is_connected: whether the device answers.
            battery: 0 to 1.
            velocity: float64[6], linear (m/s) and angular (rad/s).
        """
        if not 0 <= index < MAX_DEVICES:
            raise ValueError(f"index is {index}, expected 0 to {MAX_DEVICES - 1}")
        matrix = np.eye(4) if pose is None else pose
        numbers = [*matrix[:3].ravel(), *(np.zeros(6) if velocity is None else velocity)]
        packed = _DEVICE.pack(
            kind, is_connected, is_valid, result, battery, 0,
            serial.encode()[:31], model.encode()[:31], *numbers,
        )  # fmt: skip
        self._begin()
        start = _HEAD.size + index * _DEVICE.size
        self._map[start : start + _DEVICE.size] = packed
        self._end()

    def remove(self, index: int) -> None:
        """Take a device away, as if it had never been there."""
        self._begin()
        start = _HEAD.size + index * _DEVICE.size
        self._map[start : start + _DEVICE.size] = bytes(_DEVICE.size)
        self._end()

    def counted(self) -> dict[str, int]:
        """Return what the library counted: calls for poses, the universe asked for, and so on."""
        values = _TAIL.unpack_from(self._map, _HEAD.size + MAX_DEVICES * _DEVICE.size)
        return dict(zip(_FIELDS, values, strict=True))

    def close(self) -> None:
        """Let go of the shared memory."""
        self._map.close()

    def _write_head(self) -> None:
        struct.pack_into("<ii", self._map, 4, self._init_error, int(self._is_old))

    def _begin(self) -> None:
        self._sequence += 1
        struct.pack_into("<I", self._map, 0, self._sequence & 0xFFFFFFFF)

    def _end(self) -> None:
        self._begin()

"""What Riposte uses of sounddevice 0.5, which has no types."""

from collections.abc import Callable
from typing import Any

from numpy.typing import NDArray

class PortAudioError(Exception): ...

class CallbackFlags:
    output_underflow: bool

class OutputStream:
    samplerate: float
    latency: float
    active: bool
    def __init__(
        self,
        *,
        device: str | int | None = ...,
        channels: int | None = ...,
        dtype: str | None = ...,
        latency: float | str | None = ...,
        blocksize: int | None = ...,
        callback: Callable[[NDArray[Any], int, Any, CallbackFlags], None] | None = ...,
    ) -> None: ...
    def start(self) -> None: ...
    def stop(self) -> None: ...
    def abort(self) -> None: ...
    def close(self) -> None: ...

def query_devices(device: str | int | None = ..., kind: str | None = ...) -> dict[str, Any]: ...
def _terminate() -> None: ...
def _initialize() -> None: ...

"""A message bus of a test's own, in place of the system's."""

import contextlib
import shutil
import subprocess
from collections.abc import Generator
from pathlib import Path

START_SECONDS = 10.0

CONFIG = """\
<!DOCTYPE busconfig PUBLIC "-//freedesktop//DTD D-Bus Bus Configuration 1.0//EN"
 "http://www.freedesktop.org/standards/dbus/1.0/busconfig.dtd">
<busconfig>
  <type>session</type>
  <listen>unix:path={socket}</listen>
  <auth>EXTERNAL</auth>
  <policy context="default">
    <allow user="*"/><allow own="*"/>
    <allow send_type="method_call"/><allow send_type="signal"/>
    <allow send_requested_reply="true" send_type="method_return"/>
    <allow send_requested_reply="true" send_type="error"/>
    <allow receive_type="method_call"/><allow receive_type="method_return"/>
    <allow receive_type="error"/><allow receive_type="signal"/>
  </policy>
</busconfig>
"""


def lacks_dbus() -> str:
    """Return why no private bus can be had here; empty when it can."""
    return "" if shutil.which("dbus-daemon") else "needs dbus-daemon: apt install dbus-daemon"


@contextlib.contextmanager
def private_bus(folder: Path) -> Generator[str]:
    """Run a message bus; yield the address for ``DBUS_SYSTEM_BUS_ADDRESS``.

    Args:
        folder: for its socket; the path must be short (108 bytes with a file name).

    Raises:
        RuntimeError: it did not start.
    """
    config = folder / "bus.conf"
    socket = folder / "bus"
    socket.unlink(missing_ok=True)
    config.write_text(CONFIG.format(socket=socket))
    process = subprocess.Popen(
        ["dbus-daemon", f"--config-file={config}", "--nofork", "--print-address=1"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,  # that it may not raise a limit
    )
    try:
        assert process.stdout is not None
        address = process.stdout.readline().decode().strip()  # ends when it listens, or dies
        if not address:
            raise RuntimeError("dbus-daemon did not start")
        yield address
    finally:
        process.terminate()
        process.wait(START_SECONDS)
        assert process.stdout is not None
        process.stdout.close()

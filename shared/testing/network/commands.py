"""The programs that make and change namespaces."""

import functools
import shutil
import subprocess
from collections.abc import Sequence

RUN_SECONDS = 20.0
"""Each of these programs is done in milliseconds."""
PROGRAMS = {
    "ip": "iproute2",
    "unshare": "util-linux",
    "setpriv": "util-linux",
    "mount": "mount",
}
"""Program: the Debian package that has it."""
LOSSY = "iptables-legacy"
_PROBE = "ip link add v0 type veth peer name v1 && ip link add b0 type bridge"


def run(*words: str) -> str:
    """Return what a command prints.

    Raises:
        RuntimeError: it failed; the text is the command and what it said.
    """
    done = _done(words)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(words)}: {done.stderr.strip() or done.returncode}")
    return done.stdout


@functools.cache
def unavailable() -> str:
    """Return why there can be no hosts here; empty when there can.

    A trial, not a guess: makes the parts in a namespace that is gone with its only process.
    """
    for program, package in PROGRAMS.items():
        if shutil.which(program) is None:
            return f"needs {program}: apt install {package}"
    return _refusal(
        "needs root's right to make network namespaces, veth links and bridges",
        ("unshare", "--net", "--mount", "--uts", "sh", "-c", _PROBE),
    )


@functools.cache
def no_loss() -> str:
    """Return why links cannot lose packets here; empty when they can."""
    if why := unavailable():
        return why
    if shutil.which(LOSSY) is None:
        return f"needs {LOSSY}: apt install iptables"
    return _refusal(
        "needs statistic and NFQUEUE of the kernel's packet filter",
        ("unshare", "--net", LOSSY, *loss_rule("-A", "INPUT", 0.5)),
    )


def loss_rule(action: str, chain: str, share: float) -> tuple[str, ...]:
    """Return the packet filter's words for losing a share of the packets of one direction.

    They are queued for a program that is not there, which loses them silently: a DROP in OUTPUT is
    an error that the sender sees at once, and no link does that.
    """
    side = "-i" if chain == "INPUT" else "-o"
    return (
        "-w", "5", action, chain, side, "eth0", "-m", "statistic", "--mode", "random",
        "--probability", f"{share:.6f}", "-j", "NFQUEUE", "--queue-num", "0",
    )  # fmt: skip


def _refusal(need: str, words: Sequence[str]) -> str:
    done = _done(words)
    if done.returncode == 0:
        return ""
    said = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
    return f"{need} ({said})"


def _done(words: Sequence[str]) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        words, capture_output=True, text=True, timeout=RUN_SECONDS, check=False,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip

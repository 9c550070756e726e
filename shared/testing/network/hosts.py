"""Hosts with links that can be cut: network namespaces, each plugged into one switch.

The switch is a namespace of its own with a bridge in it; every host has a cable to it, and so has
the process that makes them, as if it were one more machine of that network. A host is an address,
a host name and a /dev/shm of its own, so that no bus mistakes two hosts for one.
"""

import itertools
import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Self

from shared.testing.network.commands import LOSSY, loss_rule, no_loss, run, unavailable
from shared.testing.network.stale import SHARED_MEMORY, prefix, remove, remove_stale

END_SECONDS = 10.0
SUBNETS = 512
"""Of 256 addresses each, in 198.18.0.0/15, which RFC 2544 sets aside for tests of networks."""
MOST_HOSTS = 250

_numbers = itertools.count()
# Whoever is killed takes along what it started: setpriv asks the kernel before anything else.
_ENTER = ("setpriv", "--pdeathsig", "KILL", "ip", "netns", "exec")
_BECOME = 'mount --bind "$0" /dev/shm && echo "$1" >/proc/sys/kernel/hostname && shift && exec "$@"'

Output = int | IO[bytes] | None


class Network:
    """A switch and the hosts plugged into it; a context that leaves nothing behind.

    What runs in its hosts dies with the thread that started it, and with ``close``.
    """

    def __init__(self) -> None:
        """Make the switch, and this process's own cable to it.

        Raises:
            RuntimeError: there can be none here; ask ``unavailable`` first.
        """
        if why := unavailable():
            raise RuntimeError(why)
        remove_stale()
        number = next(_numbers)
        self._prefix = f"{prefix()}{number}-"
        self._switch = f"{self._prefix}switch"
        self._subnet = _free_subnet(os.getpid() + number)
        self._cable = f"rp{os.getpid()}.{number}"
        self.hosts: dict[str, Host] = {}
        self.address = f"{self._subnet}.254"
        """Of this process in the network."""
        try:
            run("ip", "netns", "add", self._switch)
            self._in_switch("link", "add", "br0", "type", "bridge")
            self._in_switch("link", "set", "br0", "up")
            self._plug(self._cable, "own", None, self.address)
        except BaseException:
            self.close()
            raise

    def host(self, name: str) -> "Host":
        """Return a new host with a cable to the switch.

        Args:
            name: its host name: letters, digits, ``-``; unique in this network.
        """
        number = len(self.hosts) + 1
        if name in self.hosts or number > MOST_HOSTS:
            raise ValueError(f"host {name!r}: names must differ, {MOST_HOSTS} hosts at most")
        host = Host(name, f"{self._subnet}.{number}", f"{self._prefix}{name}", self._switch, number)
        self.hosts[name] = host  # before anything is made, so that close() removes it
        host.shared_memory.mkdir()
        run("ip", "netns", "add", host.namespace)
        run("ip", "-n", host.namespace, "link", "set", "lo", "up")
        self._plug("eth0", host.port, host.namespace, host.address)
        return host

    def close(self) -> None:
        """End every process in the hosts, and remove hosts, switch and links; idempotent."""
        for host in self.hosts.values():
            host.end()
            remove(host.namespace)
        if Path("/sys/class/net", self._cable).exists():  # the kernel takes its time with the rest
            run("ip", "link", "delete", self._cable)
        remove(self._switch)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _plug(self, end: str, port: str, namespace: str | None, address: str) -> None:
        """Lay a cable from here, or from a namespace, to the switch."""
        here = ("-n", namespace) if namespace else ()
        peer = ("peer", "name", port, "netns", self._switch)
        run("ip", *here, "link", "add", end, "type", "veth", *peer)
        run("ip", *here, "address", "add", f"{address}/24", "dev", end)
        run("ip", *here, "link", "set", end, "up")
        self._in_switch("link", "set", port, "master", "br0", "up")

    def _in_switch(self, *words: str) -> None:
        run("ip", "-n", self._switch, *words)


class Host:
    """One host: starts processes, and has a link that can be cut, healed and made lossy."""

    def __init__(self, name: str, address: str, namespace: str, switch: str, number: int) -> None:
        """Made by ``Network.host``."""
        self.name = name
        self.address = address
        self.namespace = namespace
        self.port = f"port{number}"
        """Of the switch."""
        self.shared_memory = SHARED_MEMORY / namespace
        """What is /dev/shm to its processes."""
        self.processes: list[subprocess.Popen[bytes]] = []
        self._switch = switch
        self._loss = 0.0

    def command(self, *words: str) -> list[str]:
        """Return the command line that runs a program on this host."""
        become = ("unshare", "--uts", "--mount", "sh", "-c", _BECOME, str(self.shared_memory))
        return [*_ENTER, self.namespace, *become, self.name, *words]

    def start(
        self,
        *words: str,
        stdout: Output = None,
        stderr: Output = None,
        env: Mapping[str, str] | None = None,
        cwd: Path | None = None,
    ) -> "subprocess.Popen[bytes]":
        """Start a program on this host; its process id is the program's own."""
        process = subprocess.Popen(
            self.command(*words),
            stdin=subprocess.DEVNULL, stdout=stdout, stderr=stderr, env=env, cwd=cwd,
        )  # fmt: skip
        self.processes.append(process)
        return process

    def relay(self, port: int, target: str, delay: float) -> "subprocess.Popen[bytes]":
        """Start a relay here: what goes through this host's loopback is later by so much.

        Args:
            port: where it listens, on this host's 127.0.0.1.
            target: ``HOST:PORT`` that it passes everything on to.
            delay: one way (s), in both directions.
        """
        words = (f"127.0.0.1:{port}", target, str(delay))
        return self.start(sys.executable, "-P", "-m", "shared.testing.network.relay", *words)

    def cut(self) -> None:
        """Pull the cable out of the switch: what is sent is lost, and nobody is told."""
        self._set_port("down")

    def heal(self) -> None:
        """Plug it in again."""
        self._set_port("up")

    def lose(self, share: float) -> None:
        """Lose a share of the packets, 0 to 1, in either direction; 0 ends it.

        Raises:
            RuntimeError: this kernel cannot; ask ``no_loss`` first.
        """
        if why := no_loss():
            raise RuntimeError(why)
        for chain in ("INPUT", "OUTPUT"):
            for action, value in (("-D", self._loss), ("-A", share)):
                if value > 0.0:
                    run(*self._inside(LOSSY, *loss_rule(action, chain, value)))
        self._loss = share

    def end(self) -> None:
        """Kill what was started here."""
        for process in reversed(self.processes):
            process.kill()
        for process in self.processes:
            process.wait(END_SECONDS)
            for pipe in (process.stdout, process.stderr):
                if pipe is not None:
                    pipe.close()
        self.processes.clear()

    def _set_port(self, state: str) -> None:
        run("ip", "-n", self._switch, "link", "set", self.port, state)

    def _inside(self, *words: str) -> Sequence[str]:
        return ("ip", "netns", "exec", self.namespace, *words)


def _free_subnet(start: int) -> str:
    """Return the first three numbers of a subnet that no link of this machine is in."""
    links = json.loads(run("ip", "-json", "-4", "address"))
    used = {known["local"].rpartition(".")[0] for link in links for known in link["addr_info"]}
    for number in range(start, start + SUBNETS):
        high, low = divmod(number % SUBNETS, 256)
        subnet = f"198.{18 + high}.{low}"
        if subnet not in used:
            return subnet
    raise RuntimeError("no subnet of 198.18.0.0/15 is free; close some networks")

"""The doctor's checks of the machine: cores, memory, disk, ports and the bus on its loopback."""

import contextlib
import math
import os
import platform
import resource
import secrets
import shutil
import socket
import statistics
from pathlib import Path

import psutil

from services.jobs.doctor.finding import Finding
from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.clock import Clock, SystemClock
from shared.errors import RiposteError
from shared.messages.league import Incident
from shared.messages.topics import INCIDENT
from shared.messages.training import Receipt

MIB = 1 << 20
MIN_FREE_DISK, GOOD_FREE_DISK = 256 * MIB, 2048 * MIB
MIN_MEMORY, GOOD_MEMORY = 1024 * MIB, 3072 * MIB
GOOD_SHARED_MEMORY = 128 * MIB
GOOD_OPEN_FILES = 1024
GOOD_CORES = 2
PORTS = {7447: "the bus of a site (riposte router)", 9090: "the live view (riposte train --view)"}
ROUND_TRIPS = 50
SLOW_ROUND_TRIP_MS = 20.0


def processor() -> str:
    """Return the processor's name as the kernel tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.machine()
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())


def check_cores() -> Finding:
    """Return how many cores this process may use, by affinity and by the container's quota."""
    allowed = len(os.sched_getaffinity(0))
    quota = cpu_quota(Path("/sys/fs/cgroup/cpu.max"))
    cores = min(allowed, quota)
    load = os.getloadavg()[0]
    detail = f"{cores:g} usable, load {load:.1f}"
    if cores < GOOD_CORES:
        return Finding("warn", detail, "one core works; actor and learner then take turns on it")
    if load > allowed:
        return Finding("warn", detail, "something else is busy here: figures will be slower")
    return Finding("ok", detail)


def cpu_quota(path: Path) -> float:
    """Return the cores that a cgroup's ``cpu.max`` allows; infinite where it says nothing."""
    try:
        limit, period = path.read_text(encoding="ascii").split()
    except (OSError, ValueError):
        return math.inf
    return math.inf if limit == "max" else int(limit) / int(period)


def check_memory() -> Finding:
    """Return how much memory is available."""
    free = psutil.virtual_memory().available
    detail = f"{free / MIB:.0f} MiB available"
    return _graded(free, MIN_MEMORY, GOOD_MEMORY, detail, "close something: a run needs 1 to 2 GiB")


def check_disk(folder: Path) -> Finding:
    """Return how much room the disk of ``folder`` has, and whether it can be written."""
    existing = folder.resolve()
    while not existing.exists():
        existing = existing.parent
    if not os.access(existing, os.W_OK):
        return Finding("fail", f"{existing} cannot be written", "choose another with --out DIR")
    free = shutil.disk_usage(existing).free
    detail = f"{free / MIB:.0f} MiB free for {folder}"
    advice = "a run writes 100 MiB to 1 GiB: free some, or choose another folder with --out"
    return _graded(free, MIN_FREE_DISK, GOOD_FREE_DISK, detail, advice)


def check_shared_memory() -> Finding:
    """Return the size of /dev/shm, through which the bus passes large messages."""
    try:
        free = shutil.disk_usage("/dev/shm").free
    except OSError:
        return Finding("warn", "no /dev/shm", "set [bus] shared_memory = false")
    advice = "docker run --shm-size=256m, or set [bus] shared_memory = false"
    return _graded(free, 0, GOOD_SHARED_MEMORY, f"{free / MIB:.0f} MiB free in /dev/shm", advice)


def check_open_files() -> Finding:
    """Return how many files a process may hold open."""
    limit = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    if limit == resource.RLIM_INFINITY:
        return Finding("ok", "no limit")
    return _graded(limit, 64, GOOD_OPEN_FILES, f"{limit} a process", "ulimit -n 4096")


def check_ports() -> Finding:
    """Return whether the usual ports are free."""
    busy = [f"{port}, {purpose}," for port, purpose in PORTS.items() if not is_port_free(port)]
    if busy:
        return Finding("warn", f"{' and '.join(busy)} in use", "another run? riposte status says")
    return Finding("ok", f"{', '.join(map(str, PORTS))} free")


def is_port_free(port: int) -> bool:
    """Return whether something could listen on a TCP port of the loopback."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
        return True


def check_bus() -> Finding:
    """Return the time of a question and its answer over a router on the loopback."""
    try:
        from shared.bus.routing import open_router  # the doctor runs without Zenoh, too
        from shared.bus.zenoh import open_zenoh
    except ImportError as error:
        return Finding("fail", f"the bus's library does not load: {error}", "pip install riposte")
    clock = SystemClock()
    cfg = BusConfig(listen=(f"tcp/127.0.0.1:{free_port()}",), open_seconds=5.0)
    run = f"doctor-{secrets.token_hex(4)}"
    try:
        with (
            contextlib.closing(open_router(cfg)),
            contextlib.closing(open_zenoh(cfg, "asker", clock, run)) as asker,
            contextlib.closing(open_zenoh(cfg, "answerer", clock, run)) as answerer,
        ):
            times = round_trips(asker, answerer, clock)
    except RiposteError as error:
        return Finding("fail", str(error), "is a firewall closing the loopback?")
    if not times:
        return Finding("fail", "no answer over the loopback", "is a firewall closing the loopback?")
    median = statistics.median(times) * 1e3
    detail = f"median {median:.2f} ms, longest {max(times) * 1e3:.2f} ms there and back"
    if median > SLOW_ROUND_TRIP_MS:
        return Finding("warn", detail, "the machine is busy: figures will be slower")
    return Finding("ok", detail)


def round_trips(asker: Bus, answerer: Bus, clock: Clock, count: int = ROUND_TRIPS) -> list[float]:
    """Return the seconds from question to answer of those that were answered, at most ``count``."""
    inbox = answerer.answer(INCIDENT)
    times: list[float] = []
    for sequence in range(count):
        begin = clock.now()
        question = Incident(
            source="doctor", boot=asker.boot, sequence=sequence, kind="asked", detail="", at_ns=0
        )
        pending = asker.ask(INCIDENT, question, 2.0)
        while (answer := pending.take()) is None:
            answerer.wait(0.001)
            if (request := inbox.take()) is not None:
                request.reply(Receipt(accepted=True))
            asker.wait(0.001)
        if isinstance(answer, Receipt):
            times.append(clock.now() - begin)
    inbox.close()
    return times


def _graded(value: float, least: float, good: float, detail: str, advice: str) -> Finding:
    if value < least:
        return Finding("fail", detail, advice)
    return Finding("ok", detail) if value >= good else Finding("warn", detail, advice)

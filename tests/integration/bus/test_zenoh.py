"""The real bus when processes die, routers restart and strangers send junk."""

import contextlib
import os
import random
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import psutil
import pytest
import zenoh

from shared.bus.base import NoAnswer, Refused
from shared.bus.config import BusConfig, client_json
from shared.bus.delivery import Applied, Outbox
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.errors import BusError
from shared.messages.league import Incident, Lease, LeaseRequest, Schedule
from shared.messages.live import ServiceStatus
from shared.messages.topics import INCIDENT, LEASE, ROLLOUT, SCHEDULE, STATUS
from shared.messages.training import ACTION_DIM, OBS_DIM, Receipt, Rollout
from shared.messages.wire import encode

pytestmark = pytest.mark.zenoh

ROOT = Path(__file__).resolve().parents[3]
REQUEST = LeaseRequest(actor="hold", boot="b0", num_envs=4)


def a_schedule(version: int) -> Schedule:
    return Schedule(stage=None, versions={"antagonist": version})


def a_rollout(sequence: int, steps: int = 40, worlds: int = 128) -> Rollout:
    T, N = steps, worlds

    def zeros(*shape: int) -> Any:
        return np.full(shape, float(sequence), np.float32)

    return Rollout(
        agent="antagonist", actor="actor-0", boot="b0", sequence=sequence, lease="l", stage=0,
        policy_version=0, snapshot="", opponent="", model="", seed=0, bouts=np.arange(N),
        first_step=np.zeros(N, np.int32), obs=zeros(T, N, OBS_DIM), last_obs=zeros(N, OBS_DIM),
        actions=zeros(T, N, ACTION_DIM), means=zeros(T, N, ACTION_DIM), stds=zeros(ACTION_DIM),
        log_probs=zeros(T, N), rewards=zeros(T, N), truncated=np.zeros(N, bool),
    )  # fmt: skip


@contextlib.contextmanager
def answering(world: Any) -> Iterator[subprocess.Popen[bytes]]:
    """Run the answerer in a process of its own until the block ends."""
    script = Path(__file__).with_name("answerer.py")
    process = subprocess.Popen(
        [sys.executable, str(script), world.cfg.connect[0], world.run],
        cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def test_an_answerer_killed_with_a_request_in_hand_costs_no_deadline(zenoh_world: Any) -> None:
    world = zenoh_world
    asker = world.join("actor-0")
    with answering(world) as process:
        assert world.until(lambda: asker.alive("league") == {"league"}, 20)
        probe = asker.ask(LEASE, LeaseRequest(actor="answer", boot="b", num_envs=1), 5.0)
        assert world.until(probe.take) == Lease(lease="here", kind="none")
        pending = asker.ask(LEASE, REQUEST, 60.0)
        world.rest(0.3)
        assert pending.take() is None
        process.kill()
        killed_at = world.clock.now()
        assert isinstance(world.until(pending.take), NoAnswer)
        assert world.clock.now() - killed_at < 2.0
        assert world.until(lambda: asker.alive("league") == frozenset())


@pytest.mark.parametrize(("down_seconds", "reopens"), [(0.3, False), (3.0, True)])
def test_after_a_router_restart_everything_works_again(
    down_seconds: float, reopens: bool, own_router: Any, make_world: Callable[..., Any]
) -> None:
    world = make_world(watchdog_seconds=1.0 if reopens else 30.0)
    actor, league = world.join("actor-0"), world.join("league")
    values, inbox = actor.subscribe(SCHEDULE), league.answer(LEASE)
    league.declare_alive("league")
    league.publish(SCHEDULE, a_schedule(1))
    assert world.until(values.take) == a_schedule(1)
    assert world.until(lambda: actor.alive("league") == {"league"})
    own_router.kill()
    world.rest(down_seconds)
    assert isinstance(world.until(actor.ask(LEASE, REQUEST, 5.0).take, 1.0), NoAnswer)
    league.publish(SCHEDULE, a_schedule(2))
    own_router.start()
    own_router.await_open()
    back_at = world.clock.now()

    def answered() -> bool:
        pending = actor.ask(LEASE, REQUEST, 1.0)
        found = world.until(lambda: inbox.take() or pending.take())
        if isinstance(found, NoAnswer):
            return False
        found.reply(Lease(lease="again", kind="none"))
        return isinstance(world.until(pending.take), Lease)

    assert world.until(answered, 10.0)
    assert world.until(values.take, 10.0) == a_schedule(2)
    assert world.until(lambda: actor.alive("league") == {"league"}, 10.0)
    assert world.clock.now() - back_at < 10.0
    assert actor.counters["reconnects"] == int(reopens)


def test_without_a_router_for_long_the_process_is_told_to_end(
    own_router: Any, make_world: Callable[..., Any]
) -> None:
    world = make_world(watchdog_seconds=0.3, give_up_seconds=1.0)
    bus = world.join("actor-0")
    own_router.kill()
    with pytest.raises(BusError, match=r"no router at tcp/127\.0\.0\.1:\d+ for 1\.\d s: giving up"):
        world.rest(5.0)
    began_at = world.clock.now()
    bus.close()
    assert world.clock.now() - began_at < 5.0


def test_opening_without_a_router_names_whom_it_waited_for() -> None:
    cfg = BusConfig(connect=("tcp/127.0.0.1:9",), open_seconds=0.3)
    with pytest.raises(BusError, match=r"no router at tcp/127\.0\.0\.1:9 within 0\.3 s"):
        open_zenoh(cfg, "actor-0", SystemClock(), "run")


def test_wait_ends_at_its_deadline_and_no_later(zenoh_world: Any) -> None:
    bus = zenoh_world.join("actor-0")
    for timeout in (0.0, 0.05, 0.6):
        began_at = time.monotonic()
        assert not bus.wait(timeout)
        assert timeout <= time.monotonic() - began_at < timeout + 0.5


def test_wait_ends_when_something_arrives(zenoh_world: Any) -> None:
    writer, reader = zenoh_world.join("league"), zenoh_world.join("actor-0")
    values = reader.subscribe(SCHEDULE)
    zenoh_world.rest(0.3)
    threading.Timer(0.2, lambda: writer.publish(SCHEDULE, a_schedule(1))).start()
    began_at = time.monotonic()
    assert reader.wait(10.0)
    assert time.monotonic() - began_at < 3.0
    assert values.take() == a_schedule(1)


def test_leaving_in_the_middle_of_streams_prints_nothing(
    zenoh_world: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    """What a command prints is read by other programs, and Zenoh says its errors on stdout."""
    said = [
        ServiceStatus(role="actor", name=f"actor-{one}", boot="b", pid=1, host="h", state="playing")
        for one in range(8)
    ]
    is_over = threading.Event()

    def write(name: str) -> None:
        writer = zenoh_world.join(name)
        while not is_over.is_set():
            for status in said:
                writer.publish(STATUS, status, role="actor", name=status.name)
            time.sleep(0.0002)

    threads = [threading.Thread(target=write, args=(f"writer-{one}",)) for one in range(3)]
    for thread in threads:
        thread.start()
    try:
        for number in range(20):
            reader = zenoh_world.join(f"reader-{number}")
            values = [reader.subscribe(STATUS, role="actor", name=one.name) for one in said]
            assert reader.wait(5.0)
            reader.close()
            assert any(one.take() is not None for one in values)
    finally:
        is_over.set()
        for thread in threads:
            thread.join()
    assert "ERROR" not in "".join(capfd.readouterr())


def test_runs_do_not_see_each_other(shared_router: Any, zenoh_world: Any) -> None:
    cfg = BusConfig(connect=(shared_router.endpoint,))
    stranger = open_zenoh(cfg, "league", SystemClock(), "another-run")
    with contextlib.closing(stranger):
        actor = zenoh_world.join("actor-0")
        values = actor.subscribe(SCHEDULE)
        stranger.answer(LEASE)
        stranger.declare_alive("league")
        stranger.publish(SCHEDULE, a_schedule(1))
        actor.alive("league")
        zenoh_world.rest(0.5)
        assert values.take() is None
        assert actor.alive("league") == frozenset()
        pending = actor.ask(LEASE, REQUEST, 1.0)
        assert zenoh_world.until(pending.take) == NoAnswer("nobody answers league/lease")


def test_a_run_whose_name_is_none_is_not_named_to_people(zenoh_world: Any) -> None:
    bus = zenoh_world.join("operator")
    over = threading.Event()
    with zenoh.open(zenoh.Config.from_json5(client_json(zenoh_world.cfg, "operator"))) as stranger:

        def shout() -> None:
            while not over.wait(0.02):
                for run in ("\x1b]0;owned", "a;b", "two words", "fine-1"):
                    stranger.put(f"riposte/v1/{run}/league/schedule", b"x")

        thread = threading.Thread(target=shout)
        thread.start()
        try:
            assert bus.runs(SCHEDULE, 0.5) == {"fine-1"}
        finally:
            over.set()
            thread.join()


def test_junk_from_a_stranger_is_refused_and_counted(zenoh_world: Any) -> None:
    world = zenoh_world
    bus = world.join("league")
    values, inbox = bus.subscribe(SCHEDULE), bus.answer(LEASE)
    prefix = f"riposte/v1/{world.run}/"
    rng = random.Random(0)
    with zenoh.open(zenoh.Config.from_json5(client_json(world.cfg, "operator"))) as stranger:
        world.rest(0.3)
        junk = [rng.randbytes(rng.randrange(2000)) for _ in range(50)]
        for number, payload in enumerate(junk):
            stranger.put(prefix + "league/schedule", payload, attachment=f"x:{number}")
            world.rest(0.01)
            assert values.take() is None
        for attachment in (None, b"", b"x", b"x:-1", b"x" * 100, b"\xff:\xff", "x:²".encode()):
            stranger.put(prefix + "league/schedule", encode(a_schedule(1)), attachment=attachment)
        stranger.put(prefix + "league/schedule", bytes(2 << 20), attachment=b"y:0")
        asked = [
            stranger.get(prefix + "league/lease", payload=payload, timeout=10.0)
            for payload in (*junk[:10], b"", bytes(1 << 20), None)
        ]
        world.until(lambda: inbox.take() or bus.counters["refused_messages"] >= 58)
        assert values.take() is None
        assert inbox.take() is None
        assert bus.counters["refused_messages"] >= 58
        # Where the end of a query is lost on its way, Zenoh adds a timeout to the refusal.
        answers = [list(replies) for replies in asked]
        assert all(answers)
        assert all(reply.err is not None for replies in answers for reply in replies)


def test_raw_junk_on_the_port_does_not_stop_the_router(
    shared_router: Any, zenoh_world: Any
) -> None:
    rng = random.Random(1)
    for _ in range(100):
        with socket.create_connection(("127.0.0.1", shared_router.port), timeout=5) as link:
            link.sendall(rng.randbytes(rng.randrange(1, 4000)))
    writer, reader = zenoh_world.join("league"), zenoh_world.join("actor-0")
    values = reader.subscribe(SCHEDULE)
    writer.publish(SCHEDULE, a_schedule(1))
    assert zenoh_world.until(values.take) == a_schedule(1)


def test_many_large_requests_can_be_held_before_any_is_answered(
    shared_router: Any, zenoh_world: Any
) -> None:
    """They outgrow every pool of shared memory, which must not lose one."""
    cfg = msgspec.structs.replace(zenoh_world.cfg, inbox_messages=64, inbox_mib=256)
    zenoh_world.cfg = cfg
    actor, learner = zenoh_world.join("actor-0"), zenoh_world.join("learner-a")
    inbox = learner.answer(ROLLOUT, agent="antagonist")
    zenoh_world.rest(0.3)
    pendings = [
        actor.ask(ROLLOUT, a_rollout(k), 60.0, agent="antagonist") for k in range(40)
    ]  # 34 MB
    held = [zenoh_world.until(inbox.take) for _ in range(40)]
    assert [request.message.sequence for request in held] == list(range(40))
    assert all(float(request.message.obs[-1, -1, -1]) == k for k, request in enumerate(held))
    for request in held:
        request.reply(Receipt(accepted=True))
    assert all(zenoh_world.until(p.take) == Receipt(accepted=True) for p in pendings)


def test_a_rollout_with_a_nan_is_refused_by_name(zenoh_world: Any) -> None:
    actor, learner = zenoh_world.join("actor-0"), zenoh_world.join("learner-a")
    inbox = learner.answer(ROLLOUT, agent="antagonist")
    zenoh_world.rest(0.3)
    rollout = a_rollout(0, 4, 3)
    rewards = rollout.rewards.copy()
    rewards[1, 2] = np.nan
    spoiled = msgspec.structs.replace(rollout, rewards=rewards)
    pending = actor.ask(ROLLOUT, spoiled, 5.0, agent="antagonist")
    answer = zenoh_world.until(lambda: inbox.take() or pending.take())
    assert answer == Refused("Rollout refused: rewards is not finite (nan at flat index 5)")


def test_an_outbox_loses_nothing_while_the_router_dies_again_and_again(
    own_router: Any, make_world: Callable[..., Any]
) -> None:
    world = make_world(watchdog_seconds=1.0)
    actor, league = world.join("actor-0"), world.join("league")
    inbox, applied, counted = league.answer(INCIDENT), Applied(), list[int]()
    outbox = Outbox(actor, INCIDENT, world.clock, window=8, timeout=1.0, retry_delay=0.05)
    sent = 0
    acknowledged: list[int] = []
    kills = [300, 900]

    def step() -> bool:
        nonlocal sent
        while sent < 1500 and not outbox.full:
            outbox.put(Incident(source="a", boot="b0", sequence=sent, kind="k", detail="",
                                at_ns=0))  # fmt: skip
            sent += 1
        while (request := inbox.take()) is not None:
            sequence = request.message.sequence
            if not applied.contains("b0", sequence):
                applied.add("b0", sequence)
                counted.append(sequence)
            request.reply(Receipt(accepted=True))
        acknowledged.extend(message.sequence for message, _ in outbox.pump())
        if kills and len(acknowledged) > kills[0]:
            kills.pop(0)
            own_router.kill()
            own_router.start()
        return len(acknowledged) == 1500

    assert world.until(step, 40.0)
    assert not kills
    assert sorted(acknowledged) == list(range(1500))
    assert sorted(counted) == list(range(1500))


def test_a_port_in_use_is_one_line_and_exit_code_2(shared_router: Any, tmp_path: Path) -> None:
    command = [
        sys.executable, "-m", "services.router", "--run", str(tmp_path),
        "--listen", shared_router.endpoint,
    ]  # fmt: skip
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=30)
    assert done.returncode == 2
    lines = [line for line in done.stderr.splitlines() if line.startswith("router-0: ")]
    assert lines == [
        f"router-0: cannot listen on {shared_router.endpoint}: the port is in use; "
        "stop the other router, or give another endpoint with --listen"
    ]


def test_a_bad_endpoint_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    command = [
        sys.executable, "-m", "services.router", "--run", str(tmp_path), "--listen", "localhost",
    ]  # fmt: skip
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=30)
    assert done.returncode == 2
    assert "listen has 'localhost', expected an endpoint such as tcp/127.0.0.1:7447" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_router_holds_no_memory_for_those_who_left(own_router: Any) -> None:
    resident = []
    for turn in range(5):
        with contextlib.ExitStack() as stack:
            for number in range(40):
                bus = open_zenoh(
                    BusConfig(connect=(own_router.endpoint,)), f"a-{number}", SystemClock(), "run"
                )
                stack.callback(bus.close)
                bus.subscribe(SCHEDULE)
                bus.declare_alive("actor")
        if turn > 1:  # before, the library makes its threads
            resident.append(psutil.Process(own_router.process.pid).memory_info().rss / 1e6)
    assert resident[-1] - resident[0] < 10.0, resident  # it was 1 to 8 MB for each of 80


def test_a_router_ends_in_order_when_it_is_told_to(own_router: Any) -> None:
    own_router.process.terminate()
    assert own_router.process.wait(10) == 0

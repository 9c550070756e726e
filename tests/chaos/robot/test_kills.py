"""kill -9 of each process of a live bout, on the twin and on a PR2 that holds its last target."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from shared.messages.play import PlayReply, PlayRequest, RefereeState
from shared.messages.topics import BOUT, REFEREE
from tests.chaos.robot.stand import BOTH, LIMITS, Link, Stand, travelled

pytestmark = [pytest.mark.chaos, pytest.mark.zenoh, pytest.mark.timeout(240)]


@pytest.fixture
def stand(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Stand]:
    link: Link = request.param
    stand = Stand(tmp_path, link)
    yield stand
    stand.close()


both = pytest.mark.parametrize("stand", BOTH, indirect=True)


@both
def test_a_policy_that_is_killed_leaves_a_robot_that_holds_trips_and_stays(stand: Stand):
    policy = stand.move()
    count, first = len(stand.seen), len(stand.states)
    stand.kill(policy)
    stand.until(lambda: stand.is_mode("tripped"), 5.0)
    modes = [gate.mode for gate in stand.seen[count:]]
    assert modes.index("holding") < modes.index("tripped")
    assert travelled(stand.tools(first)) < 0.12
    stand.start_policy()  # it comes back, and that alone moves nothing
    stand.rest(1.0)
    stand.assert_stays_shut()
    stand.go_on()


@both
def test_a_robot_io_that_is_killed_leaves_an_arm_near_its_last_target(stand: Stand):
    stand.move()
    killed = time.monotonic()
    stand.kill(stand.robot_io)
    if (fake := stand.fake) is not None:
        stand.until(lambda: len(fake.moments(killed)) > 350)
        way = np.array([moment.tool[:3] for moment in fake.moments(killed)])
        assert travelled(way) < LIMITS.lead + 0.03
        assert travelled(way[-50:]) < 0.002  # held, for the PR2 has no watchdog
        assert fake.commands(killed + 0.1) == []
    stand.robot_io = stand.start_robot_io()
    count = len(stand.states)
    stand.until(lambda: len(stand.states) > count + 50)
    assert stand.is_mode("disarmed")
    stand.assert_stays()
    assert stand.is_mode("disarmed")
    stand.go_on()


@both
def test_a_router_that_is_killed_stops_the_robot_and_its_return_does_not_move_it(stand: Stand):
    stand.move()
    killed = time.monotonic()
    stand.kill(stand.router)
    stand.rest(1.5)
    if stand.fake is not None:
        late = [command.at - killed for command in stand.fake.commands(killed)]
        assert max(late, default=0.0) < 1.0
    count = len(stand.states)
    stand.router = stand.start_router()
    stand.until(lambda: len(stand.states) > count + 50, 30.0)
    stand.until(lambda: stand.is_mode("tripped"), 5.0)
    stand.assert_stays_shut()
    stand.go_on()


@both
def test_a_referee_that_is_killed_leaves_a_robot_that_stands_still(stand: Stand):
    referee = stand.service("referee", "--set", "game.bout_steps=2000")
    stand.service("policy", "--name", "policy-protagonist", "--agent", "protagonist")
    said = stand.bus.subscribe(REFEREE)
    heard: list[RefereeState] = []

    def phase() -> str:
        while (state := said.take()) is not None:
            heard.append(state)
        return heard[-1].phase if heard else ""

    stand.until(lambda: phase() == "ready")
    stand.arm()
    asked = PlayRequest(
        action="start", bout="one", antagonist="person", protagonist="scripted:heuristic"
    )
    pending = stand.bus.ask(BOUT, asked, timeout=3.0)
    stand.until(lambda: pending.take() is not None)
    reply = pending.take()
    assert isinstance(reply, PlayReply)
    assert reply.accepted, reply.reason
    first = len(stand.states)
    stand.until(lambda: travelled(stand.tools(first)) > 0.01 and phase() == "running")
    stand.kill(referee)
    stand.rest(1.5)
    count = len(stand.states)
    stand.rest(1.0)
    assert travelled(stand.tools(count)) < 0.003
    assert stand.is_mode("armed", "tripped", "holding")

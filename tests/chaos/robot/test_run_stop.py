"""A run stop, pressed and released while a policy streams, with every part a process of its own."""

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from shared.testing.ros_master import has_ros_master
from tests.chaos.robot.stand import Stand

pytestmark = [
    pytest.mark.chaos,
    pytest.mark.zenoh,
    pytest.mark.timeout(240),
    pytest.mark.skipif(
        not has_ros_master(), reason="needs Debian's ROS master: apt install python3-rosmaster"
    ),
]


@pytest.fixture
def stand(tmp_path: Path) -> Iterator[Stand]:
    stand = Stand(tmp_path, "pr2")
    yield stand
    stand.close()


def test_nothing_moves_after_a_released_stop_until_a_person_arms(stand: Stand):
    fake = stand.fake
    assert fake is not None
    stand.move()
    pressed = time.monotonic()
    fake.press_run_stop()
    stand.until(lambda: stand.is_mode("tripped"), 5.0)
    late = [command.at - pressed for command in fake.commands(pressed)]
    assert max(late, default=0.0) < 0.5  # the board says it ten times a second
    assert not stand.ask("reset").accepted
    fake.release_run_stop()
    stand.until(lambda: not fake.is_halted, 15.0)  # the robot resets its motors by itself
    assert "r_cart" in fake.running()
    stand.assert_stays_shut()
    fake.put_back()
    stand.go_on()

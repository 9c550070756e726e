import pytest

from services.robot_io.config import RobotIoConfig, SafetyConfig
from shared.config.site import load_section
from shared.errors import ConfigError


@pytest.mark.parametrize(
    ("setting", "text"),
    [
        ("safety.game_speed=3.0", "game_speed is 3; allowed are 0.01 to 1"),
        ("safety.acceleration=nan", "acceleration is nan"),
        ("safety.command_trip=0.05", r"command_hold \(0.1\) must not be above command_trip"),
        ("safety.box_low=[1.0, 0.0, 0.0]", "the box runs from 1.0 to 0.95 m along x"),
        ("safety.speed=1.0", "speed"),
    ],
)
def test_limits_that_are_none_are_refused_by_name(setting: str, text: str):
    with pytest.raises(ConfigError, match=text):
        load_section(None, "safety", SafetyConfig, (setting,))


@pytest.mark.parametrize(
    ("setting", "text"),
    [
        ("robot_io.answer_wait=0.02", "answer_wait is 0.02; allowed are 0 to 0.008"),
        ("robot_io.tracker=replay", "give a file with tracker = 'replay'"),
        ("robot_io.link=pr3", "pr3"),
    ],
)
def test_a_loop_that_cannot_be_is_refused_by_name(setting: str, text: str):
    with pytest.raises(ConfigError, match=text):
        load_section(None, "robot_io", RobotIoConfig, (setting,))

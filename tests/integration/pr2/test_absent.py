"""A machine without the library that ROS messages need."""

import subprocess
import sys

ASK = """
import sys
sys.modules["rosbags"] = None  # as if it were not installed
from services.robot_io.__main__ import pr2_parts_maker
from shared.errors import ConfigError
try:
    pr2_parts_maker()
except ConfigError as error:
    print(error)
"""


def test_rosbags_is_asked_for_where_a_pr2_is_wanted() -> None:
    done = subprocess.run([sys.executable, "-c", ASK], capture_output=True, text=True, timeout=60)
    assert "link = 'pr2' needs rosbags" in done.stdout
    assert "pip install 'riposte[robot]'" in done.stdout
    assert done.stdout.count("\n") == 1

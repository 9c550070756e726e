"""What all tests share: one thread for each library, and the robot only when it is asked for."""

import os

import pytest

from shared.runtime.process import THREAD_LIMITS

os.environ.update(THREAD_LIMITS)  # before numpy is loaded


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--robot", action="store_true", help="run the tests that move a real robot")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--robot"):
        return
    skip = pytest.mark.skip(reason="needs a robot: --robot")
    for item in items:
        if item.get_closest_marker("hardware"):
            item.add_marker(skip)

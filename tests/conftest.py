"""What all tests share: one thread for each library, which tests run beside which, and the robot
only when it is asked for.
"""

import os
from typing import TYPE_CHECKING, Any

import pytest

from shared.runtime.process import THREAD_LIMITS
from tests.sharing import company, turn

if TYPE_CHECKING:
    from xdist.scheduler import Scheduling

os.environ.update(THREAD_LIMITS)  # before numpy is loaded


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--robot", action="store_true", help="run the tests that move a real robot")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: turn(item.nodeid))
    if config.getoption("--robot"):
        return
    skip = pytest.mark.skip(reason="needs a robot: --robot")
    for item in items:
        if item.get_closest_marker("hardware"):
            item.add_marker(skip)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> "Scheduling":
    """Share them by our own names: `--dist=loadgroup` reads no groups from this pytest."""
    from xdist.scheduler import LoadScopeScheduling

    class Sharing(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return company(nodeid)

    return Sharing(config, log)

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from tests.integration.study_pages.rig import Opener, Runner, chromium, opening


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    with chromium() as made:
        yield made


@pytest.fixture
def runner() -> Iterator[Runner]:
    made = Runner()
    yield made
    made.web.close()


@pytest.fixture
def opened(browser: Browser, runner: Runner) -> Iterator[Opener]:
    with opening(browser, runner) as made:
        yield made

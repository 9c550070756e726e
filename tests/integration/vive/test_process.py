"""robot_io as a process, a person's tracked bat opposite, a policy that moves the robot."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.integration.robot_io.site import Site
from tests.integration.vive.conftest import SERIAL
from tests.integration.vive.person import Person

pytestmark = pytest.mark.zenoh


class ViveSite(Site):
    """A site whose robot_io follows a tracker."""

    def __init__(self, folder: Path, person: Person) -> None:
        super().__init__(folder, *person.settings)


@pytest.fixture
def person(library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Person]:
    person = Person(tmp_path, library, SERIAL)
    for name, value in person.environment.items():
        monkeypatch.setenv(name, value)
    yield person
    person.close()


@pytest.fixture
def site(person: Person, tmp_path: Path) -> Iterator[ViveSite]:
    site = ViveSite(tmp_path, person)
    yield site
    site.close()


def test_a_lost_tracker_makes_the_robot_hold_and_a_found_one_lets_it_go_on(
    site: ViveSite, person: Person
):
    site.start_policy()
    site.arm()
    count = len(site.states)
    site.until(lambda: len(site.states) >= count + 150)
    bats = np.array([states.bats[0] for states in site.states[count:] if states.is_valid[0]])
    assert len(bats) > 100
    assert np.ptp(bats[:, 0]) > 0.05  # the thrusts arrive
    assert bats[:, 2] == pytest.approx(1.05, abs=1e-3)

    person.is_lost = True
    site.until(lambda: site.is_mode("holding"), 5.0)
    assert site.seen[-1].reason.startswith("the other bat is not tracked for 0.1 s")
    person.is_lost = False
    site.until(lambda: site.is_mode("armed"), 5.0)

    statuses = []
    site.until(
        lambda: (
            (said := site.status.take()) is not None
            and said.counters.get("tracker_bad_poses", 0) > 0
            and not statuses.append(said)
        )
    )
    assert statuses[0].rates["tracker_battery_percent"] == pytest.approx(77.0)
    assert statuses[0].counters["tracker_dropouts"] > 0
    assert any("calibrated 0.0 days ago" in what for what in site.ask("check").passed)

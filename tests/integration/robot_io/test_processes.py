"""robot_io as a process: a real router, a real twin, a policy that is killed."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.integration.robot_io.site import Site

pytestmark = pytest.mark.zenoh


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    site = Site(tmp_path)
    yield site
    site.close()


def test_a_policy_moves_the_robot_and_its_death_holds_then_trips(site: Site):
    policy = site.start_policy()
    site.arm()
    count = len(site.states)
    site.until(lambda: len(site.states) >= count + 200)
    tools = np.array([states.tools[1, :3] for states in site.states[count:]])
    assert np.ptp(tools[:, 2]) > 0.02

    policy.kill()
    policy.wait()
    site.until(lambda: site.is_mode("tripped"), 5.0)
    assert site.modes()[-3:] == ["armed", "holding", "tripped"]
    assert site.seen[-1].reason == "no usable command for 0.5 s"

    site.start_policy()  # it comes back, and that alone moves nothing
    count = len(site.states)
    site.until(lambda: len(site.states) >= count + 150)
    still = np.array([states.tools[1, :3] for states in site.states[count + 50 :]])
    assert np.ptp(still, axis=0).max() < 0.002
    assert site.is_mode("tripped")
    assert "reset it first" in site.ask("arm").reasons[0]
    assert site.ask("reset").mode == "disarmed"
    site.arm()

    ticks = [states.tick for states in site.states]
    assert ticks == sorted(set(ticks))
    statuses = []
    site.until(lambda: (said := site.status.take()) is not None and not statuses.append(said))
    rates = statuses[0].rates
    for name in ("lateness_p50_ms", "lateness_p99_ms", "command_p50_ms", "command_p99_ms"):
        assert rates[name] >= 0.0
    assert rates["real_time_factor"] == pytest.approx(1.0, abs=0.2)


def test_a_router_that_dies_stops_the_robot_and_its_return_does_not_move_it(site: Site):
    site.start_policy()
    site.arm()
    boot = site.states[-1].boot
    site.router.kill()
    site.router.wait()
    count = len(site.states)
    site.rest(1.0)
    assert len(site.states) - count < 20  # nobody hears anybody
    site.start_router()
    site.until(lambda: len(site.states) > count + 150)
    late = site.states[count + 100 :]
    assert late[-1].boot == boot
    site.until(lambda: site.is_mode("tripped"))  # the gate says so once a second
    assert late[-1].tick > site.states[count - 1].tick + 100  # the loop went on by itself
    assert site.seen[-1].reason == "no usable command for 0.5 s"
    still = np.array([states.tools[1, :3] for states in late])
    assert np.ptp(still, axis=0).max() < 0.002

"""The campaign: every broken promise is seen, and no input of the quick share breaks one."""

from pathlib import Path

import pytest

from tests.fuzz.campaign import Plan, run, save_faults
from tests.fuzz.faulty import AT, GROUPS
from tests.fuzz.registry import ALL

QUICK = 3000
"""Inputs of all targets; the samples are among them."""


def quiet(_: str) -> None:
    """Say nothing."""


@pytest.mark.timeout(300)
def test_no_input_of_the_quick_share_breaks_a_promise(tmp_path: Path) -> None:
    found = run(Plan(ALL, QUICK, 7, tmp_path), quiet)
    assert [(each.target, each.kind, each.why) for each in found.faults] == []
    assert sum(each.inputs for each in found.tallies.values()) == QUICK


@pytest.mark.timeout(120)
@pytest.mark.slow
@pytest.mark.parametrize("name", [each.name for each in GROUPS])
def test_a_broken_promise_is_seen_and_its_input_kept(tmp_path: Path, name: str) -> None:
    hangs = 60.0 if name == "slow" else 3.0  # what is slow is never taken for what hangs
    plan = Plan(name, 60, 1, tmp_path, registry="tests.fuzz.faulty", hang_seconds=hangs)
    found = run(plan, quiet)
    kind = "acted" if name == "wrote" else name
    assert {each.kind for each in found.faults} == {kind}
    files = save_faults(found, tmp_path / "faults")
    assert files
    assert files[0].read_bytes() == b"%d" % AT
    assert found.done == 60 or found.crashes + found.hangs >= 10


def test_a_campaign_goes_on_where_it_was_stopped(tmp_path: Path) -> None:
    run(Plan("escaped", 4, 1, tmp_path, registry="tests.fuzz.faulty"), quiet)
    found = run(Plan("escaped", 9, 1, tmp_path, registry="tests.fuzz.faulty"), quiet)
    assert found.done == 9
    assert found.tallies["escaped/it"].inputs == 9

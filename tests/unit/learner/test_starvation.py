"""What a learner says of the time in which it could have learned."""

from pathlib import Path

from tests.unit.learner.test_service import Table


def starved(table: Table) -> int:
    return table.learner.health().counters["starved_ms"]


def test_a_learner_is_starved_in_its_turn_while_too_few_samples_are_there(tmp_path: Path):
    table = Table(tmp_path)
    table.clock.advance(3.0)
    table.learner.tick()
    assert starved(table) == 0, "it waits for the league, not for samples"

    table.ready()
    table.clock.advance(2.5)
    table.learner.tick()
    assert starved(table) == 2500

    table.send()
    table.clock.advance(4.0)
    table.learner.tick()
    assert starved(table) == 2500, "it has made a version, and waits for the league again"


def test_a_learner_that_is_not_in_turn_starves_of_nothing(tmp_path: Path):
    table = Table(tmp_path)
    table.ready()
    table.clock.advance(1.0)
    table.schedule(stage=None)
    before = starved(table)
    table.clock.advance(60.0)
    table.learner.tick()
    assert starved(table) == before == 1000

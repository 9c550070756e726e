"""The games of a study as arrays."""

import pytest

from shared.study.analysis.games import games_of
from shared.study.protocol_file import load_protocol, shipped_protocol
from shared.study.rows import ParticipantRow
from shared.study.tables import tables_of


def began(number, order):
    return ParticipantRow(
        participant=f"sub-{number:02d}", session=1, order=order, state="ended", games=0, t_ns=0,
        wall="", wall_ended="", protocol="", config="",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("study", "orders", "first"),
    [
        ("study-one", ["D,B,C,A", "D,B,A,C"], ("D",)),  # B is second for both by chance
        ("study-one", ["D,B,C,A"], ("D",)),
        ("study-two", ["B,A", "B,A"], ()),
    ],
)
def test_which_conditions_come_first_for_everybody_is_said_by_the_protocol(study, orders, first):
    rows = [began(number, order) for number, order in enumerate(orders, start=1)]
    games = games_of(tables_of(load_protocol(shipped_protocol(study)), rows))
    assert games.first == first
    assert games.conditions == (*first, *sorted(set(orders[0].split(",")) - set(first)))

"""Names that a league keeps for ever, against a plain set of them."""

import sys

from hypothesis import given
from hypothesis import strategies as st

from services.league.names import Names

BOOTS = st.sampled_from(["a", "b:c", "", "é\n"])
COUNTED = st.builds("{}:{}".format, BOOTS, st.integers(0, 12))
ODD = st.sampled_from(["", ":", "a", "a:", "a:-1", "a:01", "a:1 ", "a:\u0661", "a:9" + "9" * 30])


@given(st.lists(COUNTED | ODD))
def test_every_name_is_kept_once_whatever_its_form(entered: list[str]):
    names, plain = Names(), set[str]()
    for name in entered:
        assert names.add(name) == (name not in plain)
        plain.add(name)
    assert sorted(names) == sorted(plain)
    assert len(names) == len(plain)
    assert all(name in names for name in plain)
    assert "a:13" not in names
    again = Names()
    for name in sorted(plain):
        again.add(name)
    assert again == names


def test_names_are_told_as_spans_of_their_numbers():
    names = Names()
    for name in ("a:3", "a:1", "odd", "a:2", "b:c:7"):
        names.add(name)
    assert list(names.spans()) == ["a:1-3", "b:c:7-7"]


def test_names_that_follow_each_other_take_no_room():
    names = Names()
    for number in range(10_000):
        names.add(f"a1b2c3:{number}")
    assert len(names) == 10_000
    (ranges,) = names._boots.values()
    assert list(ranges) == [(0, 9_999)]
    assert sys.getsizeof(names._boots) < 1000

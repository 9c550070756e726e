"""Lines of keys in a TOML text."""

from shared.config.location import line_of

TEXT = """\
schema = 1
[[section]]
games = 1
[[section]]
games = 2
[[section.item]]
id = "a"
[[section.item]]
id = "b"
[end]
games = 3
"""


def test_entries_of_an_array_are_told_apart_by_their_number():
    assert line_of(TEXT, ("section", 0, "games")) == 3
    assert line_of(TEXT, ("section", 1, "games")) == 5
    assert line_of(TEXT, ("section", 1, "item", 1, "id")) == 9
    assert line_of(TEXT, ("section", 1, "item")) == 6


def test_a_key_that_is_missing_is_where_its_entry_opens():
    assert line_of(TEXT, ("section", 1, "rest")) == 4
    assert line_of(TEXT, ("section", 1, "item", 0, "text")) == 6


def test_without_a_number_the_first_entry_that_has_the_key_is_meant():
    assert line_of(TEXT, ("section", "games")) == 3
    assert line_of(TEXT, ("section", "item", "id")) == 7
    assert line_of(TEXT, ("end", "games")) == 11
    assert line_of(TEXT, ("nothing",)) == 0

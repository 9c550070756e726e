import html as html_text
import re
from html.parser import HTMLParser

from shared.telemetry import html
from shared.telemetry.html import Html, tag


class Checker(HTMLParser):
    """Finds what is opened and not closed, and every address."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.addresses: list[str] = []

    def handle_starttag(self, name: str, attributes: list[tuple[str, str | None]]) -> None:
        if name not in html.VOID:
            self.open.append(name)
        self.addresses += [value or "" for key, value in attributes if key in ("src", "href")]

    def handle_endtag(self, name: str) -> None:
        assert self.open.pop() == name


def test_text_and_attributes_are_escaped() -> None:
    written = tag("p", "<script>alert(1)</script> & co", title='"quoted"')

    assert written == (
        '<p title="&quot;quoted&quot;">&lt;script&gt;alert(1)&lt;/script&gt; &amp; co</p>'
    )


def test_html_is_not_escaped_twice() -> None:
    assert tag("p", Html("<b>x</b>"), ["a & b", None, 3]) == "<p><b>x</b>a &amp; b3</p>"


def test_a_page_is_well_formed_and_asks_for_nothing() -> None:
    page = html.page(
        "Title & more",
        html.section("One", html.table(("a", "b"), [("x", 1), ("<y>", 2)], numbers=[1])),
        html.figure(html.png(b"\x89PNG", "a picture"), "what it shows"),
        html.tiles([("1,200", "points", "good")]),
        html.details("more", tag("pre", "text")),
    )

    checker = Checker()
    checker.feed(page)
    assert checker.open == []
    assert all(address.startswith("data:") for address in checker.addresses)
    assert "default-src 'none'" in html_text.unescape(page)
    assert "<title>Title &amp; more</title>" in page
    assert not re.search(r"https?://", page)


def test_number_columns_are_set_flush_right() -> None:
    table = html.table(("name", "points"), [("a", "1")], numbers=[1])

    assert '<th class="number">points</th>' in table
    assert '<td>a</td><td class="number">1</td>' in table


def test_a_drawing_loses_its_xml_heading() -> None:
    assert html.svg('<?xml version="1.0"?>\n<!DOCTYPE svg>\n<svg width="1"/>') == '<svg width="1"/>'

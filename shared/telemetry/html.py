"""Builds one self-contained HTML page: escaped, styled for light and dark, asking for nothing."""

import base64
import html
from collections.abc import Iterable, Sequence
from typing import TypeAlias


class Html(str):
    """Text that is HTML already; every other string is escaped."""

    __slots__ = ()


Node: TypeAlias = "Html | str | int | float | Sequence[Node] | None"

VOID = frozenset({"br", "hr", "img", "meta", "link"})
STYLE = """
:root { color-scheme: light dark; --ink: #1c2128; --soft: #5d6673; --line: #dfe3e8;
  --paper: #ffffff; --card: #f6f8fa; --antagonist: #d9532c; --protagonist: #3576c4;
  --good: #1a7f4b; --bad: #c0392b; --grid: #d8dde3; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e8ee; --soft: #98a2b0; --line: #333a45;
  --paper: #14171c; --card: #1c2128; --antagonist: #f0764f; --protagonist: #5b9ae6;
  --good: #4cc38a; --bad: #ff7b6b; --grid: #343b46; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
main { max-width: 1060px; margin: 0 auto; padding: 40px 24px 80px; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .2em; letter-spacing: -.01em; }
h2 { font-size: 1.25rem; margin: 2.6em 0 .6em; padding-bottom: .3em;
  border-bottom: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.6em 0 .4em; }
p { margin: .5em 0 1em; max-width: 75ch; }
.lead { font-size: 1.12rem; max-width: 78ch; }
.soft, figcaption, caption { color: var(--soft); font-size: .88rem; }
figcaption, caption { text-align: left; margin-top: .4em; max-width: 100ch; }
figure { margin: 1em 0 1.4em; }
figure svg, figure img { width: 100%; height: auto; display: block; }
figure img { border-radius: 10px; }
.pictures { display: grid; grid-template-columns: 1fr 1fr; gap: 0 18px; }
.pictures figure:first-child { grid-column: 1 / -1; }
.pictures figure { margin: .5em 0; }
.panels { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 400px), 1fr));
  gap: 8px 28px; }
.panels figure { margin: .6em 0; max-width: 560px; }
.beside { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 400px), 1fr));
  gap: 0 28px; align-items: start; }
li { max-width: 75ch; margin: .3em 0; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(148px, 1fr)); gap: 12px;
  margin: 1.6em 0; }
.tile { background: var(--card); border: 1px solid var(--line); border-radius: 10px;
  padding: 14px 16px; }
.tile b { display: block; font-size: 1.45rem; line-height: 1.25; font-weight: 650;
  font-variant-numeric: tabular-nums; }
.tile span { color: var(--soft); font-size: .84rem; }
.good { color: var(--good); } .bad { color: var(--bad); }
.antagonist { color: var(--antagonist); } .protagonist { color: var(--protagonist); }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .92rem; font-variant-numeric: tabular-nums;
  width: 100%; }
caption { caption-side: bottom; padding-top: .6em; }
th, td { text-align: left; padding: 7px 12px 7px 0; border-bottom: 1px solid var(--line);
  vertical-align: top; }
th { font-weight: 600; color: var(--soft); font-size: .84rem; }
td.number, th.number { text-align: right; padding-right: 16px; white-space: nowrap; }
table.heat { width: auto; min-width: 60%; border-collapse: separate; border-spacing: 4px; }
table.heat td { border: 0; border-radius: 8px; padding: 10px 14px; text-align: center;
  min-width: 128px; }
table.heat td b { font-size: 1.1rem; display: block; }
table.heat th { border: 0; padding: 6px 10px; vertical-align: middle; }
table.many { width: 100%; table-layout: fixed; border-spacing: 2px; }
table.many td { min-width: 0; padding: 4px 1px; border-radius: 5px; font-size: .68rem;
  line-height: 1.25; }
table.many td b { font-size: .8rem; } table.many .soft { font-size: .62rem; }
table.many th:first-child { width: 15%; overflow-wrap: anywhere; }
table.many th { padding: 4px 2px; font-size: .74rem; }
table.many thead th { vertical-align: bottom; text-align: center; }
table.many thead span { writing-mode: vertical-rl; transform: rotate(180deg); }
table.crowd td .soft, table.crowd td br { display: none; }
table.crowd th { padding: 4px 0; } table.crowd td { padding: 4px 0; }
table.crowd td b { font-size: .52rem; font-weight: 600; }
code, pre { font: .85rem/1.5 ui-monospace, "SF Mono", Menlo, "DejaVu Sans Mono", monospace; }
pre { background: var(--card); border: 1px solid var(--line); border-radius: 8px;
  padding: 12px 14px; overflow-x: auto; }
details { margin: .8em 0; } summary { cursor: pointer; font-weight: 600; }
footer { margin-top: 4em; color: var(--soft); font-size: .84rem; }
@media print { main { padding: 0; max-width: none; } details { display: block; } }
"""
MANY, CROWD = 6, 14
"""Columns of a matrix above which its cells are small, and above which they hold one number."""
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def tag(name: str, /, *children: Node, **attributes: str | int | float | None) -> Html:
    """Return an element; ``class_`` stands for class, an attribute that is None is left out."""
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    if name in VOID:
        return Html(f"<{name}{written}>")
    return Html(f"<{name}{written}>{join(children)}</{name}>")


def join(children: Node) -> Html:
    """Return the HTML of nodes one after the other."""
    if children is None:
        return Html("")
    if isinstance(children, Html):
        return children
    if isinstance(children, str | int | float):
        return Html(html.escape(str(children)))
    return Html("".join(join(child) for child in children))


def svg(source: str) -> Html:
    """Return an inline SVG drawing that this program made; without its XML heading."""
    return Html(source[source.index("<svg") :])


def png(data: bytes, alt: str) -> Html:
    """Return an inline picture."""
    encoded = base64.b64encode(data).decode("ascii")
    return tag("img", src=f"data:image/png;base64,{encoded}", alt=alt)


def figure(picture: Html, caption: Node) -> Html:
    """Return a picture with what it shows."""
    return tag("figure", picture, tag("figcaption", caption))


def table(
    headers: Sequence[Node],
    rows: Iterable[Sequence[Node]],
    numbers: Iterable[int] = (),
    caption: Node = None,
) -> Html:
    """Return a table; the columns in ``numbers`` are set flush right."""
    right = frozenset(numbers)

    def cell(name: str, k: int, child: Node) -> Html:
        return tag(name, child, class_="number" if k in right else None)

    head = tag("tr", [cell("th", k, header) for k, header in enumerate(headers)])
    body = [tag("tr", [cell("td", k, child) for k, child in enumerate(row)]) for row in rows]
    below = tag("caption", caption) if caption is not None else None
    inner = tag("table", below, tag("thead", head), tag("tbody", body))
    return tag("div", inner, class_="wide")


def matrix(
    caption: Node, columns: Sequence[str], rows: Iterable[tuple[Node, Sequence[Node]]]
) -> Html:
    """Return coloured cells that fit the page: many are small, under names set upright.

    Args:
        caption: what the cells say.
        columns: their names.
        rows: name and ``td`` elements of each; what is of class ``soft`` in a cell is left out
            where columns are a crowd.
    """
    count = len(columns)
    size = "heat many crowd" if count > CROWD else "heat many" if count > MANY else "heat"
    head = tag("tr", tag("th"), [tag("th", tag("span", name)) for name in columns])
    body = [tag("tr", tag("th", name), list(cells)) for name, cells in rows]
    inner = tag(
        "table", tag("caption", caption), tag("thead", head), tag("tbody", body), class_=size
    )
    return tag("div", inner, class_="wide")


def tiles(entries: Iterable[tuple[Node, Node, str]]) -> Html:
    """Return key figures: value, what it is, and a class for its colour (or nothing)."""
    boxes = [
        tag("div", tag("b", value, class_=colour or None), tag("span", about), class_="tile")
        for value, about, colour in entries
    ]
    return tag("div", boxes, class_="tiles")


def details(summary: Node, *children: Node) -> Html:
    """Return what is folded away until it is asked for."""
    return tag("details", tag("summary", summary), *children)


def section(title: str, *children: Node) -> Html:
    """Return a section with its heading."""
    return tag("section", tag("h2", title), *children)


def page(title: str, *children: Node) -> str:
    """Return the whole document; the browser is told to load nothing from anywhere."""
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", title),
        tag("style", Html(STYLE)),
    )
    body = tag("body", tag("main", *children))
    return f"<!doctype html>\n{tag('html', head, body, lang='en')}\n"

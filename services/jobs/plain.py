"""Text that was heard from the bus, as a terminal may have it: no markup, no control characters."""

from rich.text import Text


def printable(text: str) -> str:
    """Return a text without what moves a cursor, colours, retitles or reorders: one line."""
    return "".join(letter for letter in text if letter.isprintable())


def plain(text: str, style: str = "") -> Text:
    """Return a text that was heard, for rich: its brackets are brackets.

    A ``str`` in a table or a panel would be read as markup: ``[bus]`` vanishes, ``[/x]`` raises.
    """
    return Text(printable(text), style)

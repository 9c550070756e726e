"""Reads the table of results again: what each row said of its goal, and what stood beside it."""

import re
from dataclasses import dataclass
from pathlib import Path

from shared.errors import ConfigError

_NUMBER = r"-?[\d,]*\.?\d+(?:e[-+]?\d+)?"
_GOAL = re.compile(
    rf"^\*\*(?P<value>{_NUMBER})(?: \[(?P<low>{_NUMBER}), (?P<high>{_NUMBER})\])?(?: [^*]*)?\*\*"
    rf"(?: \((?P<least>{_NUMBER}) to (?P<most>{_NUMBER}), n = \d+\))?, (?P<name>.*); "
    rf"goal (?P<is>at least|at most) (?P<goal>{_NUMBER})$"
)
_ALSO = re.compile(
    rf"^(?P<name>.*?) (?P<value>{_NUMBER})(?: \[(?P<low>{_NUMBER}), (?P<high>{_NUMBER})\])?"
    r"(?: (?P<unit>\D*))?$"
)
_COLUMNS = 8


@dataclass(frozen=True)
class Figure:
    """A number of a row."""

    name: str
    value: float
    low: float | None = None
    high: float | None = None
    """Of the rounds, or of a 95 % interval."""
    unit: str = ""


@dataclass(frozen=True)
class Row:
    """What one run of a benchmark measured."""

    date: str
    benchmark: str
    main: Figure
    goal: float
    is_at_least: bool
    measured: float
    """What the main figure is a ratio of, in its unit."""
    also: tuple[Figure, ...]
    commit: str

    def over(self, value: float) -> float:
        """Return how many times the goal a value is: over 1 is better than asked for.

        A benchmark whose goal is nought has no such number: nan.
        """
        if self.goal <= 0.0 or value <= 0.0:
            return float("nan")
        return value / self.goal if self.is_at_least else self.goal / value


def rows_of(table: Path) -> tuple[Row, ...]:
    """Return the rows of a table of results, oldest first; withdrawn ones are left out.

    Raises:
        ConfigError: a row is not as `riposte bench --write` writes it.
    """
    found: list[Row] = []
    for number, line in enumerate(table.read_text(encoding="utf-8").splitlines(), 1):
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        is_withdrawn = any(cell.startswith("withdrawn") for cell in cells)
        if not cells[0][:2].isdigit() or is_withdrawn:
            continue
        if len(cells) != _COLUMNS:
            raise ConfigError(f"{table}, line {number}: {len(cells)} cells, expected {_COLUMNS}")
        row = _row(cells)
        if row is None:
            raise ConfigError(
                f"{table}, line {number}: {cells[2]!r} is no figure with a goal; expected "
                "'**0.8** (0.7 to 0.9, n = 5), what it is; goal at least 0.75'"
            )
        found.append(row)
    return tuple(found)


def newest(rows: tuple[Row, ...]) -> dict[str, Row]:
    """Return the last row of each benchmark, by name."""
    return {row.benchmark: row for row in rows}


def _row(cells: list[str]) -> Row | None:
    found = _GOAL.match(cells[2])
    if found is None:
        return None
    low, high = found["low"] or found["least"], found["high"] or found["most"]
    main = Figure(
        name=found["name"],
        value=_number(found["value"]),
        low=None if low is None else _number(low),
        high=None if high is None else _number(high),
    )
    also = tuple(each for each in map(_also, cells[4].split("; ")) if each is not None)
    return Row(
        date=cells[0], benchmark=cells[1], main=main, goal=_number(found["goal"]),
        is_at_least=found["is"] == "at least", measured=_number(cells[3].split()[0]), also=also,
        commit=cells[7],
    )  # fmt: skip


def _also(text: str) -> Figure | None:
    found = _ALSO.match(text)
    if found is None:
        return None
    low, high = (None if found[end] is None else _number(found[end]) for end in ("low", "high"))
    return Figure(found["name"], _number(found["value"]), low, high, found["unit"] or "")


def _number(text: str) -> float:
    return float(text.replace(",", ""))

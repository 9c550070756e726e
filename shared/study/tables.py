"""The tables of a whole study, as columns: what is analysed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
from numpy.typing import NDArray

from shared.errors import StudyError
from shared.study.folder import PARTICIPANTS, Study, open_study
from shared.study.protocol import Protocol
from shared.study.recorded import EVENTS, GAMES, HEART_RATE, QUESTIONNAIRE, RANKINGS
from shared.study.rows import (
    EventRow,
    GameRow,
    HeartRateRow,
    ParticipantRow,
    QuestionnaireRow,
    RankingRow,
)
from shared.study.tsv import read_table

Column = list[str] | NDArray[np.int64] | NDArray[np.float64] | NDArray[np.bool_]
Columns = dict[str, Any]
"""By name: a list of text, or an array of int64, bool, or float64 with NaN for nothing."""

SESSION_TABLES: Final[Mapping[str, type[msgspec.Struct]]] = {
    GAMES: GameRow, HEART_RATE: HeartRateRow, QUESTIONNAIRE: QuestionnaireRow,
    RANKINGS: RankingRow, EVENTS: EventRow,
}  # fmt: skip
"""File of each table in a session's folder, and its kind of rows."""


@dataclass(frozen=True)
class Tables:
    """Everything that a study's people did, a row each, sorted by participant."""

    protocol: Protocol
    is_blinded: bool
    """Whether ``condition`` holds labels, and not names."""
    participants: Columns
    games: Columns
    """Every attempt at every game; those that count are ``finished`` and ``is_recorded``."""
    heart_rate: Columns
    questionnaire: Columns
    rankings: Columns
    """Asked after several sections; the ranking of all is the one with the largest ``after``."""


def load_study(folder: Path, unblind: bool = False) -> Tables:
    """Return the tables of a study.

    Args:
        folder: the study's.
        unblind: conditions by name, by the key of the study; else by label.

    Raises:
        ConfigError: protocol or key are no good.
        StudyError: a table cannot be read, or does not belong here: names line and column; or
            there is no key.
    """
    study = open_study(folder)
    rows = {name: session_rows(study, name) for name in SESSION_TABLES}
    participants = read_table(folder / PARTICIPANTS, ParticipantRow)
    _check_participants(folder, participants)
    names = study.conditions if unblind else None
    return tables_of(
        study.protocol,
        participants,
        games=rows[GAMES],
        heart_rate=rows[HEART_RATE],
        questionnaire=rows[QUESTIONNAIRE],
        rankings=rows[RANKINGS],
        names=names,
    )


def tables_of(
    protocol: Protocol,
    participants: Sequence[ParticipantRow] = (),
    *,
    games: Sequence[Any] = (),
    heart_rate: Sequence[Any] = (),
    questionnaire: Sequence[Any] = (),
    rankings: Sequence[Any] = (),
    names: Mapping[str, str] | None = None,
) -> Tables:
    """Return rows as tables.

    Args:
        protocol: the study's.
        participants: ``ParticipantRow`` each.
        games: ``GameRow`` each.
        heart_rate: ``HeartRateRow`` each.
        questionnaire: ``QuestionnaireRow`` each.
        rankings: ``RankingRow`` each.
        names: condition by label; None leaves the labels.

    Raises:
        StudyError: a row has a label that no condition has.
    """
    made = {
        "participants": columns(participants, ParticipantRow),
        "games": columns(games, GameRow),
        "heart_rate": columns(heart_rate, HeartRateRow),
        "questionnaire": columns(questionnaire, QuestionnaireRow),
        "rankings": columns(rankings, RankingRow),
    }
    if names is not None:
        for table, found in made.items():
            unblind_columns(table, found, names)
    return Tables(protocol=protocol, is_blinded=names is None, **made)


def columns(rows: Sequence[msgspec.Struct], type: type[msgspec.Struct]) -> Columns:
    """Return rows as columns."""
    return {
        field.encode_name: _column([getattr(row, field.name) for row in rows], field.type)
        for field in msgspec.structs.fields(type)
    }


def session_rows(study: Study, name: str) -> list[Any]:
    """Return the rows of one kind of table, of all sessions.

    Raises:
        StudyError: a table cannot be read, or holds rows of another participant.
    """
    rows: list[Any] = []
    for participant, number, folder in study.sessions():
        found: list[Any] = read_table(folder / name, SESSION_TABLES[name])
        for line, row in enumerate(found, start=2):
            if (row.participant, row.session) != (participant, number):
                raise StudyError(
                    f"{folder / name}:{line}: a row of {row.participant}, session {row.session}, "
                    "does not belong into this folder"
                )
        rows += found
    return rows


def unblind_columns(table: str, found: Columns, names: Mapping[str, str]) -> None:
    """Put the names of the conditions where their labels were.

    Raises:
        StudyError: there is a label that no condition has.
    """
    for column in ("condition", "order"):
        if column in found:
            found[column] = [named(table, text, names) for text in found[column]]


def named(table: str, text: str, names: Mapping[str, str]) -> str:
    """Return the names of the conditions for labels with commas between them; none for none.

    Raises:
        StudyError: a label stands for no condition.
    """
    unknown = [label for label in text.split(",") if label and label not in names]
    if unknown:
        raise StudyError(f"{table}: label {unknown[0]!r} stands for no condition (key.toml)")
    return ",".join(names[label] if label else "" for label in text.split(","))


def _check_participants(folder: Path, rows: Sequence[ParticipantRow]) -> None:
    seen: set[tuple[str, int]] = set()
    for line, row in enumerate(rows, start=2):
        if (row.participant, row.session) in seen:
            raise StudyError(
                f"{folder / PARTICIPANTS}:{line}: {row.participant}, session {row.session}, "
                "stands here twice: leave one line"
            )
        seen.add((row.participant, row.session))


def _column(values: list[Any], annotation: object) -> Column:
    if annotation is str:
        return values
    if annotation is bool:
        return np.array(values, np.bool_)
    if annotation is int:
        return np.array(values, np.int64)
    return np.array([np.nan if value is None else value for value in values], np.float64)

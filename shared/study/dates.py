"""Whether the clock of this machine agrees with what the study's folder is dated by."""

import datetime
from typing import Final

import msgspec

from shared.study.folder import CHANGES, Study, read_if_there
from shared.study.instants import MAX_BACK, spoken, text_of
from shared.study.journal import last_event

MAX_PAUSE: Final = 366
"""Days for which a study may rest: a clock that shows more has a wrong year."""
FLAG: Final = "--clock-is-right"
"""Of `riposte study run`: a person has looked at the clock."""


class Known(msgspec.Struct, frozen=True, kw_only=True):
    """The latest instant that a study's folder knows of."""

    at_ns: int
    what: str
    """What happened then, for people."""


def latest_known(study: Study) -> Known | None:
    """Return the later of the last event of all sessions and the last dated line of CHANGES.

    None where nothing has a date. Journals that cannot be read are left out: `study check` names
    them.
    """
    found: list[Known] = []
    for participant, _, folder in study.sessions():
        if (event := last_event(folder)) is not None:
            found.append(Known(at_ns=event.wall_ns, what=f"the last event of {participant}"))
    lines = (read_if_there(study.folder / CHANGES) or b"").decode(errors="replace").splitlines()
    days = (day for line in reversed(lines) if (day := _day_of(line)) is not None)
    if (day := next(days, None)) is not None:
        found.append(Known(at_ns=day, what=f"the last line of {CHANGES}"))
    return max(found, key=lambda known: known.at_ns, default=None)


def date_problem(now_ns: int, known: Known | None) -> str | None:
    """Return why a session should not be dated by this clock, None where it may be right.

    Args:
        now_ns: what the clock shows.
        known: the latest instant that the study's folder knows of.
    """
    if known is None:
        return None
    shows = f"the clock of this machine shows {text_of(max(now_ns, 0))}"
    then = f"{known.what} ({text_of(known.at_ns)})"
    seconds = (now_ns - known.at_ns) / 1e9
    if seconds < -MAX_BACK:
        return (
            f"{shows}, {spoken(-seconds)} before {then}, expected a later time: set it right "
            f"(timedatectl); where it is right now and was wrong then, add {FLAG}"
        )
    if seconds > MAX_PAUSE * 86400.0:
        return (
            f"{shows}, {seconds / 86400.0:.0f} days after {then}, expected at most {MAX_PAUSE}: "
            f"set it right (timedatectl); where it is right and the study rested, add {FLAG}"
        )
    return None


def _day_of(line: str) -> int | None:
    """Return when the day of a line of CHANGES began (ns), None where it has no date."""
    try:
        day = datetime.datetime.strptime(line[:10], "%Y-%m-%d")
    except ValueError:
        return None
    return max(round(day.replace(tzinfo=datetime.UTC).timestamp()), 0) * 10**9

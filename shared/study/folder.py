"""The folder of a study: what is in it, and how it is opened, made and given its orders.

::

    DIR/
      dataset_description.json    what this is, and what wrote it
      protocol.toml               the study
      allocation.tsv              participant -> order of the conditions, as blinded labels
      key.toml                    label -> condition -> player: kept apart, for unblinding
      participants.tsv            a row a session
      CHANGES                     what was done to the data, a line each
      sub-01/ses-01/              a session: journal.jsonl, tables, bouts, recording
"""

import contextlib
import hashlib
import re
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec

from shared.clock import Clock
from shared.config.located import read_toml
from shared.errors import ConfigError, StudyError
from shared.runtime.files import atomic_write
from shared.study.allocation import Assignment
from shared.study.instants import text_of
from shared.study.protocol import Name, Protocol
from shared.study.protocol_file import PATTERNS, read_protocol
from shared.study.rows import SCHEMA, ParticipantRow
from shared.study.steps import Step, steps_of
from shared.study.tsv import read_table, write_table

DESCRIPTION: Final = "dataset_description.json"
PROTOCOL: Final = "protocol.toml"
ALLOCATION: Final = "allocation.tsv"
KEY: Final = "key.toml"
PARTICIPANTS: Final = "participants.tsv"
CHANGES: Final = "CHANGES"
PARTICIPANT: Final = re.compile(r"sub-[0-9]{2,4}\Z")
Label = Annotated[str, msgspec.Meta(pattern="^[A-Z]$")]


class AllocationRow(msgspec.Struct, frozen=True, kw_only=True):
    """A line of ``allocation.tsv``."""

    participant: str
    order: str
    """Labels, first section first: ``B,A``."""


class KeyEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a label means."""

    condition: Name
    player: str
    """As the protocol said when the orders were drawn."""


class Key(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What ``key.toml`` holds."""

    schema: Literal[1] = 1
    study: Name
    seed: int
    people: int
    """How many orders were drawn: whoever withdraws leaves a number that nobody else is given."""
    protocol: Annotated[str, msgspec.Meta(pattern="^[0-9a-f]{64}$")]
    """SHA-256 of protocol.toml when the orders were drawn."""
    label: dict[Label, KeyEntry]


class Study(msgspec.Struct, frozen=True, kw_only=True):
    """An opened study."""

    folder: Path
    protocol: Protocol
    protocol_hash: str
    """SHA-256 of protocol.toml."""
    key: Key | None = None
    """None until the orders are drawn, and where it was taken away for a blinded analysis."""
    assignments: tuple[Assignment, ...] = ()

    @property
    def conditions(self) -> dict[str, str]:
        """Return the names of the conditions by label.

        Raises:
            StudyError: there is no key.
        """
        if self.key is None:
            what = "put the key back" if self.assignments else "draw the orders: `study allocate`"
            raise StudyError(f"{self.folder} has no {KEY}: {what}")
        return {label: entry.condition for label, entry in self.key.label.items()}

    def labels_of(self, participant: str) -> tuple[str, ...]:
        """Return the labels of the conditions in a participant's order.

        Raises:
            StudyError: nobody of that name is expected.
        """
        for each in self.assignments:
            if each.participant == participant:
                return each.order
        names = [each.participant for each in self.assignments]
        if not names:
            raise StudyError(
                f"{self.folder} has no orders yet: say `riposte study allocate {self.folder} "
                f"--people {self.protocol.people} --seed S`"
            )
        raise StudyError(
            f"{participant!r} is not in {self.folder / ALLOCATION}: it has {names[0]} to "
            f"{names[-1]}; for more people draw more orders (`riposte study allocate`)"
        )

    def order_of(self, participant: str) -> tuple[str, ...]:
        """Return the names of the conditions in a participant's order.

        Raises:
            StudyError: nobody of that name is expected, or there is no key.
        """
        labels = self.labels_of(participant)
        conditions = self.conditions
        return tuple(conditions[label] for label in labels)

    def label_of(self, condition: str) -> str:
        """Return the label of a condition; empty where the name is empty.

        Raises:
            StudyError: there is no key, or no such condition.
        """
        found = [label for label, name in self.conditions.items() if name == condition]
        if condition and not found:
            raise StudyError(f"{self.folder / KEY} has no condition {condition!r}")
        return found[0] if condition else ""

    def steps_of(self, participant: str) -> tuple[Step, ...]:
        """Return the steps of a participant's session.

        Raises:
            StudyError: as ``order_of``.
        """
        return steps_of(self.protocol, self.order_of(participant))

    def session_folder(self, participant: str, session: int = 1) -> Path:
        """Return the folder of a session, which need not be there.

        Raises:
            StudyError: ``participant`` is no pseudonym.
        """
        check_participant(participant)
        return self.folder / participant / f"ses-{session:02d}"

    def sessions(self) -> list[tuple[str, int, Path]]:
        """Return participant, number and folder of every session that is there, in order."""
        found: list[tuple[str, int, Path]] = []
        for path in sorted(self.folder.glob("sub-*/ses-*")):
            number = path.name.removeprefix("ses-")
            if PARTICIPANT.match(path.parent.name) and number.isdigit() and path.is_dir():
                found.append((path.parent.name, int(number), path))
        return found


def check_participant(name: str) -> None:
    """Check that a name is a pseudonym, and no person's.

    Raises:
        StudyError: it is none.
    """
    if not PARTICIPANT.match(name):
        raise StudyError(
            f"{name!r} is no participant: participants are sub-01, sub-02, ..., and names of "
            "people stand nowhere in a study"
        )


def hash_of(data: bytes) -> str:
    """Return the SHA-256 of bytes, as it is written everywhere in a study."""
    return hashlib.sha256(data).hexdigest()


def make_study(folder: Path, protocol: bytes, name: str, version: str, clock: Clock) -> Study:
    """Make the folder of a study from the bytes of a protocol.

    Args:
        folder: new, or empty.
        protocol: of ``protocol.toml``.
        name: of the file it came from, for messages.
        version: of Riposte.
        clock: dates the first line of CHANGES.

    Raises:
        ConfigError: the protocol is no good.
        StudyError: the folder holds something.
        RiposteError: it cannot be written.
    """
    read = read_protocol(protocol, name)
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        if folder.is_file() or any(folder.iterdir()):
            raise StudyError(f"{folder} is there already and not empty: name a new folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"cannot make {folder}: {error.strerror or error}") from error
    description = {
        "Name": read.title,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": "riposte", "Version": version}],
        "SourceProtocol": read.source,
        "Schema": SCHEMA,
    }
    text = msgspec.json.format(msgspec.json.encode(description), indent=2)
    atomic_write(folder / DESCRIPTION, text + b"\n")
    write_table(folder / PARTICIPANTS, [], ParticipantRow)
    note_change(folder, f"study {read.name} made", clock)
    atomic_write(folder / PROTOCOL, protocol)  # last: it is what makes the folder a study
    return open_study(folder)


def open_study(folder: Path) -> Study:
    """Return the study in a folder.

    Raises:
        ConfigError: protocol or key are no good; names the line.
        StudyError: it is no study, or its parts do not belong together.
    """
    data, protocol = read_own_protocol(folder)
    if (key := read_key(folder)) is not None:
        _check_key(folder, protocol, key, hash_of(data))
    rows = read_table(folder / ALLOCATION, AllocationRow)
    assignments = tuple(
        Assignment(row.participant, tuple(row.order.split(",")) if row.order else ())
        for row in rows
    )
    _check_assignments(folder / ALLOCATION, protocol, assignments)
    return Study(
        folder=folder, protocol=protocol, protocol_hash=hash_of(data), key=key,
        assignments=assignments,
    )  # fmt: skip


def read_own_protocol(folder: Path) -> tuple[bytes, Protocol]:
    """Return the bytes of a study's protocol, and what they say.

    Raises:
        ConfigError: the protocol is no good.
        StudyError: the folder is no study.
    """
    path = folder / PROTOCOL
    data = read_if_there(path)
    if data is None:
        raise StudyError(f"{folder} is no study: there is no {PROTOCOL} (`riposte study new`)")
    return data, read_protocol(data, str(path))


def read_key(folder: Path) -> Key | None:
    """Return what the labels of a study mean; None where there is no key.

    Raises:
        ConfigError: it is no good; names the line.
    """
    data = read_if_there(folder / KEY)
    return None if data is None else read_toml(data, str(folder / KEY), Key, PATTERNS)


def note_change(folder: Path, text: str, clock: Clock) -> None:
    """Add a dated line to CHANGES.

    Raises:
        RiposteError: it cannot be written.
    """
    before = read_if_there(folder / CHANGES) or b""
    day = text_of(clock.wall_ns())[:10]
    atomic_write(folder / CHANGES, before + f"{day} {text}\n".encode())


def _check_key(folder: Path, protocol: Protocol, key: Key, digest: str) -> None:
    """Check that a key belongs to the protocol beside it.

    Raises:
        StudyError: it does not.
    """
    again = "draw the orders again with the same seed (`riposte study allocate`), or put it back"
    meant = {entry.condition: entry.player for entry in key.label.values()}
    if meant != {each.name: each.player for each in protocol.condition}:
        raise StudyError(
            f"{folder / KEY}: conditions or players are others than in {PROTOCOL}, which was "
            f"changed since: {again}"
        )
    if key.protocol != digest:
        raise StudyError(
            f"{folder / PROTOCOL} was changed after the orders were drawn ({KEY}): {again}"
        )


def _check_assignments(
    path: Path, protocol: Protocol, assignments: tuple[Assignment, ...]
) -> None:  # fmt: skip
    """Check that every participant is there once, with each label once.

    Raises:
        StudyError: says the line.
    """
    labels = [chr(ord("A") + index) for index in range(len(protocol.condition))]
    seen: set[str] = set()
    for line, (participant, order) in enumerate(assignments, start=2):
        if not PARTICIPANT.match(participant):
            raise StudyError(f"{path}:{line}: {participant!r} is no participant (sub-01, ...)")
        if participant in seen:
            raise StudyError(f"{path}:{line}: {participant} stands here twice: leave one line")
        seen.add(participant)
        if sorted(order) != labels:
            raise StudyError(
                f"{path}:{line}: the order of {participant} is {','.join(order) or 'missing'}, "
                f"expected each of {','.join(labels)} once"
            )


def read_if_there(path: Path) -> bytes | None:
    """Return the bytes of a file, None where there is none.

    Raises:
        ConfigError: it cannot be read.
    """
    try:
        return path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise ConfigError(f"cannot read {path}: {error.strerror or error}") from error

"""Every entrance of foreign bytes, and every function that looks like one and is none."""

import dataclasses
import importlib
from pathlib import Path

from tests.fuzz.target import Target


@dataclasses.dataclass(frozen=True)
class Group:
    """Targets that one process reads."""

    name: str
    about: str
    maker: str
    """``module:function`` of what makes its targets, given a folder."""
    inputs: int
    """Of a campaign of a million."""


_HERE = "tests.fuzz.entrances"
GROUPS = (
    Group("wire", "messages on the bus, by type", f"{_HERE}.wire:targets", 640_000),
    Group("robot", "ROS, Vive, heart rate, the page", f"{_HERE}.robot:targets", 280_000),
    Group("states", "snapshots, checkpoints, cuts, ledger", f"{_HERE}.states:targets", 30_000),
    Group("files", "model, bundle, calibration, JSON", f"{_HERE}.texts:files", 20_000),
    Group("sections", "sections of a site file", f"{_HERE}.texts:sections", 12_000),
    Group("pages", "what the pages of a study ask for", f"{_HERE}.pages:targets", 20_000),
    Group("studies", "protocol, journal, tables of a study", f"{_HERE}.studies:targets", 12_000),
    Group("arms", "MJCF files and bags of somebody's robot", f"{_HERE}.arms:targets", 10_000),
    Group("tables", "data sets, archived bouts, recordings", f"{_HERE}.tables:targets", 8_000),
)
"""All entrances."""

ALL = "all"
_OWN = "bytes that this very process, or a child that it started, has just made"
_CHAOS = "a tool that breaks other processes; what it reads it has made itself"
_SHIPPED = "a file that came with this installation"
_BEHIND = "only called by a function that is fuzzed, of which the samples reach it"
NO_ENTRANCES: dict[str, str] = {
    "services.actor.joining:merged": "what the league answered, a message that was fuzzed as such",
    "services.jobs.chaos.clock:step": _CHAOS,
    "services.jobs.chaos.lies:with_other_shape": _CHAOS,
    "services.jobs.chaos.records:_read": _CHAOS,
    "services.jobs.chaos.robot.stand_in:StandIn.conduct_said": _CHAOS,
    "services.jobs.chaos.tail:_event": _CHAOS,
    "services.jobs.tournament.files:write_results": _OWN,
    "services.jobs.tournament.ratings:bouts_of": "makes the table from the ledger; reads no bytes",
    "services.jobs.study.rehearsal_crew:Crew._lines": "a journal; `journal.jsonl` is fuzzed",
    "services.league.leases:evaluation_seed": "the digest of a seed",
    "services.league.ledger:Ledger._open": "the league's own file, locked; readers are fuzzed",
    "services.league.ledger:_connect_read_only": _BEHIND,
    "services.league.service:League._answer_snapshots": "a view of a file whose hash was checked",
    "services.learner.service:_bytes": _OWN,
    "services.page.protocol:": _BEHIND,
    "services.robot_io.tones.player:Player.listen": _OWN,
    "services.robot_io.tones.player:main": _OWN,
    "services.robot_io.tones.sounddevice_sink:SoundCard._listen_to": _OWN,
    "services.study.view:": _BEHIND,
    "shared.config.toml:parse": _BEHIND,
    "shared.identification.dataset.tables:_Csv._table": _BEHIND,
    "shared.messages.wire:": _BEHIND,
    "shared.messages.wire:_field_decoder": _BEHIND,
    "shared.messages.wire:_read_arrays": _BEHIND,
    "shared.runtime.arrays:read_array": _BEHIND,
    "shared.sim.arm:_file": _SHIPPED,
    "shared.sim.plant.export:patched_xml": "a file that was read as an arm before, which is fuzzed",
    "shared.sim.plant.plant:mjcf.read": _BEHIND,
    "shared.styles.onnx:metadata": _OWN,
    "shared.study.journal:": _BEHIND,
    "shared.telemetry.archive:table_of": _BEHIND,
    "shared.telemetry.rrd:end_of_messages": _OWN,
    "shared.telemetry.rrd:trim": _OWN,
}
"""Functions that read bytes nobody else can have written, and why."""


def targets_of(group: str, folder: Path, registry: str = "tests.fuzz.registry") -> list[Target]:
    """Return the targets of a group.

    Args:
        group: its name, or ``ALL``.
        folder: where the targets may write the files that they read.
        registry: module that lists the groups; a test has its own.
    """
    made: list[Target] = []
    for each in importlib.import_module(registry).GROUPS:
        if group in (each.name, ALL):
            module, _, name = each.maker.partition(":")
            made += getattr(importlib.import_module(module), name)(folder / each.name)
    return made

"""Serial training: the same services, in one process, on the memory bus; same seed, same bits.

Time is played time: the clock moves with the control steps that were played, and while everybody
waits, so that every decision that looks at a clock falls the same way in every run. After each
update, and after each evaluation lease, everything under way is brought to rest and a *cut* is
written: one file from which the run continues bit for bit.
"""

import hashlib
import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import structlog
from safetensors import SafetensorError
from safetensors.numpy import load, save

from services.actor.service import Actor
from services.jobs.settings import Settings
from services.league.service import League
from services.learner.checkpoint import CheckpointStore
from services.learner.service import Learner, RunFacts
from services.recorder.service import Recorder
from shared.bus.base import Bus
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.errors import CheckpointError, RiposteError
from shared.messages.training import AGENTS, Agent
from shared.policy.snapshot import Fit
from shared.runtime.files import atomic_write
from shared.runtime.service import StatusReporter, Ticking
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel

log = structlog.get_logger()

KEEP_CUTS = 2
KEEP_CHECKPOINTS = KEEP_CUTS + 1
"""One for each cut kept, one for the version that has no cut yet."""
LEDGER_START = 1
"""The event that every ledger begins with."""
_IDLE_SECONDS = 0.05
_MAX_TICKS_TO_REST = 1000


class Cut(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where all services stood at one moment at which nothing was under way."""

    schema: int = 1
    run: str
    number: int
    clock: float
    """Played seconds."""
    ledger: int
    """Sequence number of the last event."""
    versions: dict[Agent, int]
    """Each learner's checkpoint."""
    actor: dict[str, Any]
    arrays: str
    """SHA-256 of the arrays beside this."""


class SerialRun:
    """All services of a training run, ticked round robin."""

    def __init__(
        self, settings: Settings, folder: Path, run: str, *, resume: bool, record: bool = True
    ) -> None:
        """Build the services, at the newest cut when resuming.

        Args:
            settings: resolved configuration.
            folder: of the run.
            run: its identity.
            resume: continue from the newest usable cut.
            record: write a recording, and show it live.

        Raises:
            CheckpointError: there is nothing to resume from, or none of it is usable.
        """
        self._folder = folder
        self._run = run
        found = newest_cut(folder, run) if resume else None
        self.clock = ManualClock(found[0].clock if found else 0.0)
        self._hub = MemoryHub(self.clock, max_messages=1024)
        self._number = found[0].number if found else 0
        model = FencingModel.build(settings.sim)
        env = FencingEnv(model, settings.game, settings.action, settings.actor.num_envs)
        fit = Fit.of(settings.action, model.cfg.control_timestep, model.hash)
        facts = RunFacts(run=run, seed=settings.learner.seed, fit=fit, rules=settings.game)
        self._step_seconds = settings.sim.control_timestep
        self.league = League(
            settings.league, self._hub.join("league-0"), self.clock, folder, run,
            settings.league.seed, serial=True, rules=settings.game,
        )  # fmt: skip
        if resume:
            self._go_back_to(found[0] if found else None)
        self.actor = Actor(
            settings.actor, settings.reward, env, fit, self._hub.join("actor-0"), self.clock
        )
        self.learners: dict[Agent, Learner] = {
            agent: Learner(
                settings.learner,
                agent,
                facts,
                folder / "learner" / agent,
                self._hub.join(f"learner-{agent}"),
                self.clock,
                version=found[0].versions[agent] if found else None,
            )
            for agent in AGENTS
        }
        self._services: list[tuple[Ticking, StatusReporter]] = []
        roles: list[tuple[str, Ticking]] = [
            ("league", self.league),
            ("actor", self.actor),
            *(("learner", learner) for learner in self.learners.values()),
        ]
        buses: list[Bus] = list(self._hub.buses)
        self._onlookers = int(record)
        if record:
            bus = self._hub.join("recorder-0")
            recorder = Recorder(settings.recorder, bus, self.clock, folder, model)
            roles.append(("recorder", recorder))
            buses.append(bus)
        for (role, service), bus in zip(roles, buses, strict=True):
            self._services.append((service, StatusReporter(service, bus, self.clock, role)))
        if found:
            self.actor.restore(found[1], found[0].actor)
            self._settle()
            log.info("serial_run_resumed", cut=self._number)

    def join(self, name: str) -> Bus:
        """Return one more end of this run's bus, for whoever looks on."""
        return self._hub.join(name)

    @property
    def finished(self) -> bool:
        """Return whether the schedule is done."""
        return self.league.finished

    @property
    def cut_number(self) -> int:
        """Return how many cuts have been written."""
        return self._number

    def tick(self) -> bool:
        """Tick every service once; write a cut where something was completed."""
        before = self._milestone()
        steps = self._steps()
        # A question asked in one round is answered in the next: nobody waits for that.
        did = self._tick_all() or self._tick_all()
        for _, reporter in self._services:
            reporter.tick()
        played = self._steps() - steps
        if played:
            self.clock.advance(played * self._step_seconds)
        elif not did:
            self.clock.advance(_IDLE_SECONDS)
        if self._milestone() != before:
            self._settle()
            self._write_cut()
        return did

    def close(self) -> None:
        """Close the services in reverse order."""
        for service, _ in reversed(self._services):
            service.close()

    def _tick_all(self) -> bool:
        """Tick every service once; return whether one with a say in how time passes did a thing."""
        did = [service.tick() for service, _ in self._services]
        return any(did[: len(did) - self._onlookers])

    def _steps(self) -> int:
        """Return control steps played, in any one world."""
        return self.actor.health().counters["steps"] // self.actor.num_envs

    def _milestone(self) -> tuple[int, ...]:
        """Return what changes when something worth a cut was completed."""
        state = self.league.state
        versions = [learner.version for learner in self.learners.values()]
        return (*versions, state.evaluation_done, int(state.finished))

    def _at_rest(self) -> bool:
        """Return whether nothing is under way and the actor could play its lease, if it has one."""
        services = (self.actor, *self.learners.values())
        return self.actor.ready and all(service.quiet for service in services)

    def _go_back_to(self, cut: Cut | None) -> None:
        """Have ledger and checkpoints forget what came after the cut; without one, everything."""
        self.league.rewind_to(cut.ledger if cut else LEDGER_START)
        for agent in AGENTS:
            store = _checkpoints(self._folder, self._run, agent)
            store.discard_after(cut.versions[agent] if cut else -1)

    def _settle(self) -> None:
        """Tick without letting time pass until all are at rest and have heard all there is."""
        self.actor.paused = True
        for _ in range(_MAX_TICKS_TO_REST):
            if not self._tick_all() and self._at_rest():
                self.actor.paused = False
                return
        states = "; ".join(
            f"{health.state}, waits for {health.waiting_for or 'nobody'}"
            for health in (service.health() for service, _ in self._services)
        )
        raise RiposteError(f"the serial run does not come to rest: {states}")

    def _write_cut(self) -> None:
        arrays, values = self.actor.state()
        self._number += 1
        cut = Cut(
            run=self._run,
            number=self._number,
            clock=self.clock.now(),
            ledger=self.league.ledger_position,
            versions={agent: learner.version for agent, learner in self.learners.items()},
            actor=values,
            arrays=_digest(arrays),
        )
        folder = self._folder / "serial"
        folder.mkdir(exist_ok=True)
        payload = save(arrays, metadata={"cut": json.dumps(msgspec.to_builtins(cut))})
        atomic_write(_cut_path(folder, self._number), payload)
        for old in _cuts(folder)[KEEP_CUTS:]:
            old.unlink(missing_ok=True)


def _cut_path(folder: Path, number: int) -> Path:
    return folder / f"cut-{number:08d}.safetensors"


def _cuts(folder: Path) -> list[Path]:
    """Return the cuts, newest first."""
    return sorted(folder.glob("cut-????????.safetensors"), reverse=True)


def newest_cut(folder: Path, run: str) -> tuple[Cut, dict[str, Any]] | None:
    """Return the newest whole cut of a run whose checkpoints are whole too; None without any.

    Raises:
        CheckpointError: there are some, and none is usable, or they are another run's.
    """
    faults: list[str] = []
    for path in _cuts(folder / "serial"):
        try:
            cut, arrays = _read(path)
            if cut.run != run:
                raise CheckpointError(f"it belongs to run {cut.run}, not {run}")
            for agent, version in cut.versions.items():
                _checkpoints(folder, run, agent).load(version)
        except CheckpointError as error:
            log.error("cut_unusable", path=str(path), reason=str(error))
            faults.append(f"{path.name}: {error}")
            continue
        return cut, arrays
    if faults:
        raise CheckpointError(
            f"no usable cut in {folder / 'serial'}: {'; '.join(faults)}; "
            "start a new run with another --out"
        )
    return None


def _read(path: Path) -> tuple[Cut, dict[str, Any]]:
    """Return a cut.

    Raises:
        CheckpointError: it cannot be read, or is damaged.
    """
    try:
        payload = path.read_bytes()
        length = int.from_bytes(payload[:8], "little")
        header = msgspec.json.decode(payload[8 : 8 + length], type=dict[str, Any])
        cut = msgspec.json.decode(header["__metadata__"]["cut"], type=Cut)
        arrays = load(payload)
    except OSError as error:
        raise CheckpointError(f"cannot be read: {error.strerror}") from None
    except (SafetensorError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise CheckpointError(f"damaged: {' '.join(str(error).split())}") from None
    if _digest(arrays) != cut.arrays:
        raise CheckpointError("damaged: its arrays are not those saved")
    return cut, dict(arrays)


def _digest(arrays: dict[str, Any]) -> str:
    """Return the SHA-256 over names and bytes of the arrays."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()


def _checkpoints(folder: Path, run: str, agent: Agent) -> CheckpointStore:
    """Return a learner's checkpoints, to be read and discarded only."""
    return CheckpointStore(folder / "learner" / agent, run, agent, KEEP_CHECKPOINTS)

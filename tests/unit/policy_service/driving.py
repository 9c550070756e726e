"""A policy on a bus in memory, with a referee and a robot_io that say what they are told to."""

from pathlib import Path

import numpy as np

from services.policy.acting import Acting
from services.policy.config import PolicyConfig
from services.policy.loading import Loader
from services.policy.service import Policy
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.play import (
    BatStates,
    DesiredOffset,
    Phase,
    PlayerReply,
    PlayerRequest,
    RefereeState,
)
from shared.messages.topics import BATS, OFFSET, PLAYER, REFEREE
from shared.messages.training import Agent
from shared.policy.action import ActionConfig
from shared.policy.snapshot import Fit, Snapshot
from shared.sim.arena import arena_of, target_of
from shared.sim.config import SimConfig

SIM = SimConfig()
ACTION = ActionConfig()
FIT = Fit.of(ACTION, SIM.control_timestep, None)


def loader(agent: Agent, run: Path, fit: Fit = FIT, *listed: str) -> Loader:
    return Loader(agent, fit, arena_of(SIM, ACTION), run, frozenset(listed))


def store(run: Path, *snapshots: Snapshot) -> None:
    """Put snapshots where a run keeps them."""
    (run / "snapshots").mkdir(parents=True, exist_ok=True)
    for each in snapshots:
        (run / "snapshots" / f"{each.digest}.safetensors").write_bytes(each.payload)


def en_garde() -> np.ndarray:
    """Return float64[2, 13]: two bats that face each other, at rest."""
    states = np.zeros((2, 13))
    states[:, :3] = (0.5, 0.2, 1.1), (-0.5, -0.2, 1.1)
    states[:, 3:7] = 0.5
    return states


class Stand:
    """The policy and everybody it talks to."""

    def __init__(
        self, run: Path, player: str, agent: Agent = "protagonist", listed: str = ""
    ) -> None:
        self.clock = ManualClock(1000.0)
        self._hub = MemoryHub(self.clock)
        self.bus = self._hub.join("others")
        self.bus.declare_alive("referee")
        acting = Acting(agent, target_of(SIM), ACTION, seed=0)
        self.agent: Agent = agent
        self.policy = Policy(
            PolicyConfig(**{agent: player}), agent, loader(agent, run, FIT, listed), acting,
            self._hub.join("policy-0"), self.clock,
        )  # fmt: skip
        self._offsets = self.bus.subscribe(OFFSET, agent=agent)
        self.tick = 0

    def referee_says(self, phase: Phase, seconds: float = 0.0) -> None:
        state = RefereeState(
            bout="one", phase=phase, antagonist="a", protagonist="p", tick=0, step=0,
            seconds=seconds,
            score=0.0, points=0.0, in_target=np.zeros(2, np.bool_), contact=False,
            attack_steps=0, penalty_steps=0, camping_steps=0, missed_ticks=0, tone_hz=0.0,
        )  # fmt: skip
        self.bus.publish(REFEREE, state)

    def send(
        self,
        bats: np.ndarray | None = None,
        seconds: float = 0.0,
        *,
        age: float = 0.0,
        tick: int | None = None,
        is_valid: tuple[bool, bool] = (True, True),
    ) -> None:
        """Publish a tick."""
        self.tick = self.tick + 1 if tick is None else tick
        self.bus.publish(
            BATS,
            BatStates(
                tick=self.tick, boot="b", at_ns=self.clock.wall_ns() - round(age * 1e9),
                bats=en_garde() if bats is None else bats, tools=np.zeros((2, 7)),
                is_valid=np.array(is_valid), seconds=seconds,
            ),
        )  # fmt: skip

    def answer(self) -> DesiredOffset | None:
        """Let the policy look once; return its answer, which must be the only one."""
        self.policy.tick()
        answer = self._offsets.take()
        assert self._offsets.take() is None
        return answer

    def ask(self, player: str) -> PlayerReply:
        pending = self.bus.ask(PLAYER, PlayerRequest(player=player), 1.0, agent=self.agent)
        self.policy.tick()
        answer = pending.take()
        assert isinstance(answer, PlayerReply), answer
        return answer

    @property
    def counters(self) -> dict[str, int]:
        return self.policy.health().counters
